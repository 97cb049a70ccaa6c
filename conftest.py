"""How notebooks are run as tests: `pytest --nbval solutions` (strict) and `pytest --nbval-lax notebooks`."""

import os
import shutil
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent


def pytest_configure(config):
    """Kernels of this very environment, importing this checkout, with a progress file of their own.

    With --nbval every exercise must be solved (strict mode) and every output must come out as stored, except for what
    `sanitize.cfg` evens out. With --nbval-lax, for the blank notebooks, no cell may fail.
    """
    strict = config.getoption("nbval", False)
    if not (strict or config.getoption("nbval_lax", False)):
        return
    from labkit.verbs.build import SECONDS_A_CELL, kernel_environment

    scratch = tempfile.mkdtemp(prefix="labkit-")
    config.add_cleanup(lambda: shutil.rmtree(scratch, ignore_errors=True))
    os.environ.update(kernel_environment(scratch, strict))
    if os.environ.get("LAST_BITS"):
        stir_kernels(Path(scratch) / "ipython")
    config.option.nbval_current_env = True
    config.option.nbval_cell_timeout = SECONDS_A_CELL
    config.option.nbval_sanitize_with = str(ROOT / "tests" / "notebooks" / "sanitize.cfg")


def stir_kernels(ipython):
    """Let every kernel load `tests/last_bits.py`, which stirs the last bits of its linear algebra."""
    (ipython / "profile_default").mkdir(parents=True)
    configuration = 'get_config().InteractiveShellApp.extensions = ["last_bits"]\n'
    (ipython / "profile_default" / "ipython_config.py").write_text(configuration, encoding="utf-8")
    os.environ["PYTHONPATH"] += os.pathsep + str(ROOT / "tests")


def pytest_collectstart(collector):
    """stderr is not compared: the build has refused any, and a first run may say there that it makes a font cache."""
    if hasattr(collector, "skip_compare"):
        collector.skip_compare += ("stderr",)
