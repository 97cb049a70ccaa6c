"""The lecturer's pages: the demo and the notes, on this machine, behind a token as JupyterLab's.

The page speaks to one WebSocket: {"open": key}, {"to": stage, "message": ...} for a Stage, {"ahead": stage,
"look": ...}, {"reveal": key, "step": ...}, {"again": true}, {"vote": true}. It hears of what is shown as JSON, and of a
Stage's pictures as `house.framed` bytes.
"""

import errno
import hmac
import json
import secrets
import socket
from pathlib import Path

import tornado.httpserver
import tornado.netutil
import tornado.web
import tornado.websocket

from ..stage import stage as engine
from . import program as programs

HERE = Path(__file__).parent
STAGE = Path(engine.__file__).parent
MAX_MESSAGE = 1 << 20  # bytes; a long stroke drawn in one go takes some 20 kB
MAX_WAITING = 20  # messages of a window that wait for the Stages; a page sends its next one when the last is answered
POLICY = "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; connect-src 'self' ws: wss:"
FIRST_PORT, PORTS = 8890, 50
NOT_HERE = {getattr(errno, name, None) for name in ("EADDRNOTAVAIL", "WSAEADDRNOTAVAIL")}
FOREIGN = "{} is no address of this machine. Name one of its own, or leave the option out."


class Taken(ValueError):
    """No port is free, or the address is not of this machine; said in one sentence."""


def listen(application, ip, port=None, first=FIRST_PORT, **options):
    """An HTTP server for an application; returns (server, port).

    Parameters
    ----------
    port : int, optional
        Left out, the first free one from `first` on.

    Raises
    ------
    Taken
        When the port is taken, forbidden or none, or the address is none of this machine.
    """
    if port is not None and not 0 < port < 65536:
        raise Taken(f"A port is a number from 1 to 65535, and {port} is none.")
    for number in [port] if port else range(first, first + PORTS):
        try:
            sockets = tornado.netutil.bind_sockets(number, ip, reuse_port=False)
        except socket.gaierror:
            raise Taken(FOREIGN.format(ip)) from None
        except OSError as error:
            if error.errno in NOT_HERE:
                raise Taken(FOREIGN.format(ip)) from None
            continue
        server = tornado.httpserver.HTTPServer(application, **options)
        server.add_sockets(sockets)
        return server, number
    if port:
        raise Taken(f"Port {port} is taken. Choose another with --port, or leave the option out.")
    raise Taken(f"The ports {first} to {first + PORTS - 1} are all taken. Choose another with --port.")


class Quiet:
    """Faults of a handler as one sentence, on the page and nowhere else."""

    def write_error(self, status_code, **_):
        said = {403: FORBIDDEN, 404: "There is no such page here.", 405: "That is not done here."}
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(said.get(status_code, "This request cannot be answered."))

    def log_exception(self, kind, error, traceback):
        if not isinstance(error, tornado.web.HTTPError):
            print(f"A request could not be answered: {kind.__name__}: {error}", flush=True)


FORBIDDEN = "This page opens with the address that stands in the terminal: it ends in a token."


class Own(Quiet, tornado.web.RequestHandler):
    """Whatever only the lecturer may read: with the token in the address, or in the cookie left by it."""

    def prepare(self):
        token, name = self.application.settings["token"], self.application.settings["cookie"]
        given = self.get_query_argument("token", "")
        if given and hmac.compare_digest(given.encode(), token.encode()):
            self.set_cookie(name, token, httponly=True, samesite="Lax")  # a slide may link here
            if self.request.method == "GET" and not isinstance(self, Line):
                self.redirect(self.request.path)
        elif not hmac.compare_digest(self.get_cookie(name, "").encode(), token.encode()):
            raise tornado.web.HTTPError(403)

    def set_default_headers(self):
        self.set_header("Content-Security-Policy", POLICY)
        self.set_header("Referrer-Policy", "no-referrer")
        self.set_header("Cache-Control", "no-store")

    @property
    def session(self):
        return self.application.settings["session"]


class Nothing(Own):
    """Any other address."""

    def prepare(self):
        super().prepare()
        raise tornado.web.HTTPError(404)


class Page(Own):
    """demo.html or notes.html."""

    def initialize(self, file):
        self.file = file

    def get(self):
        self.finish((HERE / self.file).read_bytes())


class Program(Own):
    """What there is to show, once."""

    def get(self):
        program = self.session.program
        self.finish({
            "cards": [card.declaration() for card in program.cards],
            "titles": program.titles,
            "pictures": [card.key for card in program.cards if self.application.picture(card)],
            "voting": self.session.room is not None,
            "now": self.session.now,
        })  # fmt: skip


