"""The wheel holds data, notebooks and solutions beside the package, as `labkit/edition/`.

With LABKIT_EDITION=exam in the environment it is built without the solutions. An editable installation reads them in
the checkout.
"""

import os
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

HELD = {"data": "**/*", "notebooks": "[0-9][0-9]_*.ipynb", "solutions": "[0-9][0-9]_*"}


class Edition(BuildHookInterface):
    """Adds the files of the edition."""

    def initialize(self, version, build_data):
        if version == "editable":
            return
        held = {name: pattern for name, pattern in HELD.items() if name != "solutions" or not is_exam()}
        root = Path(self.root)
        for name, pattern in held.items():
            for path in sorted((root / name).glob(pattern)):
                if path.is_file() and ".my-copy-" not in path.name and path.suffix != ".pyc":
                    inside = path.relative_to(root).as_posix()
                    build_data["force_include"][str(path)] = f"labkit/edition/{inside}"


def is_exam():
    """Whether an edition without solutions was asked for."""
    return os.environ.get("LABKIT_EDITION") == "exam"
