"""Runs the solved source of every chapter strictly with the labkit that is installed: python installed_chapters.py

Outside a checkout, so that nothing but the installation can be found. Prints seconds, and peak memory on Linux, a
chapter; the exit code is 1 if any fails. Chapter 0 holds a mistake on purpose, and is not solved.
"""

import os
import subprocess
import sys
import tempfile
import time

from labkit import places


def main():
    if places.IS_CHECKOUT:
        print(f"labkit is read from a checkout, {places.ROOT}: install the wheel and stand elsewhere", file=sys.stderr)
        return 1
    failed = 0
    with tempfile.TemporaryDirectory() as scratch:
        environment = {**os.environ, "LABKIT_STRICT": "1", "LABKIT_PROGRESS": os.path.join(scratch, "progress.jsonl")}
        for path in sorted((places.ROOT / "solutions").glob("[0-9][0-9]_*.py"))[1:]:
            begun = time.monotonic()
            done = subprocess.run(
                [sys.executable, str(path)], cwd=scratch, env=environment, capture_output=True, text=True
            )
            failed += done.returncode != 0
            said = done.stderr.strip().splitlines()[-1:] if done.returncode else ["solved"]
            print(f"{path.stem:20} {time.monotonic() - begun:5.1f} s  {said[0]}", flush=True)
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
