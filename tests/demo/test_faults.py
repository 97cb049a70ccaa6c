"""What happens to a demo: a second one, a closed browser, a machine that slept, floods. The rest goes on."""

import asyncio
import gc
import json
import socket
import threading
import time
import weakref

import pytest
from test_server import LOOK, Window, fetch, in_demo, phone, vote_of

from labkit.demo import room as rooms
from labkit.demo.program import Program
from labkit.demo.server import MAX_MESSAGE, MAX_WAITING, Taken
from labkit.demo.show import Demo
from labkit.stage import Stage
from labkit.verbs import demo as verb

HOURS = 8 * 3600.0  # s


@pytest.mark.parametrize(
    "words, said",
    [
        (["13"], "'13'.*01_frames"),
        (["00", "--port", "0"], "from 1 to 65535"),
        (["00", "--ip", "203.0.113.7"], "no addr"),
    ],
)
def test_what_cannot_be_shown_is_one_sentence_of_the_verb(words, said):
    with pytest.raises(ValueError, match=said) as refused:
        verb.main([*words, "--no-browser"])
    assert "\n" not in str(refused.value)


def test_a_taken_port_is_one_sentence_of_the_verb():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(
            Taken, match=f"^Port {port} is taken. Choose another with --port, or leave the option out.$"
        ):
            verb.main(["00", "--no-browser", "--port", str(port)])


def test_two_demos_at_once_do_not_know_each_other():
    async def work(demo):
        other = Demo(Program(demo.session.program.cards[2:], {"01": "One"}))
        try:
            assert other.port != demo.port and other.application.token != demo.application.token
            token = demo.application.token
            assert (await fetch(other, f"/?token={token}", token=False))[0] == 403
            async with Window(demo) as here, Window(other) as there:
                await here.open("01/good")
                await there.open("01/also-good")
                await there.ask("01/also-good", look=LOOK)
                assert (await there.ask("01/also-good", step={"P": [40, 10]}))["caption"] == "at 6"
                await here.open("01/also-good")
                return (await here.ask("01/also-good", look=LOOK))["caption"]
        finally:
            other.close()

    assert in_demo(work) == "at 2"


def test_a_browser_that_was_closed_finds_all_where_it_was():
    async def work(demo):
        async with Window(demo) as window:
            await window.open("01/good")
            window.send({"reveal": "01/good", "step": "answer"})
            await window.ask("01/good", look=LOOK)
            await window.ask("01/good", step={"P": [40, 10]})
            window.send({"vote": True})
            await window.until(lambda m: m.get("ballot"))
        while demo.session.windows:
            await asyncio.sleep(0.01)
        async with Window(demo) as window:
            now = await window.until(lambda m: m["kind"] == "now")
            assert (now["key"], now["step"], now["ballot"]["open"]) == ("01/good", "answer", True)
            await window.open("01/good")
            return (await window.ask("01/good", look=LOOK))["caption"]

    assert in_demo(work, vote=True) == "at 6"


def test_a_machine_that_slept_goes_on(monkeypatch):
    """All clocks have gone on by a night, one window's line has vanished without a word, phones still wait."""

    async def work(demo):
        room, loop = demo.session.room, asyncio.get_running_loop()
        cookie = (await phone(room, f"/{room.code}"))[2]
        async with Window(demo) as gone, Window(demo) as window:
            await gone.open("01/also-good")
            await window.open("01/good")
            await window.ask("01/good", look=LOOK)
            version = json.loads((await phone(room, f"/{room.code}/now", cookie))[1])["version"]
            waiting = asyncio.ensure_future(
                phone(room, f"/{room.code}/now?seen={version}", cookie, request_timeout=2 * HOURS)
            )
            await asyncio.sleep(0.05)
            gone.line.protocol.stream.close()  # no word of farewell
            before = loop.time
            monkeypatch.setattr(loop, "time", lambda: before() + HOURS)
            monkeypatch.setattr(rooms, "monotonic", lambda: time.monotonic() + HOURS)
            await asyncio.sleep(0.1)
            assert (await waiting)[0] == 200
            assert (await window.ask("01/good", step={"P": [40, 10]}))["caption"] == "at 6"
            window.send({"vote": True})
            await window.until(lambda m: m.get("ballot"))
            assert (await vote_of(room, 1, cookie=cookie))[0] == 200
        async with Window(demo) as again:
            return (await again.until(lambda m: m["kind"] == "now"))["ballot"]["counts"]

    assert in_demo(work, vote=True, seconds=2 * HOURS) == [1]


