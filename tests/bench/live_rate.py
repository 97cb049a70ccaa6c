"""Pictures a second of what plays in real JupyterLab: python tests/bench/live_rate.py [--seconds 4] [--rounds 3]

Presses play and counts the pictures that the page has drawn, round by round: the arena of chapter 9 with 10,000
particles (goal: 15 a second or more), and the live tracker of chapter 6, first with every fault of the stream off, then
with loss and nonsense on (goal: 20). P is the time of 1000 products of two 3x3 matrices before and after, in ms: where
it is well above that of the machine alone, others had it.
"""

import argparse
import shutil
import tempfile
from pathlib import Path

from stage_latency import FLAGS, Lab, reference, stage_of

PLAYS = (
    ("ch09_monte_carlo", "arena", "10,000 particles", 15.0, None),
    ("ch06_tracker", "live_tracker", "quiet stream", 20.0, None),
    ("ch06_tracker", "live_tracker", "loss and nonsense", 20.0, "Make it fail"),
)
COUNT = """async (seconds) => {
    const stage = document.querySelector(".labkit-stage");
    const first = +stage.dataset.picture, start = performance.now();
    await new Promise((done) => setTimeout(done, 1000 * seconds));
    return 1000 * (+stage.dataset.picture - first) / (performance.now() - start);
}"""


def rates(page, button, seconds, rounds):
    """Pictures a second of the one Stage of a notebook, round by round."""
    stage = stage_of(page, 0)
    if button:
        stage.get_by_role("button", name=button).click()
    stage.locator("button.play").click()
    page.wait_for_timeout(1500)
    return [page.evaluate(COUNT, seconds) for _ in range(rounds)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        browser = play.chromium.launch(
            executable_path=shutil.which("chromium") or shutil.which("chromium-browser"), args=FLAGS
        )
        for module, name, what, goal, button in PLAYS:
            with tempfile.TemporaryDirectory() as folder:
                lab = Lab(Path(folder))
                try:
                    page, before = browser.new_page(viewport={"width": 1280, "height": 1000}), reference()
                    lab.opened(page, name, [(module, name)])
                    found = rates(page, button, options.seconds, options.rounds)
                    P = max(before, reference())
                    told = ", ".join(f"{rate:.1f}" for rate in found)
                    print(f"{name}, {what}: {told} pictures a second (goal {goal:.0f}, P {P:.2f} ms)", flush=True)
                finally:
                    page.close()
                    lab.close()
        browser.close()


if __name__ == "__main__":
    main()
