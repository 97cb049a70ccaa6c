"""The demo in figures: start, first and next Stage, key and drag to picture, three hundred phones, memory, switches.

    python tests/bench/demo_speed.py [--chapters 05 09] [--events 30] [--switches 1000] [--only start latency ...]

Parts: start, latency, phones, memory. Times are those of the page in headless Chromium, from the event to the picture
drawn. Phones are simulated in a process of their own, from this machine: each opens the page and votes, at a moment of
its own within three seconds. Memory is the share of the demo's process (PSS, Linux). P is the time of 1000 products
of two 3x3 matrices: where it is well above the smallest of the run, others had the machine.
"""

import argparse
import asyncio
import contextlib
import json
import os
import re
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "browser"), str(ROOT / "tests" / "bench")]

import driver
from collect_class import memory

SIZES = ((1280, 720), (1920, 1080))
PHONES, WITHIN = 300, 3.0
WATCH = """() => {
    const root = document.querySelector("#place .labkit-stage");
    window.__latencies = []; window.__sent = null;
    const note = () => { if (window.__sent === null) window.__sent = performance.now(); };
    for (const type of ["keydown", "pointermove"]) root.addEventListener(type, note, true);
    new MutationObserver(() => {
        if (window.__sent === null) return;
        window.__latencies.push(performance.now() - window.__sent);
        window.__sent = null;
    }).observe(root, {attributeFilter: ["data-picture"]});
}"""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--chapters", nargs="*", default=["05", "09"])
    parser.add_argument("--events", type=int, default=30)
    parser.add_argument("--switches", type=int, default=1000)
    parser.add_argument("--only", nargs="*", default=["start", "latency", "phones", "memory"])
    parser.add_argument("--phones", nargs=2, help=argparse.SUPPRESS)  # the process of the phones: address, key
    options = parser.parse_args()
    if options.phones:
        return print(json.dumps(asyncio.run(phones(*options.phones))))
    for part in options.only:
        {"start": start, "latency": latency, "phones": voting, "memory": growth}[part](options)


def processor():
    """P, in ms."""
    A = np.eye(3)
    begun = time.perf_counter()
    for _ in range(1000):
        A @ A
    return 1e3 * (time.perf_counter() - begun)


@contextlib.contextmanager
def demo(*words):
    """(process, address, address for phones, seconds until it listened)."""
    command = [sys.executable, "-u", "-m", "labkit"]
    if (ROOT / ".venv").exists():
        command = [sys.executable, "-u", str(ROOT / "lab.py")]
    begun = time.perf_counter()
    process = subprocess.Popen(
        [*command, "demo", "--no-browser", *words], cwd=ROOT, stdout=subprocess.PIPE, text=True, env={**os.environ}
    )
    try:
        line = process.stdout.readline()
        seconds = time.perf_counter() - begun
        process.stdout.readline()
        joined = process.stdout.readline() if "--vote" in words else ""
        yield process, re.search(r"http://\S+", line)[0], (re.findall(r"http://\S+", joined) or [""])[0], seconds
    finally:
        process.terminate()
        process.wait(20)


def start(options):
    for words in ([], options.chapters[:1]):
        for attempt in ("first", "warm"):
            with (
                demo(*words) as (_, address, _, seconds),
                driver.page_of(driver.find_browser(), width=1920, height=1080) as page,
            ):
                begun = time.perf_counter()
                page.goto(address)
                page.wait_for_selector("#place .labkit-stage[data-picture]", state="attached")
                drawn = time.perf_counter() - begun
                page.keyboard.press("Enter")
                page.wait_for_selector("#cover", state="hidden")
                seen = time.perf_counter() - begun
                print(
                    f"demo {' '.join(words) or 'of all chapters':16} {attempt:5} listening after {seconds:.2f} s, "
                    f"first Stage drawn behind its question {drawn:.2f} s after opening, seen after Enter {seen:.2f} s"
                    f"  P {processor():.2f}"
                )
                if attempt == "warm":
                    nexts = [turn(page) for _ in range(min(12, page.evaluate("() => wall.cards.length") - 1))]
                    nexts = [s for s in nexts if s is not None]
                    print(
                        f"next Stage, built ahead: median {statistics.median(nexts):.2f} s, slowest {max(nexts):.2f} s"
                    )


def turn(page):
    """Seconds from Page Down to the next Stage's picture, a second after the last; None where there is no Stage."""
    page.wait_for_timeout(1500)
    seconds = page.evaluate(
        """() => new Promise((done) => {
            const before = wall.card.key, begun = performance.now();
            dispatchEvent(new KeyboardEvent("keydown", { key: "PageDown" }));
            const look = () => {
                if (wall.card.key !== before && !wall.card.stage) return done(null);
                const there = wall.card.key !== before && document.querySelector("#place .labkit-stage[data-picture]");
                if (there) return done((performance.now() - begun) / 1000);
                setTimeout(look, 5);
            };
            look();
        })"""
    )
    return seconds


def figures(page):
    """Each card with a Stage, shown; yields its key."""
    page.set_default_timeout(120_000)  # beside other work a Stage and its neighbors take their time to be made
    for key in page.evaluate("() => wall.cards.filter((card) => card.stage).map((card) => card.key)"):
        page.evaluate("(key) => { location.hash = key; }", key)
        page.wait_for_function("(key) => wall.card.key === key && wall.now?.key === key", arg=key)
        page.wait_for_selector("#place .labkit-stage[data-picture]", state="attached")
        if page.evaluate("() => wall.step") == "question":
            page.keyboard.press("a")
        page.wait_for_selector("#cover", state="hidden")
        page.wait_for_timeout(700)  # its size has settled, the next one is built
        yield key


