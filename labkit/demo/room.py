"""The phones' page: a second listener with a join code, there only with --vote.

It serves a page, a question and takes a vote; nothing of the lecturer's pages can be reached through it. A phone asks
what there is to vote on, and is answered when that changes (a long poll). Requests are small, and limited in rate: each
device, and each address, since one could claim to be many devices.
"""

import asyncio
import contextlib
import io
import json
import secrets
import socket
from collections import OrderedDict
from pathlib import Path
from time import monotonic

import segno
import tornado.web

from .server import Quiet, Static
from .vote import Refused

HERE = Path(__file__).parent
LETTERS = "abcdefghjkmnpqrstuvwxyz23456789"  # none that looks like another
CODE_LENGTH = 5
MAX_BODY = 2048
PATIENCE = 25.0  # s of a long poll
MAX_POLLS = 1500
DEVICE_RATE, DEVICE_BURST = 2.0, 20  # requests a second, and at once
ADDRESS_RATE, ADDRESS_BURST = 400.0, 4000  # a whole room may come from one address
REMEMBERED = 5000  # devices and addresses whose rate is known
COOKIE = "labkit-vote"
POLICY = "default-src 'self'; style-src 'self'; script-src 'self'; base-uri 'none'; form-action 'self'"


class Rate:
    """How many requests each key may still make: `burst` at once, and `rate` a second."""

    def __init__(self, rate, burst):
        self.rate, self.burst, self.left = rate, burst, OrderedDict()

    def allows(self, key):
        """Whether one more is allowed; it then counts."""
        now = monotonic()
        left, since = self.left.pop(key, (self.burst, now))
        left = min(self.burst, left + self.rate * (now - since))
        allowed = left >= 1
        self.left[key] = (left - allowed, now)
        while len(self.left) > REMEMBERED:
            self.left.popitem(last=False)
        return allowed


class Room:
    """The room that votes: where it joins, who waits for a question.

    Parameters
    ----------
    votes : Votes
    counted : function()
        Called when a vote has been counted.
    """

    def __init__(self, votes, counted):
        self.votes, self.counted = votes, counted
        self.code = "".join(secrets.choice(LETTERS) for _ in range(CODE_LENGTH))
        self.host, self.port = "127.0.0.1", 0
        self.waiting, self.joined = set(), OrderedDict()
        self.devices, self.addresses = Rate(DEVICE_RATE, DEVICE_BURST), Rate(ADDRESS_RATE, ADDRESS_BURST)

    @property
    def address(self):
        """What phones open."""
        return f"http://{self.host}:{self.port}/{self.code}"

    def invitation(self):
        """What the wall says, as plain data."""
        return {
            "address": self.address.removeprefix("http://"),
            "joined": len(self.joined),
            "reachable": not self.host.startswith("127."),
        }

    def code_svg(self):
        """The QR code of the address."""
        file = io.BytesIO()
        segno.make(self.address, error="m", micro=False).save(file, kind="svg", scale=8, border=3, light="#ffffff")
        return file.getvalue()

    def wake(self):
        """All phones that wait learn what there is."""
        for future in self.waiting:
            if not future.done():
                future.set_result(None)

    async def change(self, version):
        """Wait until there is something newer than a version, or patience ends."""
        if self.votes.version != version or len(self.waiting) >= MAX_POLLS:
            return
        future = asyncio.get_running_loop().create_future()
        self.waiting.add(future)
        try:
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(future, PATIENCE)
        finally:
            self.waiting.discard(future)

    def join(self, device):
        """A device has opened the page."""
        if device not in self.joined:
            self.joined[device] = None
            while len(self.joined) > REMEMBERED:
                self.joined.popitem(last=False)
            self.counted()


def own_address():
    """An address of this machine that phones in its network reach; 127.0.0.1 where there is none. Nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, contextlib.suppress(OSError):
        probe.connect(("192.0.2.1", 9))  # an address for examples; only the route to it is asked
        return probe.getsockname()[0]
    return "127.0.0.1"


class Phone(Quiet, tornado.web.RequestHandler):
    """What all answers to phones share: the code, the device, the rate."""

    def initialize(self, room):
        self.room = room

    def set_default_headers(self):
        self.set_header("Content-Security-Policy", POLICY)
        self.set_header("Cache-Control", "no-store")
        self.set_header("Referrer-Policy", "no-referrer")

    def prepare(self):
        device = self.get_signed_cookie(COOKIE, max_age_days=1)
        self.device = device.decode() if device else ""
        fast = not self.room.addresses.allows(self.request.remote_ip)
        if fast or (self.device and not self.room.devices.allows(self.device)):
            self.refuse(429, "Too many requests at once: wait a moment.")

    def refuse(self, status, sentence):
        self.set_status(status)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(sentence)

    def knows(self, code):
        """Whether the code is today's; else it is said."""
        if secrets.compare_digest(code.encode(), self.room.code.encode()):
            return True
        self.refuse(404, STALE)
        return False


STALE = "No vote is held under this code. The address on the wall is the one."


class Join(Phone):
    """/ : type the code."""

    def get(self):
        self.finish((HERE / "join.html").read_bytes())


class Ballot(Phone):
    """/code : the page."""

    def get(self, code):
        if not self.knows(code):
            return
        if not self.device:
            self.device = secrets.token_hex(12)
            self.set_signed_cookie(COOKIE, self.device, expires_days=1, httponly=True, samesite="Lax")
        self.room.join(self.device)
        self.finish((HERE / "phone.html").read_bytes())


class Now(Phone):
    """/code/now?seen=N : what there is to vote on, once it is no longer number N."""

    async def get(self, code):
        if not self.knows(code):
            return
        seen = self.get_query_argument("seen", "")
        if seen.isdecimal():
            await self.room.change(int(seen[:12]))
        self.finish(self.room.votes.seen_by(self.device))


class Cast(Phone):
    """/code/vote : one answer."""

    def post(self, code):
        if not self.knows(code):
            return
        if not self.device:
            return self.refuse(
                403, "This device has not joined: open the address on the wall. Cookies must be allowed."
            )
        try:
            vote = json.loads(self.request.body)
            self.room.votes.cast(self.device, vote["key"], vote["round"], vote["answer"])
        except Refused as reason:
            return self.refuse(409, str(reason))
        except (ValueError, KeyError, TypeError, RecursionError):
            return self.refuse(400, "That is no vote.")
        self.room.counted()
        self.finish({"counted": True})


class Lost(Phone):
    """Any other address."""

    def prepare(self):
        super().prepare()
        if not self._finished:
            self.refuse(404, STALE)


def application(room):
    """The phones' listener."""
    given = {"room": room}
    code = r"([^/]{1,40})"
    return tornado.web.Application(
        [
            (r"/", Join, given),
            (r"/(phone\.(?:js|css))", Static, {"path": HERE}),
            (rf"/{code}", Ballot, given),
            (rf"/{code}/now", Now, given),
            (rf"/{code}/vote", Cast, given),
        ],
        default_handler_class=Lost,
        default_handler_args=given,
        cookie_secret=secrets.token_hex(32),
        log_function=lambda handler: None,
    )


LISTENING = {"max_body_size": MAX_BODY, "max_header_size": 8192, "idle_connection_timeout": 60, "body_timeout": 5}
