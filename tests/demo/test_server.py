"""The two listeners, over real sockets: tokens, codes, limits, faults of a Stage, and what reaches whom."""

import asyncio
import json
import socket
import threading
import urllib.parse
from types import SimpleNamespace

import numpy as np
import pytest
import segno
import tornado.httpclient
import tornado.websocket

from labkit.demo import room as rooms
from labkit.demo import server, window
from labkit.demo.program import Asked, Card, Program
from labkit.demo.show import Demo
from labkit.stage import Handle, Slider, Stage

LOOK = {"width": 700, "height": 400, "ratio": 1, "dark": False, "letters": 1}
SECONDS = 20


def good():
    """Drag the point."""

    def scene(fig):
        ax = fig.subplots()
        ax.set(xlim=(0, 10), ylim=(0, 10))
        (dot,) = ax.plot([], [], "o")

        def update(state, result):
            dot.set_data([state["P"][0]], [state["P"][1]])

        return [dot], update

    return Stage(
        "good", scene=scene, compute=compute, fail={"P": (9, 9)}, handles={"P": Handle((1, 2))},
        controls={"n": Slider(0, 5, 1)}, describe=lambda result: f"at {result:.0f}",
    )  # fmt: skip


def compute(state):
    if state["n"] == 5:
        raise ValueError("five is too many")
    if state["n"] == 4:
        raise KeyError("four")
    return np.hypot(*state["P"])


def bad():
    """Never there."""
    raise ZeroDivisionError("nothing to divide by")


ASKED = Asked("Which?", ("a", "b"), "b", "It was b.")


def cards():
    return [
        Card("01/good", "01", "First", "01/good", good, ASKED),
        Card("01/bad", "01", "Second", "01/bad", bad),
        Card("01/also-good", "01", "Third", "01/also-good", good),
        Card("01/word", "01", "Fourth", asked=Asked("How far?", (), 3.0, unit="mm")),
    ]


def in_demo(work, vote=False, seconds=SECONDS, shown=None):
    """Run `work(demo)` beside a demo of `shown` cards, or of `cards()`, on the first free ports."""

    async def run():
        demo = Demo(Program(shown or cards(), {"01": "One"}))
        if vote:
            demo.let_vote("127.0.0.1")
        try:
            return await asyncio.wait_for(work(demo), seconds)
        finally:
            demo.close()

    return asyncio.run(run())


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


async def fetch(demo, path, token=True, **given):
    """(status, text) at the lecturer's listener."""
    cookie = {"Cookie": f"{demo.application.settings['cookie']}={demo.application.token}"} if token else {}
    answer = await tornado.httpclient.AsyncHTTPClient().fetch(
        f"http://127.0.0.1:{demo.port}{path}", headers=cookie, raise_error=False, follow_redirects=False, **given
    )
    return answer.code, answer.body.decode(errors="replace")


async def phone(room, path, cookie="", **given):
    """(status, text, cookie) at the phones' listener."""
    answer = await tornado.httpclient.AsyncHTTPClient().fetch(
        f"http://127.0.0.1:{room.port}{path}", headers={"Cookie": cookie} if cookie else {}, raise_error=False, **given
    )
    kept = answer.headers.get("Set-Cookie", "").partition(";")[0] or cookie
    return answer.code, answer.body.decode(), kept


class Window:
    """A window of the lecturer's: what it hears, as a list."""

    def __init__(self, demo):
        self.demo = demo

    async def __aenter__(self):
        cookie = f"{self.demo.application.settings['cookie']}={self.demo.application.token}"
        request = tornado.httpclient.HTTPRequest(f"ws://127.0.0.1:{self.demo.port}/line", headers={"Cookie": cookie})
        self.line = await tornado.websocket.websocket_connect(request)
        return self

    async def __aexit__(self, *_):
        self.line.close()

    def send(self, message):
        self.line.write_message(message if isinstance(message, str) else json.dumps(message))

    async def until(self, wanted):
        """The first message for which `wanted(message)` holds; a picture is a dictionary with "picture"."""
        while True:
            heard = await self.line.read_message()
            assert heard is not None, "the line was closed"
            message = json.loads(heard) if isinstance(heard, str) else picture(heard)
            if wanted(message):
                return message

    async def open(self, key):
        self.send({"open": key})
        return await self.until(lambda m: m.get("kind") == "card" and m["key"] == key)

    async def ask(self, stage, **message):
        self.send({"to": stage, "message": {"serial": "s", "shown": 99, **message}})
        return await self.until(lambda m: m.get("serial") == "s")


