"""Where the workbook lies: a checkout, or an installed package, which holds the edition beside its modules."""

from pathlib import Path

PACKAGE = Path(__file__).resolve().parent
IS_CHECKOUT = not (PACKAGE / "edition").is_dir()
ROOT = PACKAGE.parent if IS_CHECKOUT else PACKAGE / "edition"  # holds data, notebooks, solutions
DATA = ROOT / "data"
