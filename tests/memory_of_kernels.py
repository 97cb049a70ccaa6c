"""Plugin of pytest: one more test a blank notebook of chapters 1 to 8, what its kernel holds after Run All.

Loaded as `-p tests.memory_of_kernels` by `run.py`; costs nothing, for the kernel is there anyway. The figures hold for
Linux and Python 3.11, where they were taken (docs/hub.md); elsewhere the test is skipped and says what it found.
Asked is what a kernel holds of its own. Beside it lie pages of files, 45 to 55 MiB, that kernels share: how many of
them count as resident is the system's choice, and differs by 8 MiB between two runs on one machine.
"""

import os
import re
import sys
from pathlib import Path

import pytest

MOST = 110  # MiB of its own; 300 students share the machine of a hub
MEASURED = sys.platform == "linux" and sys.version_info[:2] == (3, 11)


def memory(pid):
    """(resident, proportional, own) memory of a process, MiB.

    In the second what several processes share counts once, in the third no page of a file does.
    """
    rollup = dict(line.split(":") for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()[1:])
    return tuple(int(rollup[name].split()[0]) // 1024 for name in ("Rss", "Pss", "Anonymous"))


class KernelMemory(pytest.Item):
    def runtest(self):
        *_, found = memory(self.parent.kernel.km.provisioner.pid)
        if not MEASURED:
            pytest.skip(f"{self.parent.name}: {found} MiB, with another Python than the limit was measured with")
        assert found <= MOST, f"{self.parent.name} leaves a kernel with {found} MiB of its own, more than {MOST}"

    def repr_failure(self, excinfo):
        return str(excinfo.value)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    if not os.path.exists("/proc/self/smaps_rollup"):
        return
    for notebook in dict.fromkeys(item.parent for item in items if re.match(r"0[1-8]_.*\.ipynb$", item.parent.name)):
        last = max(k for k, item in enumerate(items) if item.parent is notebook)
        items.insert(last + 1, KernelMemory.from_parent(notebook, name="memory of the kernel"))