def picture(frame):
    count = int.from_bytes(frame[:4], "little")
    length = int.from_bytes(frame[4:8], "little")
    return json.loads(frame[4 + 4 * count : 4 + 4 * count + length])


def test_a_key_does_not_wait_for_the_stage_that_is_made_ahead():
    begun, go = threading.Event(), threading.Event()

    def slow():
        begun.set()
        go.wait(SECONDS)
        return good()

    async def work(demo):
        async with Window(demo) as window:
            await window.open("01/good")
            assert await asyncio.to_thread(begun.wait, SECONDS)
            assert (await window.ask("01/good", look=LOOK))["picture"]
            go.set()
            assert (await window.open("01/slow"))["declaration"]

    try:
        in_demo(work, shown=[*cards()[:1], Card("01/slow", "01", "Second", "01/slow", slow)])
    finally:
        go.set()


def test_a_link_on_a_slide_takes_the_token_along():
    async def work(demo):
        address = f"http://127.0.0.1:{demo.port}/?token={demo.application.token}"
        client = tornado.httpclient.AsyncHTTPClient()
        answer = await client.fetch(address, raise_error=False, follow_redirects=False)
        kept = answer.headers["Set-Cookie"]
        assert "HttpOnly" in kept and "SameSite=Lax" in kept  # sent where one follows a link, and nowhere else

    in_demo(work)


def test_without_the_token_nothing_is_shown():
    async def work(demo):
        paths = (
            "/",
            "/notes",
            "/program.json",
            "/picture/01/good",
            "/notes/01/good",
            "/votes.csv",
            "/code.svg",
            "/line",
        )
        for path in (*paths, "/?token=wrong", "/?token=%00", "/nothing"):
            status, text = await fetch(demo, path, token=False)
            assert (status, text) == (403, server.FORBIDDEN), path
        status, _ = await fetch(demo, f"/?token={demo.application.token}", token=False)
        assert status == 302
        for path in ("/", "/notes", "/program.json", "/notes/01/good", "/votes.csv", "/stage.js", "/demo.js"):
            assert (await fetch(demo, path))[0] == 200, path
        for path in (
            "/nothing",
            "/picture/01/good",
            "/notes/01/none",
            "/code.svg",
            "/room.py",
            "/stage.py",
            "/phone.html",
        ):
            assert (await fetch(demo, path))[0] == 404, path

    in_demo(work)


def test_it_listens_on_this_machine_alone():
    async def work(demo):
        return [s.getsockname()[0] for s in demo.server._sockets.values()], demo.phones

    addresses, phones = in_demo(work)
    assert addresses == ["127.0.0.1"] and phones is None


def test_another_site_cannot_speak_to_it():
    async def work(demo):
        cookie = f"{demo.application.settings['cookie']}={demo.application.token}"
        headers = {"Cookie": cookie, "Origin": "http://elsewhere.example"}
        request = tornado.httpclient.HTTPRequest(f"ws://127.0.0.1:{demo.port}/line", headers=headers)
        with pytest.raises(tornado.httpclient.HTTPClientError, match="403"):
            await tornado.websocket.websocket_connect(request)

    in_demo(work)


def test_a_port_that_is_taken_or_none_is_refused_and_another_found():
    async def work(demo):
        for port, said in ((demo.port, "is taken"), (0, "65535"), (70000, "65535")):
            with pytest.raises(server.Taken, match=said):
                server.listen(demo.application, "127.0.0.1", port)
        with pytest.raises(server.Taken, match="no address of this machine"):
            server.listen(demo.application, "203.0.113.7", free_port())
        other, port = server.listen(demo.application, "127.0.0.1", first=demo.port)
        other.stop()
        return port - demo.port

    assert in_demo(work) > 0


def test_a_stage_is_opened_moved_and_kept_while_elsewhere():
    async def work(demo):
        async with Window(demo) as window:
            card = await window.open("01/good")
            assert card["declaration"]["name"] == "good" and card["fault"] == ""
            assert (await window.ask("01/good", look=LOOK))["caption"] == "at 2"
            assert (await window.ask("01/good", step={"P": [40, 10]}))["caption"] == "at 6"
            await window.open("01/also-good")
            await window.open("01/good")
            assert (await window.ask("01/good", look=LOOK))["caption"] == "at 6"
            window.send({"again": True})
            return (await window.ask("01/good", look=LOOK))["caption"]

    assert in_demo(work) == "at 2"


