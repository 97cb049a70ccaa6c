"""Memory of a demo over many switches of Stages, without a browser: what stays is Python's, not the page's.

    python tests/bench/demo_memory.py [--switches 1000] [--chapters NN ...]

A window opens one Stage after the other in the size of 1920x1080 and waits for its picture; the neighbors are made
ahead. Prints the share of the process (PSS, Linux) when all have been visited and then every fiftieth
switch; the last line says how much the second half of the switches differs from the first.
"""

import argparse
import asyncio
import gc
import json
import os
import statistics
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "bench"), str(ROOT / "tests" / "demo")]

from collect_class import memory
from test_server import Window

from labkit.demo import program
from labkit.demo.house import collect
from labkit.demo.show import Demo, give_pixels_back

LOOK = {"width": 1880, "height": 820, "ratio": 1, "dark": False, "letters": 1.9, "space": True}
EVERY = 50


async def switches(shown, count):
    """MiB after each EVERY-th switch, and when all Stages have been visited."""
    give_pixels_back()
    demo, found, keys = Demo(shown), [], [card.key for card in shown.cards if card.stage]
    gc.freeze()
    demo.session.house.collect = collect
    async with Window(demo) as window:
        for number in range(1, len(keys) + count + 1):
            key = keys[number % len(keys)]
            card = await window.open(key)
            if card["declaration"]:
                await window.ask(shown[key].stage, look=LOOK)
            if number == len(keys) or (number > len(keys) and (number - len(keys)) % EVERY == 0):
                found.append(memory(os.getpid()) / 2**20)
                told = f"{number - len(keys)} switches" if found[1:] else f"all {len(keys)} Stages visited"
                print(f"{told:24} {found[-1]:6.0f} MiB", flush=True)
    demo.close()
    return found[1:]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--switches", type=int, default=1000)
    parser.add_argument("--chapters", nargs="*", default=[])
    options = parser.parse_args()
    found = asyncio.run(switches(program.program(options.chapters), options.switches))
    half = len(found) // 2
    if half:
        first, second = statistics.mean(found[:half]), statistics.mean(found[half:])
        print(json.dumps({"first half": round(first), "second half": round(second), "largest": round(max(found))}))


if __name__ == "__main__":
    main()
