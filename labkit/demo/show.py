"""A demo from its first listener to its end."""

import asyncio
import contextlib
import ctypes
import logging
import signal
import webbrowser

from . import room as rooms
from . import server
from .house import collect
from .session import Session

TELL_EVERY = 0.1  # s: votes that arrive together are one message to the wall
LARGE = 1 << 18  # bytes of a piece of memory that goes back to the system as soon as it is free
OPEN_FILES = 4096  # three hundred phones are as many connections; some systems begin with 256


class Demo:
    """The listeners of one demo; made within a running event loop.

    Parameters
    ----------
    program : Program
    ip, port : where the lecturer's pages are; without a port the first free one.
    counts : {mistake id: count}, of a class that was judged.
    """

    def __init__(self, program, ip="127.0.0.1", port=None, counts=None):
        for name in ("tornado.access", "tornado.general", "tornado.application"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # malformed requests are answered, not told
        self.session = Session(program, counts)
        self.application = server.Application(self.session)
        self.server, self.port = server.listen(self.application, ip, port)
        self.host = "127.0.0.1" if ip in ("", "0.0.0.0") else "[::1]" if ip == "::" else f"[{ip}]" if ":" in ip else ip
        self.phones, self._telling = None, None

    @property
    def address(self):
        """What the lecturer's browser opens."""
        return f"http://{self.host}:{self.port}/?token={self.application.token}"

    def let_vote(self, ip=None):
        """Open the second listener; phones reach it at `ip`, or at what this machine is called in its network."""
        raise_open_files()
        room = rooms.Room(self.session.votes, self._counted)
        room.host = ip or rooms.own_address()
        self.phones, room.port = server.listen(
            rooms.application(room), ip or "0.0.0.0", first=self.port + 1, **rooms.LISTENING
        )
        self.session.room = room
        return room

    def _counted(self):
        if self._telling is None:
            self._telling = asyncio.get_running_loop().call_later(TELL_EVERY, self._tell)

    def _tell(self):
        self._telling = None
        self.session.tell()

    def close(self):
        """Both listeners end, and the Stages' thread."""
        for listener in filter(None, (self.server, self.phones)):
            listener.stop()
        self.session.house.close()


def raise_open_files():
    """Let this process hold as many connections as a full room makes, where the system has such a limit."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        wanted = OPEN_FILES if hard == resource.RLIM_INFINITY else min(OPEN_FILES, hard)
        if soft < wanted:
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


def give_pixels_back():
    """Let what held pixels go back to the system at once, where the C library is glibc.

    It would raise the size from which it does so with each large piece that is freed; the pictures of a large window
    then lie among small things that stay, and a demo of some hours grows by half a megabyte at each turn of the page.
    """
    with contextlib.suppress(OSError, AttributeError, TypeError):  # another C library, or Windows
        ctypes.CDLL(None).mallopt(-3, LARGE)  # M_MMAP_THRESHOLD; setting it ends the raising


async def run(program, options, counts):
    """Show a program until Ctrl-C; `options` are those of the verb."""
    give_pixels_back()
    demo = Demo(program, options.ip, options.port, counts)
    demo.session.house.collect = collect
    room = demo.let_vote(options.vote_ip) if options.vote else None
    first = program.cards[0].stage
    made = first and (await demo.session.house.get(first))[0]  # a browser that opens finds it ready
    stages = sum(bool(card.make) for card in program.cards)
    print(f"{stages} Stages at {demo.address}\nStop with Ctrl-C in this window.", flush=True)
    if made:
        demo.session.house.warm(first)  # while the browser starts
    if room:
        _tell_of(room)
    if not options.no_browser:
        await asyncio.to_thread(_open_browser, demo.address)
    ended = asyncio.Event()
    with contextlib.suppress(NotImplementedError, ValueError):  # Windows ends the process itself
        for number in (signal.SIGINT, signal.SIGTERM):
            asyncio.get_running_loop().add_signal_handler(number, ended.set)
    await ended.wait()
    demo.close()
    held = [key for key, ballot in demo.session.votes.ballots.items() if ballot.rounds]
    print("\nThe demo has ended" + (f", and the votes on {', '.join(held)} with it." if held else "."))


def _open_browser(address):
    try:
        opened = webbrowser.open(address)
    except webbrowser.Error:
        opened = False
    if not opened:
        print("No browser could be opened from here: open the address above in one.", flush=True)


def _tell_of(room):
    if room.invitation()["reachable"]:
        print(
            f"Phones vote at {room.address} . If none gets there, the network keeps devices apart (guest networks do) "
            "or the firewall of this machine does; then open a hotspot with a phone and join it with this machine, "
            "or ask for hands.",
            flush=True,
        )
    else:
        print(f"This machine is in no network that phones could share: they can vote at {room.address} on it alone.")