def test_pixels_are_let_go_two_cards_on_and_drawn_again():
    async def work(demo):
        async with Window(demo) as window:
            await window.open("01/good")
            before = await window.ask("01/good", look=LOOK)
            picture = demo.session.house.stages["01/good"]._picture
            assert picture._sent is not None
            await window.open("01/also-good")
            await window.ask("01/also-good", look=LOOK)
            assert picture._sent is None and picture.canvas.renderer is None
            await window.open("01/good")
            after = await window.ask("01/good", look=LOOK)
            assert after["handles"] == before["handles"] and picture._sent is not None

    in_demo(work)


def test_the_next_stage_is_made_ahead():
    async def work(demo):
        async with Window(demo) as window:
            await window.open("01/also-good")
            house = demo.session.house
            while not house.faults:
                await asyncio.sleep(0.02)
            return set(house.stages), set(house.faults)

    made, faults = in_demo(work)
    assert made == {"01/also-good"} and faults == {"01/bad"}  # its neighbors with a Stage: the one that cannot be made


def test_a_stage_that_raises_is_one_sentence_and_the_rest_goes_on():
    async def work(demo):
        async with Window(demo) as window:
            card = await window.open("01/bad")
            assert card["fault"] == "This Stage could not be made: ZeroDivisionError: nothing to divide by"
            assert card["declaration"] is None
            await window.open("01/good")
            await window.ask("01/good", look=LOOK)
            for position, said in ((5, "five is too many"), (4, "KeyError: 'four'")):
                assert (await window.ask("01/good", control={"n": position}))["status"] == said
            assert (await window.ask("01/good", control={"n": 1}))["status"] == ""

    in_demo(work)


@pytest.mark.parametrize(
    "sent",
    ["no JSON", "[]", "7", "null", '{"open": "05/none"}', '{"open": 3}', '{"reveal": "01/good", "step": "all"}',
     '{"reveal": "01/good"}', '{"vote": true}', '{"to": "01/good"}', "{}", "[" * 5000],
)  # fmt: skip
def test_what_the_page_should_not_send_is_one_sentence(sent):
    async def work(demo):
        async with Window(demo) as window:
            window.send(sent)
            said = await window.until(lambda m: m["kind"] == "said")
            assert (await window.open("01/good"))["declaration"]
            return said["text"]

    said = in_demo(work)
    assert said and "\n" not in said and "Traceback" not in said


@pytest.mark.parametrize(
    "message", [3, {"look": {}}, {"drag": {"Q": [0, 0]}}, {"button": "None"}, {"control": {"n": "x"}}]
)
def test_what_a_stage_cannot_read_is_one_sentence(message):
    async def work(demo):
        async with Window(demo) as window:
            await window.open("01/good")
            window.send({"to": "01/good", "message": message})
            said = await window.until(lambda m: m.get("kind") == "said")
            assert (await window.ask("01/good", look=LOOK))["caption"]
            return said["text"]

    assert "\n" not in in_demo(work)


def test_windows_share_what_is_shown_and_a_picture_goes_where_its_stage_is():
    async def work(demo):
        async with Window(demo) as wall, Window(demo) as notes:
            await wall.open("01/good")
            assert (await notes.until(lambda m: m["kind"] == "now"))["key"] == "01/good"
            wall.send({"reveal": "01/good", "step": "answer"})
            assert (await notes.until(lambda m: m["kind"] == "now" and m["step"] == "answer"))["key"] == "01/good"
            await wall.ask("01/good", look=LOOK)
            wall.send({"open": "01/word"})
            heard = await notes.until(lambda m: m.get("key") == "01/word" or "picture" in m)
            assert "picture" not in heard
        assert (await fetch(demo, "/notes/01/good"))[0] == 200
        told = json.loads((await fetch(demo, "/notes/01/good"))[1])
        assert told["happened"] == "It was b." and told["next"]["key"] == "01/bad"

    in_demo(work)


# -- phones


def vote_of(room, answer, key="01/good", number=1, cookie=""):
    body = json.dumps({"key": key, "round": number, "answer": answer})
    return phone(room, f"/{room.code}/vote", cookie, method="POST", body=body)


