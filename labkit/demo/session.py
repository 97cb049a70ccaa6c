"""What is shown at the moment; every window of the lecturer shares it."""

from . import notes
from .house import House
from .program import NotThere
from .vote import Refused, Votes

STEPS = ("question", "figure", "answer")


class Session:
    """One demo: its program, its Stages, the card shown last, how far each is revealed, and the votes.

    Parameters
    ----------
    program : Program
    counts : {mistake id: count}
        How often a class made each named mistake; empty where no class was judged.
    """

    def __init__(self, program, counts=None):
        self.program, self.counts = program, counts or {}
        self.windows = set()
        self.steps = {}
        self.now = program.cards[0].key
        self.votes, self.room = Votes(), None
        self.house = House(program.makers(), self._deliver, self.say, self._made)

    # -- to the windows

    def say(self, sentence):
        """One sentence to all windows: something went wrong."""
        self._tell({"kind": "said", "text": sentence})

    def tell(self):
        """All windows learn what is shown."""
        self._tell(self.state())

    def state(self):
        """What every window must know, as plain data."""
        ballot = self.votes.ballots.get(self.now)
        return {
            "kind": "now",
            "key": self.now,
            "step": self.step(self.now),
            "ballot": ballot.shown() if ballot else None,
            "voting": self.room.invitation() if self.room else None,
        }

    def _tell(self, message):
        for window in list(self.windows):
            window.tell(message)

    def _deliver(self, stage, frame):
        for window in list(self.windows):
            if window.stage == stage:
                window.show(frame)

    def _made(self, key, stage):
        if not any(window.stage == key for window in self.windows):
            self._tell({"kind": "ahead", "stage": key, "declaration": stage.declaration()})

    # -- from the windows

    def step(self, key):
        """How far a card is revealed: "question", "figure" or "answer"."""
        card = self.program[key]
        return self.steps.get(key, "question" if card.asked else "figure")

    async def open(self, window, key):
        """A window shows a card: it learns what the Stage declares, or why there is none."""
        card = self.program[key]
        self.now, window.key, window.stage = key, key, ""
        self.tell()
        stage = fault = None
        if card.stage:
            stage, fault = await self.house.get(card.stage)
            if window.key != key:
                return  # it has gone on meanwhile
            window.stage = card.stage if stage else ""
        window.tell({"kind": "card", "key": key, "declaration": stage and stage.declaration(), "fault": fault or ""})
        self.house.prepare(self.program.after(key), {w.stage for w in self.windows if w.stage})

    def draw_ahead(self, stage, look):
        """A window knows the size that a Stage will have which no window shows yet."""
        if not any(window.stage == stage for window in self.windows):
            self.house.draw_ahead(stage, look)

    def reveal(self, key, step):
        """Show a card up to a step."""
        if step not in STEPS:
            raise NotThere(f"A card has the steps {', '.join(STEPS)}, got {step!r}.")
        self.program[key]
        self.steps[key] = step
        self.tell()

    def start_again(self):
        """All Stages, and all cards, as in the beginning; the votes stay."""
        self.steps.clear()
        self.house.start_again()
        self.tell()

    def vote(self):
        """The next thing of a vote on the card shown: open the first round, close it, open the second, close it."""
        if self.room is None:
            raise Refused("Nobody can vote: the demo was started without --vote.")
        card = self.program[self.now]
        if not card.asked:
            raise Refused("There is no question here to vote on.")
        ballot = self.votes.ballots.get(self.now)
        if ballot and ballot.open:
            self.votes.close()
        else:
            self.votes.open(self.now, card.asked)
        self.room.wake()
        self.tell()

    def notes(self, key):
        """What the lecturer alone reads on a card, as plain data."""
        card = self.program[key]
        place = self.program.cards.index(card)
        following = self.program.cards[place + 1] if place + 1 < len(self.program.cards) else None
        told = notes.of(card.stage or key)
        return {
            **card.declaration(),
            **told,
            "mistakes": [
                {"exercise": exercise, "text": text, "count": count}
                for exercise, text, count in notes.mistakes(card.near, self.counts)
            ],
            "counted": bool(self.counts),
            "next": following.declaration() if following else None,
        }
