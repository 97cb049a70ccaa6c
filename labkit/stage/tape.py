"""What a simulation was at moments gone by, so that its time can be scrubbed backward, and forward again."""

import copy

PLACES = 80  # moments kept of a whole play; those between are simulated again


class Tape:
    """Copies of a simulation's memory by the number of their step.

    steps : of the whole play.
    """

    def __init__(self, steps):
        self.stride, self.places = max(1, round(steps / PLACES)), {}

    def keep(self, step, memory, always=False):
        """Keep the memory after a step, if the step is one of those that are kept."""
        if always or step % self.stride == 0:
            self.places[step] = copy.deepcopy(memory)

    def cut(self, step):
        """Forget what came after a step: something else will."""
        self.places = {place: memory for place, memory in self.places.items() if place <= step}

    def at(self, step):
        """(step, memory) of the last kept moment up to a step."""
        place = max(place for place in self.places if place <= step)
        return place, copy.deepcopy(self.places[place])