def test_a_vote_of_two_rounds_reaches_the_wall_and_hides_until_closed():
    async def work(demo):
        room = demo.session.room
        async with Window(demo) as window:
            await window.open("01/good")
            cookies = [(await phone(room, f"/{room.code}"))[2] for _ in range(3)]
            assert len(set(cookies)) == 3
            for number, answers in ((1, (0, 0, 1)), (2, (1, 1, 0))):
                window.send({"vote": True})
                await window.until(lambda m, n=number: m["kind"] == "now" and m["ballot"] and m["ballot"]["round"] == n)
                for cookie, answer in zip(cookies, answers):
                    assert (await vote_of(room, answer, number=number, cookie=cookie))[0] == 200
                heard = await window.until(lambda m: m["kind"] == "now" and m["ballot"]["counts"][-1] == 3)
                assert len(heard["ballot"]["shares"]) == number - 1
                window.send({"vote": True})
                heard = await window.until(lambda m: m["kind"] == "now" and not m["ballot"]["open"])
            assert heard["ballot"]["shares"] == [[2, 1], [1, 2]]
            window.send({"vote": True})
            assert "Both rounds" in (await window.until(lambda m: m["kind"] == "said"))["text"]
            assert "01/good,Which?,2,b,yes,2" in (await fetch(demo, "/votes.csv"))[1]

    in_demo(work, vote=True)


def test_a_phone_waits_until_there_is_something_new():
    async def work(demo):
        room = demo.session.room
        cookie = (await phone(room, f"/{room.code}"))[2]
        first = json.loads((await phone(room, f"/{room.code}/now", cookie))[1])
        waiting = asyncio.ensure_future(phone(room, f"/{room.code}/now?seen={first['version']}", cookie))
        await asyncio.sleep(0.1)
        assert not waiting.done() and len(room.waiting) == 1
        demo.session.now = "01/good"
        demo.session.vote()
        answer = json.loads((await waiting)[1])
        assert answer["open"] and answer["choices"] == ["a", "b"] and "answer" not in answer
        assert not room.waiting

    in_demo(work, vote=True)


def test_a_stale_code_a_stranger_and_nonsense_are_told_so():
    async def work(demo):
        room = demo.session.room
        demo.session.now = "01/good"
        demo.session.vote()
        assert (await phone(room, "/abcde"))[:2] == (404, rooms.STALE)
        assert (await phone(room, "/abcde/now"))[:2] == (404, rooms.STALE)
        assert (await phone(room, "/abcde/vote", method="POST", body="{}"))[:2] == (404, rooms.STALE)
        assert (await phone(room, f"/{room.code}/x/y"))[:2] == (404, rooms.STALE)
        assert "code on the wall" in (await phone(room, "/"))[1]
        status, said, _ = await vote_of(room, 0)
        assert status == 403 and "has not joined" in said
        cookie = (await phone(room, f"/{room.code}"))[2]
        for body in ("", "no", "[]", "{}", '{"key": 1}', "[" * 1500):
            status, said, _ = await phone(room, f"/{room.code}/vote", cookie, method="POST", body=body)
            assert (status, said) == (400, "That is no vote."), body
        assert (await vote_of(room, 0, number=2, cookie=cookie))[:2] == (409, "This round is closed.")
        assert (await vote_of(room, 9, cookie=cookie))[:2] == (409, "That is none of the choices.")
        forged = cookie[:-6] + "abcdef"
        assert (await vote_of(room, 0, cookie=forged))[0] == 403
        assert demo.session.votes.ballot.shown()["counts"] == [0]

    in_demo(work, vote=True)


def test_phones_reach_nothing_of_the_lecturers():
    async def work(demo):
        room, token = demo.session.room, demo.application.token
        for path in (
            "/program.json",
            "/votes.csv",
            "/line",
            "/notes",
            "/demo.js",
            "/stage.js",
            "/phone.html",
            "/room.py",
        ):
            assert (await phone(room, f"{path}?token={token}"))[0] == 404, path
        assert (await phone(room, "/phone.js"))[0] == 200

    in_demo(work, vote=True)