def by_key(page, events):
    """Latencies (ms) of arrow keys."""
    page.evaluate(WATCH)
    for k in range(events):
        page.keyboard.press("ArrowRight" if k % 4 < 2 else "ArrowLeft")
        page.wait_for_timeout(60)
    return page.evaluate("() => __latencies")


def by_mouse(page, events):
    """Latencies (ms) of a drag of the first handle, or of empty space."""
    place = page.locator("#place .handle:visible, #place canvas[data-empty='turn'], #place canvas[data-empty='draw']")
    if not place.count():
        return []
    box = place.first.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.evaluate(WATCH)
    for k in range(events):
        page.mouse.move(x + 2.0 * (k % 15), y + 1.0 * (k % 11))
        page.wait_for_timeout(60)
    page.mouse.up()
    return page.evaluate("() => __latencies")


def told(ms):
    return f"{np.median(ms):6.1f} {np.percentile(ms, 95):6.1f}" if len(ms) else f"{'-':>6} {'-':>6}"


def latency(options):
    for width, height in SIZES:
        everything = []
        with (
            demo(*options.chapters) as (_, address, _, _),
            driver.page_of(driver.find_browser(), width=width, height=height) as page,
        ):
            page.goto(address)
            page.wait_for_function("() => window.wall?.now")
            print(f"{width}x{height}, ms    {'key':>6} {'95 %':>6} {'drag':>6} {'95 %':>6} {'P':>6}")
            for key in figures(page):
                keys, drags = by_key(page, options.events)[3:], by_mouse(page, options.events)[3:]
                everything += [*keys, *drags]
                print(f"{key:20} {told(keys)} {told(drags)} {processor():6.2f}", flush=True)
        print(f"{'all':20} {told(everything)}")


async def phones(address, key):
    """Latencies (ms) of page and vote of all phones, and how many were counted."""
    import tornado.httpclient

    tornado.httpclient.AsyncHTTPClient.configure(None, max_clients=2 * PHONES)
    client, took, statuses = tornado.httpclient.AsyncHTTPClient(), [], []

    async def one(k):
        await asyncio.sleep(WITHIN * ((37 * k) % PHONES) / PHONES)
        begun = time.perf_counter()
        page = await client.fetch(address)
        cookie = page.headers["Set-Cookie"].partition(";")[0]
        body = json.dumps({"key": key, "round": 1, "answer": k % 3})
        reply = await client.fetch(
            f"{address}/vote", method="POST", body=body, headers={"Cookie": cookie}, raise_error=False
        )
        took.append(1e3 * (time.perf_counter() - begun))
        statuses.append(reply.code)
        await client.fetch(f"{address}/now", headers={"Cookie": cookie})

    await asyncio.gather(*(one(k) for k in range(PHONES)))
    return {"took": took, "counted": statuses.count(200)}


def voting(options):
    for width, height in SIZES:
        with (
            demo("05", "--vote", "--vote-ip", "127.0.0.1") as (_, address, joined, _),
            driver.page_of(driver.find_browser(), width=width, height=height) as page,
        ):
            page.goto(address)
            page.wait_for_function("() => window.wall?.now")
            key = next(figures(page))
            page.keyboard.press("v")
            page.wait_for_function("() => wall.now.ballot?.open")
            words = [sys.executable, __file__, "--phones", joined, key]
            with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
                moved = []
                while process.poll() is None:
                    moved += by_key(page, 10)
                found = json.loads(process.stdout.read())
            page.keyboard.press("v")
            page.wait_for_function("() => !wall.now.ballot.open")
            shown = page.evaluate("() => wall.now.ballot.shares[0]")
            print(
                f"{PHONES} phones in {WITHIN:.0f} s at {width}x{height}: {found['counted']} counted, on the wall "
                f"{sum(shown)} {shown}; page and vote, ms, median and 95 %: {told(found['took'])}; key to picture "
                f"meanwhile: {told(moved)}  P {processor():.2f}",
                flush=True,
            )


def growth(options):
    """Memory with all chapters visited, in a large window, and over many switches."""
    with (
        demo() as (process, address, _, _),
        driver.page_of(driver.find_browser(), width=1920, height=1080) as page,
    ):
        page.goto(address)
        page.wait_for_function("() => window.wall?.now")
        print(f"memory at the start {memory(process.pid) / 2**20:.0f} MiB")
        count = sum(1 for _ in figures(page))
        print(f"memory with all {count} Stages visited at 1920x1080: {memory(process.pid) / 2**20:.0f} MiB", flush=True)
        for number in range(1, options.switches + 1):
            before = page.evaluate("() => wall.card.key")
            page.keyboard.press("PageDown")
            if page.evaluate("() => wall.card.key") == before:
                page.evaluate("() => { location.hash = wall.cards[0].key; }")
            page.wait_for_function(  # a truth value: an element handed out here would stay for good, and its pixels
                "() => !wall.card.stage || !!document.querySelector('#place .labkit-stage[data-picture]')"
            )
            if number % max(1, options.switches // 10) == 0:
                heap = page.evaluate("() => performance.memory.usedJSHeapSize") / 2**20
                nodes = page.evaluate("() => document.querySelectorAll('*').length")
                print(
                    f"{number:5d} switches: {memory(process.pid) / 2**20:.0f} MiB, page {heap:.0f} MiB, {nodes} nodes",
                    flush=True,
                )


if __name__ == "__main__":
    main()