def test_a_phone_that_slept_for_days_is_told_to_join_again(monkeypatch):
    async def work(demo):
        room = demo.session.room
        demo.session.now = "01/good"
        demo.session.vote()
        old = (await phone(room, f"/{room.code}"))[2]
        now = time.time
        monkeypatch.setattr(time, "time", lambda: now() + 2 * 86400)
        status, said, _ = await vote_of(room, 0, cookie=old)
        assert status == 403 and "open the address on the wall" in said
        fresh = (await phone(room, f"/{room.code}", old))[2]
        return fresh != old, (await vote_of(room, 0, cookie=fresh))[0]

    assert in_demo(work, vote=True) == (True, 200)


def test_a_flood_of_a_page_is_left_out_and_another_window_is_answered():
    async def work(demo):
        async with Window(demo) as loud, Window(demo) as calm:
            await loud.open("01/good")
            await loud.ask("01/good", look=LOOK)
            await calm.open("01/also-good")
            busy = threading.Event()
            demo.session.house.worker.submit(busy.wait, 10)  # else it may be quicker than what comes
            for k in range(5 * MAX_WAITING):
                loud.send({"to": "01/good", "message": {"step": {"P": [1, 0]}, "serial": str(k)}})
                loud.send("no JSON")
            said = await loud.until(lambda m: m.get("kind") == "said" and "at once" in m["text"])
            assert said["text"] == "More came at once than the figures can follow; the rest is left out."
            busy.set()
            assert (await calm.ask("01/also-good", look=LOOK))["caption"] == "at 2"
            assert (await fetch(demo, "/program.json"))[0] == 200
        async with Window(demo) as again:
            await again.open("01/good")
            assert (await again.ask("01/good", look=LOOK))["caption"]

    in_demo(work)


@pytest.mark.parametrize("sent", [b"\x00\xff nonsense\r\n\r\n", b"GET / HTTP/1.1\r\nHost: x\r\n" + b"A: b\r\n" * 20000])
def test_what_is_no_request_ends_its_connection_and_no_other(sent, capfd):
    async def work(demo):
        reader, writer = await asyncio.open_connection("127.0.0.1", demo.port)
        writer.write(sent)
        answer = await asyncio.wait_for(reader.read(), 10)
        writer.close()
        assert not answer or answer.startswith(b"HTTP/1.1 4")
        assert (await fetch(demo, "/"))[0] == 200

    in_demo(work)
    assert "Traceback" not in "".join(capfd.readouterr())


def formula():
    """Drawn with a formula, whose parser leaves exceptions that know who drew."""

    def scene(fig):
        fig.subplots().set(title=r"$\frac{1}{10^{-6}}$", yscale="log", ylim=(1e-9, 1e3))
        return [], lambda state, result: None

    return Stage("formula", scene=scene, compute=lambda state: 0.0, fail={})


def test_pixels_that_are_let_go_are_gone():
    async def work(demo):
        home = demo.session.house
        home.makers["01/formula"], home.collect = formula, lambda to_stay=False: gc.collect()
        stage, _ = await home.get("01/formula")
        gc.disable()
        try:
            stage.receive({"look": LOOK, "serial": "s"})
            drawn = weakref.ref(stage._picture.canvas.renderer)
            await asyncio.wrap_future(home.prepare([], set()))
            return drawn()
        finally:
            gc.enable()

    assert in_demo(work) is None


def test_a_message_too_long_ends_its_line_and_no_other():
    async def work(demo):
        async with Window(demo) as long, Window(demo) as window:
            long.send("x" * (MAX_MESSAGE + 1))
            while await long.line.read_message() is not None:
                pass
            assert (await window.open("01/good"))["declaration"]

    in_demo(work)


def test_the_first_stage_is_drawn_before_a_page_asks_and_opening_lets_no_garbage_go():
    async def work(demo):
        home, collected = demo.session.house, []
        home.collect = lambda to_stay=False: collected.append(to_stay)
        stage, _ = await home.get("01/good")
        await asyncio.wrap_future(home.warm("01/good"))
        assert stage._picture._laid_out and stage._picture._backgrounds
        await asyncio.wrap_future(home.prepare([], {"01/good"}))  # as its card is opened: no other has pixels
        assert collected == [True]
        await home.get("01/also-good")
        await asyncio.wrap_future(home.prepare([], {"01/good"}))
        assert collected == [True, True, False]

    in_demo(work)