def test_a_flood_is_turned_away_and_others_still_vote():
    async def work(demo):
        room = demo.session.room
        demo.session.now = "01/good"
        demo.session.vote()
        loud, calm = [(await phone(room, f"/{room.code}"))[2] for _ in range(2)]
        answers = [(await vote_of(room, 0, cookie=loud))[0] for _ in range(60)]
        assert answers[:10] == [200] * 10 and answers[-1] == 429
        assert (await vote_of(room, 1, cookie=calm))[0] == 200
        body = json.dumps({"key": "01/good", "round": 1, "answer": "x" * 5000})
        assert (await phone(room, f"/{room.code}/vote", calm, method="POST", body=body))[0] in (400, 599)
        reader, writer = await asyncio.open_connection("127.0.0.1", room.port)
        writer.write(b"\x00\xff nonsense\r\n\r\n" + b"A" * 20000)
        assert await asyncio.wait_for(reader.read(), 5) is not None  # answered or closed, but not left open
        writer.close()
        assert (await vote_of(room, 0, cookie=calm))[0] == 200
        assert demo.session.votes.ballot.shown()["counts"] == [2]

    in_demo(work, vote=True)


def test_rates_are_remembered_for_so_many_only():
    rate = rooms.Rate(1e-9, 2)
    assert [rate.allows("a") for _ in range(3)] == [True, True, False]
    for k in range(rooms.REMEMBERED + 10):
        rate.allows(k)
    assert len(rate.left) == rooms.REMEMBERED


def test_sixty_phones_vote_at_once_and_none_is_lost():
    async def work(demo):
        room = demo.session.room
        demo.session.now = "01/good"
        demo.session.vote()

        async def one(k):
            cookie = (await phone(room, f"/{room.code}"))[2]
            return (await vote_of(room, k % 2, cookie=cookie))[0]

        tornado.httpclient.AsyncHTTPClient.configure(None, max_clients=60)
        statuses = await asyncio.gather(*(one(k) for k in range(60)))
        demo.session.vote()
        assert statuses == [200] * 60
        assert demo.session.votes.ballot.shown()["shares"] == [[30, 30]]

    in_demo(work, vote=True)


def test_the_code_of_a_vote_is_its_address():
    """The drawing holds the address as bytes, dark on white, and another address is another drawing."""
    room = rooms.Room(SimpleNamespace(version=0), lambda: None)
    room.host, room.port = "192.0.2.17", 8891
    assert urllib.parse.urlsplit(room.address).path == f"/{room.code}" and len(room.code) == rooms.CODE_LENGTH
    svg = room.code_svg().decode()
    assert svg.count("<path") == 2 and segno.make(room.address, error="m").mode == "byte"
    room.port = 8892
    assert room.code_svg().decode() != svg
    room.port = 8891
    assert room.invitation() == {"address": f"192.0.2.17:8891/{room.code}", "joined": 0, "reachable": True}


def test_a_stage_of_a_notebook_is_the_same_in_its_window(monkeypatch, capsys):
    opened, heard = [], []
    monkeypatch.setattr(window.webbrowser, "open", opened.append)
    monkeypatch.delenv("JUPYTERHUB_USER", raising=False)
    stage = good()
    stage.connect(lambda message, buffers: heard.append(message))  # its cell in the notebook
    stage.show("window")
    address = capsys.readouterr().out.split()[-1]
    assert opened == [address] and address.endswith("#window/good")
    demo = window.WINDOWS.demo

    async def work():
        async with Window(demo) as page:
            await page.open("window/good")
            await page.ask("window/good", look=LOOK)
            return await page.ask("window/good", step={"P": [40, 10]})

    assert asyncio.run(asyncio.wait_for(work(), SECONDS))["caption"] == "at 6"
    assert stage.state["P"][0] == 5 and heard[-1]["caption"] == "at 6"
    other = good()
    other.show("window")  # of the same name: it takes the place
    assert window.WINDOWS.program.cards[-1].make() is other and len(window.WINDOWS.program.cards) == 1
    with pytest.raises(ValueError, match="'cinema'"):
        stage.show("cinema")
    monkeypatch.setenv("JUPYTERHUB_USER", "someone")
    with pytest.raises(ValueError, match="your own machine"):
        stage.show("window")


def test_a_window_without_a_free_port_says_so_at_once(monkeypatch):
    monkeypatch.setattr(server, "PORTS", 0)
    windows = window.Windows()
    with pytest.raises(server.Taken, match="are all taken"):
        windows.show(good())
    monkeypatch.undo()
    assert windows.show(good()).endswith("#window/good")  # the next time there may be one
