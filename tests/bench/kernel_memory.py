"""Memory of a kernel after Run All of a blank notebook: python tests/bench/kernel_memory.py [NN ...] (Linux).

Prints, in MiB: RSS; PSS, in which what several kernels share counts once; and what a kernel holds of its own, without
pages of files: that is tested, at most 110 in chapters 1 to 8 (tests/memory_of_kernels.py).
"""

import os
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from jupyter_client.manager import start_new_kernel

from labkit.exercises import source
from labkit.verbs import build
from tests.memory_of_kernels import memory


def main(chapters):
    paths = [source.find(chapter) for chapter in chapters] or source.sources()
    with tempfile.TemporaryDirectory() as scratch:
        environment = {**build.kernel_environment(scratch, strict=False), "OMP_NUM_THREADS": "1"}
        for path in paths:
            manager, client = start_new_kernel(kernel_name="python3", env=environment, cwd=scratch)
            try:
                for cell in build.blank_notebook(path).cells:
                    if cell.cell_type == "code":
                        client.execute_interactive(cell.source, output_hook=lambda message: None, timeout=120)
                rss, pss, own = memory(manager.provisioner.pid)
                print(f"{path.stem:20} RSS {rss} PSS {pss} own {own}", flush=True)
            finally:
                client.stop_channels()
                manager.shutdown_kernel(now=True)


if __name__ == "__main__":
    if not os.path.exists("/proc/self/smaps_rollup"):
        sys.exit("This needs Linux's /proc.")
    main(sys.argv[1:])
