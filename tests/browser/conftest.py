"""One JupyterLab, started by `python lab.py`, for all browser tests; skipped where no Chromium is, but not in CI."""

import os
import sys

import driver
import pytest

ROOT = driver.ROOT


@pytest.fixture(scope="session")
def address():
    """The address of a JupyterLab that `python lab.py` has started."""
    if not driver.find_browser():
        driver.missing("no Chromium on this machine: the browser test needs one")
    if not (ROOT / ".venv").exists():
        driver.missing("the browser test starts lab.py, whose set-up has not been made: run python lab.py test")
    words = [sys.executable, str(ROOT / "lab.py"), "--no-browser", "--LabApp.expose_app_in_browser=True"]
    as_root = hasattr(os, "geteuid") and os.geteuid() == 0
    with driver.server([*words, *(["--allow-root"] if as_root else [])]) as found:
        yield found


@pytest.fixture(scope="session")
def lab(address):
    """A page with the JupyterLab as it opens; whoever uses it opens a notebook in place of the one in front."""
    with driver.page_of(driver.find_browser()) as page:
        page.goto(address)
        driver.wait_until_idle(page)
        yield page