class Picture(Own):
    """The small picture of a card."""

    def get(self, key):
        png = self.application.picture(self.session.program[key]) if key in self.session.program else None
        if not png:
            raise tornado.web.HTTPError(404)
        self.set_header("Content-Type", "image/png")
        self.set_header("Cache-Control", "private, max-age=3600")
        self.finish(png)


class Code(Own):
    """The QR code of the address at which phones vote."""

    def get(self):
        if self.session.room is None:
            raise tornado.web.HTTPError(404)
        self.set_header("Content-Type", "image/svg+xml")
        self.finish(self.session.room.code_svg())


class Table(Own):
    """The votes of all closed rounds as a file."""

    def get(self):
        self.set_header("Content-Type", "text/csv; charset=utf-8")
        self.set_header("Content-Disposition", 'attachment; filename="votes.csv"')
        self.finish(self.session.votes.csv())


class Notes(Own):
    """What the lecturer alone reads on a card."""

    def get(self, key):
        if key not in self.session.program:
            raise tornado.web.HTTPError(404)
        self.finish(self.session.notes(key))


class Line(Own, tornado.websocket.WebSocketHandler):
    """One window of the lecturer."""

    key = stage = ""
    waiting = 0

    def open(self):
        self.set_nodelay(True)
        self.session.windows.add(self)
        self.tell(self.session.state())

    def on_close(self):
        self.session.windows.discard(self)

    async def on_message(self, text):
        try:
            await self._hear(json.loads(text))
        except ValueError as error:  # also what is no JSON, and every refusal of the session
            self.tell({"kind": "said", "text": " ".join(str(error).split())})
        except (KeyError, TypeError, RecursionError):
            self.tell({"kind": "said", "text": "The page sent what nobody understands; reload it."})

    async def _hear(self, message):
        if not isinstance(message, dict):
            raise TypeError("a message is an object")
        if "to" in message:
            self._pass_on(message["to"], message["message"])
        elif "open" in message:
            await self.session.open(self, message["open"])
        elif "ahead" in message:
            self.session.draw_ahead(message["ahead"], message["look"])
        elif "reveal" in message:
            self.session.reveal(message["reveal"], message["step"])
        elif "again" in message:
            self.session.start_again()
        elif "vote" in message:
            self.session.vote()
        else:
            raise KeyError("none of these")

    def _pass_on(self, stage, message):
        if self.waiting >= MAX_WAITING:
            raise ValueError("More came at once than the figures can follow; the rest is left out.")
        self.waiting += 1
        self.session.house.receive(stage, message, self._answered)

    def _answered(self):
        self.waiting -= 1

    def tell(self, message):
        self._write(json.dumps(message), False)

    def show(self, frame):
        self._write(frame, True)

    def _write(self, content, binary):
        if self.ws_connection is not None and not self.ws_connection.is_closing():
            self.write_message(content, binary=binary)


class Static(Quiet, tornado.web.StaticFileHandler):
    """Scripts and styles, which hold nothing of the lecturer's."""

    def set_extra_headers(self, path):
        self.set_header("Cache-Control", "no-cache")


class Application(tornado.web.Application):
    """The lecturer's listener.

    Parameters
    ----------
    session : Session
    token : str, optional
        Left out, a random one.
    """

    def __init__(self, session, token=None):
        self.token = token or secrets.token_hex(24)
        self._pictures = None
        super().__init__(
            [
                (r"/", Page, {"file": "demo.html"}),
                (r"/notes", Page, {"file": "notes.html"}),
                (r"/program.json", Program),
                (r"/picture/(.+)", Picture),
                (r"/notes/(.+)", Notes),
                (r"/code.svg", Code),
                (r"/votes.csv", Table),
                (r"/line", Line),
                (r"/(stage\.(?:js|css)|space\.js)", Static, {"path": STAGE}),
                (r"/((?:demo|notes|common)\.(?:js|css))", Static, {"path": HERE}),
            ],
            default_handler_class=Nothing,
            session=session,
            token=self.token,
            cookie=f"labkit-demo-{secrets.token_hex(4)}",
            websocket_max_message_size=MAX_MESSAGE,
            websocket_ping_interval=30,
            log_function=lambda handler: None,
        )

    def picture(self, card):
        """PNG of a card's Stage as the notebook stores it, or None."""
        if self._pictures is None:
            self._pictures = programs.thumbnails(self.settings["session"].program.titles)
        return self._pictures.get((card.stage.partition("/")[0], card.cell)) if card.stage else None
