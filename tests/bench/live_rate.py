"""Pictures a second of the live tracker in real JupyterLab: python tests/bench/live_rate.py [--seconds 5] [--rounds 4]

Presses play and counts the pictures that the page has drawn, round by round, with every fault of the stream off and
then with loss and nonsense on. Goal: 20 a second or more.
"""

import argparse
import shutil
import tempfile
from pathlib import Path

from stage_latency import FLAGS, Lab, notebook, run_all, stage_of

GOAL = 20.0
COUNT = """async (seconds) => {
    const stage = document.querySelector(".labkit-stage");
    const first = +stage.dataset.picture, start = performance.now();
    await new Promise((done) => setTimeout(done, 1000 * seconds));
    return 1000 * (+stage.dataset.picture - first) / (performance.now() - start);
}"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--rounds", type=int, default=4)
    options = parser.parse_args()
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        lab = Lab(Path(folder), notebook([("tracker", "live_tracker")]))
        browser = play.chromium.launch(
            executable_path=shutil.which("chromium") or shutil.which("chromium-browser"), args=FLAGS
        )
        try:
            page = browser.new_page(viewport={"width": 1280, "height": 1000})
            run_all(page, lab.url, 1)
            output = stage_of(page, 0)
            output.locator(".widget-play button").first.click()
            page.wait_for_timeout(1500)
            rates = [page.evaluate(COUNT, options.seconds) for _ in range(options.rounds)]
            print(f"quiet stream: {', '.join(f'{rate:.1f}' for rate in rates)} pictures a second (goal {GOAL:.0f})")
            output.get_by_role("button", name="Make it fail").click()
            output.locator(".widget-play button").first.click()
            page.wait_for_timeout(1500)
            rates = [page.evaluate(COUNT, options.seconds) for _ in range(options.rounds)]
            print(f"loss and nonsense: {', '.join(f'{rate:.1f}' for rate in rates)} pictures a second")
        finally:
            browser.close()
            lab.close()


if __name__ == "__main__":
    main()
