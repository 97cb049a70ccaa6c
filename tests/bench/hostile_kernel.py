"""What a real kernel answers to hostile answers: python tests/bench/hostile_kernel.py [WORD ...] (Linux).

Each case is a student's cell in a kernel of its own that has run chapter 1's set-up, and after it a right answer to the
same exercise: printed are the seconds, those of processor time, what was said of the case, and whether the right
answer, an exercise of another kind and plain Python still work. A case is answered when a sentence comes within LIMIT
seconds of processor time a check, no traceback, and all three work. Words choose cases by their names.

Not tried: what is deliberate sabotage of the kernel itself, such as SIGTERM to oneself, execve, a segmentation fault,
`builtins.len = None` in a plain cell. What loops in compiled code (`sum(itertools.repeat(1))`) ends with the kernel
alone, and chapter 0 says so.
"""

import os
import re
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from jupyter_client.manager import start_new_kernel

from labkit.exercises import source
from labkit.verbs import build

LIMIT = 3.0  # s of processor time; on a busy machine a check may take three times as long by the clock
TICKS = os.sysconf("SC_CLK_TCK")
RAISED = "TRACEBACK"  # of the cell itself; what a thread of the student's prints may hold one of its own
PATIENCE = 60.0  # s until a cell counts as hung
RIGHT = """@ex.invert
def invert(T):
    X = np.eye(4)
    X[:3, :3] = T[:3, :3].T
    X[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return X
"""
AFTER = f"{RIGHT}\nex.distance(1.0)\nprint('sum', sum([1, 2]), len(repr(np.eye(2))), os.getcwd() != '')"


def answer(body, head=""):
    """A cell that answers `invert` with a body."""
    return f"{head}\n@ex.invert\ndef invert(T):\n" + "".join(f"    {line}\n" for line in body.splitlines())


SWALLOW = "while True:\n    try:\n        {}\n    except{}:\n        {}"
CASES = {
    "endless comprehension": answer("return [i for i in iter(int, 1)]"),
    "swallowed sleep": answer(SWALLOW.format("time.sleep(0.5)", "", "pass")),
    "swallowed twice": answer(
        "while True:\n    try:\n        try:\n            time.sleep(0.5)\n        except:\n            pass\n"
        "    except:\n        pass"
    ),
    "swallowed around NumPy": answer(SWALLOW.format("np.linalg.norm(T)", " BaseException", "continue")),
    "recursion limit and endless recursion": answer(
        "import sys\nsys.setrecursionlimit(10**9)\ndef f(n):\n    return f(n + 1)\nreturn f(0)"
    ),
    "the same loop three times": answer("while True:\n    pass") * 3,
    "the name is the reference": answer("return invert(T)"),
    "the working directory is deleted": answer(
        "return np.linalg.inv(T)", "import tempfile\nd = tempfile.mkdtemp()\nos.chdir(d)\nos.rmdir(d)"
    )
    + "\nos.chdir('/')",
    "decimal comma": "ex.distance(12,5)",
    "complex result": answer("return np.linalg.inv(T) + 1j"),
    "async def": RIGHT.replace("def invert", "async def invert"),
    "half a letter printed": answer("print('\\ud800')\nreturn T"),
    "half a letter raised": answer("raise ValueError('\\udfff')"),
    "half a letter returned": answer("return '\\udfff'"),
    "MemoryError": answer("raise MemoryError"),
    "KeyboardInterrupt": answer("raise KeyboardInterrupt"),
    "ValueError that says nothing": answer("raise ValueError"),
    "default_rng replaced": answer("np.random.default_rng = None\nreturn T"),
    "builtins.print replaced": answer("import builtins\nbuiltins.print = None\nreturn T"),
    "builtins.all replaced": answer("import builtins\nbuiltins.all = lambda *_: True\nreturn T"),
    "builtins.zip replaced": answer("import builtins\nbuiltins.zip = lambda *_: []\nreturn T"),
    "copy replaced": answer("import copy\ncopy.deepcopy = None\nreturn T"),
    "os replaced": answer("os.getcwd = None\nreturn T"),
    "signal replaced": answer("import signal\nsignal.setitimer = None\nreturn T"),
    "json replaced": answer("import json\njson.dumps = None\nreturn T"),
    "html replaced": answer("import html\nhtml.escape = None\nreturn T"),
    "time replaced": answer("time.monotonic = None\nreturn T"),
    "inspect replaced": answer("import inspect\ninspect.signature = None\nreturn T"),
    "a class of labkit patched": answer(
        "from labkit.exercises import metrics\nmetrics.Poses.equal = lambda *_: True\nreturn T"
    ),
    "seterrcall, locale, environ, path, mask, trace, gc": answer(
        "import gc, locale, signal, sys\nnp.seterr(all='call')\nnp.seterrcall(print)\n"
        "locale.setlocale(locale.LC_ALL, 'C')\nos.environ.clear()\nsys.path.clear()\n"
        "signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGALRM])\n"
        "gc.disable()\nos.umask(0o777)\nsys.settrace(lambda *_: None)\nreturn T"
    ),
    "endless __str__": answer(
        "class E(Exception):\n    def __str__(self):\n        while True:\n            pass\nraise E"
    ),
    "evil __str__": answer("class E(Exception):\n    def __str__(self):\n        raise RuntimeError\nraise E"),
    "evil __repr__ returned": answer("class R:\n    def __repr__(self):\n        raise RuntimeError\nreturn R()"),
    "evil __array__": answer("class R:\n    def __array__(self, *_, **__):\n        raise SystemExit\nreturn R()"),
    "the timer switched off": answer("import signal\nsignal.setitimer(signal.ITIMER_REAL, 0)\nreturn T"),
    "a check inside its own check": answer("return ex.invert(invert)"),
    "numpy thrown out": answer("import sys\ndel sys.modules['numpy']\nreturn T"),
    "nested run_cell": answer("get_ipython().run_cell('1 / 0')\nreturn T"),
    "the student's own names deleted": answer("globals().pop('np', None)\nreturn T") + "import numpy as np",
    "exit": answer("exit()"),
    "os._exit": answer("os._exit(1)"),
    "kill": answer("os.kill(os.getpid(), 9)"),
    "fork": answer("os.fork()"),
    "input": answer("return input()"),
    "pdb": answer("breakpoint()\nreturn T"),
    "100 MB printed": answer("print('x' * 10**8)\nreturn T"),
    "standard output closed": answer("import sys\nsys.stdout.close()\nreturn T"),
    "a terabyte": answer("return np.zeros(2**40)"),
    "a thread that goes on": answer(
        "import threading\nthreading.Thread(target=time.sleep, args=(1,)).start()\nreturn T"
    ),
    "a warning as error": answer("import warnings\nwarnings.simplefilter('error')\nreturn T"),
    "the argument changed": answer("T[:] = 0\nreturn T"),
    "SIGINT ignored": answer("import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\nreturn T"),
    "SIGCHLD ignored": answer("import signal\nsignal.signal(signal.SIGCHLD, signal.SIG_IGN)\nreturn T"),
    "logging.warning": answer("import logging\nlogging.warning('hello')\nreturn T")
    + "\nimport logging; logging.warning('seen')",
    "logging.disable": answer("import logging\nlogging.disable(logging.CRITICAL)\nreturn T"),
    "decimal precision": answer("import decimal\ndecimal.getcontext().prec = 2\nreturn T"),
    "gc threshold, callbacks, freeze": answer(
        "import gc\ngc.set_threshold(1)\ngc.callbacks.append(lambda *a: None)\nreturn T"
    ),
    "excepthook, displayhook": answer(
        "import sys\nsys.excepthook = print\nsys.displayhook = lambda v: None\nsys.unraisablehook = print\nreturn T"
    )
    + "\n",
    "switch interval": answer("import sys\nsys.setswitchinterval(5.0)\nreturn T"),
    "thread endless": answer(
        "import threading\ndef go():\n    while True:\n        pass\nthreading.Thread(target=go, daemon=True).start()\nreturn T"
    ),
    "thread joined endless": answer(
        "import threading\ndef go():\n    while True:\n        time.sleep(0.1)\nt = threading.Thread(target=go, daemon=True)\nt.start()\nt.join()\nreturn T"
    ),
    "executor endless": answer(
        "from concurrent.futures import ThreadPoolExecutor\nwith ThreadPoolExecutor(2) as pool:\n    return list(pool.map(lambda k: time.sleep(30), range(4)))[0]"
    ),
    "subprocess sleeps on": answer("import subprocess\nsubprocess.Popen(['sleep', '30'])\nreturn T"),
    "subprocess.run sleeps": answer("import subprocess\nsubprocess.run(['sleep', '30'])\nreturn T"),
    "os.system sleeps": answer("os.system('sleep 20')\nreturn T"),
    "os.popen read": answer("os.popen('sleep 20').read()\nreturn T"),
    "multiprocessing pool": answer(
        "import multiprocessing\nwith multiprocessing.Pool(2) as pool:\n    return pool.map(abs, [1, 2])"
    ),
    "plt.plot and show": answer("import matplotlib.pyplot as plt\nplt.plot([1, 2])\nplt.show()\nreturn T"),
    "plt.figure left open": answer("import matplotlib.pyplot as plt\nplt.figure()\nplt.plot([1,2])\nreturn T"),
    "display": answer("from IPython.display import display\ndisplay(T)\nreturn T"),
    "clear_output": answer("from IPython.display import clear_output\nclear_output(wait=True)\nreturn T"),
    "rcParams": answer(
        "import matplotlib.pyplot as plt\nplt.style.use('dark_background')\nplt.rcParams['text.usetex'] = True\nplt.rcParams['font.size'] = 40\nreturn T"
    ),
    "builtins gains": answer("import builtins\nbuiltins.tau = 6.28\nbuiltins.np = None\nreturn T"),
    "events registered": answer("get_ipython().events.register('post_run_cell', lambda r: 1 / 0)\nreturn T"),
    "run_line_magic": answer("get_ipython().run_line_magic('matplotlib', 'inline')\nreturn T"),
    "shell escape": answer("get_ipython().system('sleep 15')\nreturn T"),
    "getpass": answer("import getpass\nreturn getpass.getpass()"),
    "asyncio.run": answer("import asyncio\nasync def go(): return T\nreturn asyncio.run(go())"),
    "deep list": answer("x = []\nfor _ in range(10**5):\n    x = [x]\nreturn x"),
    "self list": answer("x = []\nx.append(x)\nreturn x"),
    "repr calls itself": answer(
        "class R:\n    def __repr__(self): return repr(self)\n    def __array__(self, *a, **k): return self.__array__()\nreturn R()"
    ),
    "huge int": answer("return 10**100000"),
    "decimals": answer("from decimal import Decimal\nreturn [[Decimal(float(v)) for v in row] for row in T]"),
    "masked": answer("return np.ma.masked_array(T, mask=True)"),
    "tz": answer("os.environ['TZ'] = 'Asia/Tokyo'\ntime.tzset()\nreturn T"),
    "socket timeout": answer("import socket\nsocket.setdefaulttimeout(0.001)\nreturn T"),
    "raise from itself": answer("e = ValueError('x' * 10**7)\ne.__cause__ = e\nraise e"),
    "float subclass": answer("class F(float):\n    def __float__(self): raise ValueError\nreturn F(1)"),
    "lru_cache above": "import functools\n@ex.invert\n@functools.lru_cache\ndef invert(T):\n    return np.linalg.inv(T)",
    "time magic": "get_ipython().run_cell_magic('time', '', '@ex.invert\\ndef invert(T):\\n    return T.T\\n')",
    "in thread": "import threading\ndef f(T): return T.T\nt = threading.Thread(target=lambda: ex.invert(f)); t.start(); t.join(30); print('alive', t.is_alive())",
    "a pool kept for later": "from concurrent.futures import ThreadPoolExecutor\npool = ThreadPoolExecutor(2)\n"
    + answer("return pool.submit(np.linalg.inv, T).result()"),
    "a pool left with endless work": "from concurrent.futures import ThreadPoolExecutor\npool = ThreadPoolExecutor(2)\n"
    + answer("pool.submit(lambda: [0 for _ in iter(int, 1)])\nreturn T"),
    "a timer that never rang": answer("import threading\nthreading.Timer(0.2, exit).start()\nreturn T"),
    "a thread that raises": answer(
        "import threading\nt = threading.Thread(target=lambda: 1 / 0)\nt.start()\nt.join()\nreturn T"
    ),
    "a lock taken twice": answer("import threading\nlock = threading.Lock()\nlock.acquire()\nlock.acquire()\nreturn T"),
    "an alarm of one's own": answer(
        "import signal\nsignal.signal(signal.SIGALRM, lambda *_: None)\nsignal.alarm(1)\nreturn T"
    ),
    "SIGALRM raises": answer(
        "import signal\ndef ring(*_):\n    raise ValueError('mine')\nsignal.signal(signal.SIGALRM, ring)\nwhile True:\n    pass"
    ),
    "sum replaced in the notebook": "sum = 0\n" + answer("return sum(T)") + "\ndel sum",
    "isinstance replaced": answer("import builtins\nbuiltins.isinstance = lambda *_: False\nreturn T"),
    "sys.exit in finally": answer("import sys\ntry:\n    return T\nfinally:\n    sys.exit(3)"),
    "the folder changed and gone": answer(
        "import tempfile\nwith tempfile.TemporaryDirectory() as d:\n    os.chdir(d)\nreturn T"
    ),
    "recursion through two functions": answer(
        "def a(n):\n    return b(n)\ndef b(n):\n    return a(n + 1)\nreturn a(0)"
    ),
    "recursion through __getattr__": answer(
        "class A:\n    def __getattr__(self, name):\n        return getattr(self, name + 'x')\nreturn A().T"
    ),
    "a generator": answer("yield T"),
    "a generator that never ends": answer("return (T for _ in iter(int, 1))"),
    "rows from zip": answer("return zip(*T)"),
    "a million lines printed": answer("for k in range(10**6):\n    print(k)\nreturn T"),
    "printed to standard error": answer("import sys\nsys.stderr.write('x' * 10**6)\nreturn T"),
    "written to the terminal itself": answer("os.write(1, b'hello')\nos.write(2, b'hello')\nreturn T"),
    "sys.stdin read": answer("import sys\nreturn sys.stdin.read()"),
    "sys.stdin replaced": answer("import io, sys\nsys.stdin = io.StringIO('1')\nreturn T"),
    "await left out": answer("import asyncio\nasync def go():\n    return T\nreturn go()"),
    "a second event loop": answer(
        "import asyncio\nloop = asyncio.new_event_loop()\nasyncio.set_event_loop(loop)\nreturn loop.run_until_complete(asyncio.sleep(0, T))"
    ),
    "the kernel's loop asked": answer(
        "import asyncio\nasyncio.get_event_loop().create_task(asyncio.sleep(0))\nreturn T"
    ),
    "np.seterr raise": "np.seterr(all='raise')\n" + answer("return T / 0") + "\nnp.seterr(all='warn')",
    "np.seterr raise kept on": "np.seterr(all='raise')\n" + answer("return T"),
    "warnings as errors kept on": "import warnings\nwarnings.simplefilter('error')\n"
    + answer("return np.array([1, 2]) / 0"),
    "another backend": answer(
        "import matplotlib\nmatplotlib.use('Agg')\nimport matplotlib.pyplot as plt\nplt.ioff()\nplt.plot([1])\nreturn T"
    ),
    "a table as HTML": answer(
        "class Table:\n    def _repr_html_(self):\n        return '<table>' * 10**5\n    def __array__(self, *a, **k):\n        return T\nreturn Table()"
    ),
    "_repr_html_ raises": answer(
        "class Table:\n    def _repr_html_(self):\n        raise KeyError('x')\nreturn Table()"
    ),
    "ex deleted": "del ex\ntry:\n    ex.distance(1.0)\nexcept NameError as e:\n    print(e)\nfrom labkit.exercises import course\nex = course('01-frames')",
    "ex is a number": "ex = 3\nprint(ex)\nfrom labkit.exercises import course\nex = course('01-frames')",
    "an exercise replaced": "try:\n    ex.invert = 3\nexcept Exception as e:\n    print(e)\nfrom labkit.exercises import course\nex = course('01-frames')\nprint('.')",
    "a comma's locale": answer(
        "import locale\nfor name in ('de_DE.UTF-8', 'C'):\n    try:\n        locale.setlocale(locale.LC_ALL, name)\n    except locale.Error:\n        pass\nreturn T"
    ),
    "decimal traps": answer("import decimal\ndecimal.getcontext().traps[decimal.Inexact] = True\nreturn T"),
    "a seed each time": answer(
        "np.random.seed(1)\nimport random\nrandom.seed(1)\nreturn np.random.normal(size=(4, 4))"
    ),
    "gc switched off and frozen": answer("import gc\ngc.disable()\ngc.freeze()\nreturn T"),
    "atexit": answer("import atexit\natexit.register(lambda: 1 / 0)\nreturn T"),
    "a process of multiprocessing": answer(
        "import multiprocessing\np = multiprocessing.Process(target=print)\np.start()\np.join()\nreturn T"
    ),
    "a spawned pool": answer(
        "import multiprocessing\nwith multiprocessing.get_context('spawn').Pool(1) as pool:\n    return pool.map(abs, [1])"
    ),
    "an object that equals all": answer(
        "class A:\n    def __eq__(self, other):\n        return True\n    def __array__(self, *a, **k):\n        return np.zeros((4, 4))\nreturn A()"
    ),
    "__del__ prints and raises": answer(
        "class A:\n    def __del__(self):\n        print('gone')\n        raise ValueError('late')\nA()\nreturn T"
    ),
    "an exception group": answer("raise ExceptionGroup('two', [ValueError(1), TypeError(2)])"),
    "a traceback replaced": answer("import traceback\ntraceback.format_exc = None\nraise ValueError('x')"),
    "sys.modules emptied of labkit": answer(
        "import sys\nfor name in list(sys.modules):\n    if name.startswith('labkit.exercises'):\n        del sys.modules[name]\nreturn T"
    ),
    "value huge": "ex.distance(10**5000)",
    "value evil": "class E:\n    def __float__(self): raise RuntimeError('evil')\nex.distance(E())",
    "value generator": "ex.distance(v for v in iter(int, 1))",
}


def main(words):
    """Print a row a case; returns 1 where one is not answered."""
    chosen = {name: cell for name, cell in CASES.items() if not words or any(word in name for word in words)}
    print("| case | s | of processor | what is said | then |\n| --- | ---: | ---: | --- | --- |", flush=True)
    failed = 0
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(2) as pool:
        for name, row, good in pool.map(lambda name: tried(name, chosen[name], scratch), chosen):
            failed += not good
            print(f"| {name} | {' | '.join(row)} |{'' if good else ' **open**'}", flush=True)
    print(f"\n{len(chosen) - failed} of {len(chosen)} are answered")
    return int(failed > 0)


def tried(name, cell, scratch):
    """(name, columns of its row, whether all is well) of one case."""
    environment = {**build.kernel_environment(scratch, strict=False), "OMP_NUM_THREADS": "1"}
    manager, client = start_new_kernel(kernel_name="python3", env=environment, cwd=scratch, stderr=subprocess.DEVNULL)
    try:
        run(client, setup())
        before = processor_seconds(manager)
        seconds, said, hung = run(client, cell)
        busy = processor_seconds(manager) - before
        after = "" if hung else run(client, AFTER)[1]
    finally:
        client.stop_channels()
        manager.shutdown_kernel(now=True)
    works = "✓ invert" in after and "distance" in after and "sum 3 " in after
    good = (
        not hung and busy < LIMIT * max(cell.count("@ex."), 1) and said != "" and RAISED not in said + after and works
    )
    return (
        name,
        (f"{seconds:.1f}", f"{busy:.1f}", first_lines(said), "all works" if works else first_lines(after)),
        good,
    )


def processor_seconds(manager):
    """User and system time of a kernel so far; 0 where it has died."""
    try:
        stat = Path(f"/proc/{manager.provisioner.pid}/stat").read_text()
    except OSError:
        return 0.0
    return sum(map(int, stat.rpartition(")")[2].split()[11:13])) / TICKS


def setup():
    """The blank notebook's first code cells, up to the course."""
    cells = [c.source for c in build.blank_notebook(source.find("01")).cells if c.cell_type == "code"]
    last = next(k for k, text in enumerate(cells) if "course(" in text)
    return "\n".join([*cells[: last + 1], "import os, time", "import numpy as np"])


def run(client, code):
    """(seconds, text of all outputs, whether it hung) of a cell."""
    said, begun = [], time.monotonic()

    def hear(message):
        content = message["content"]
        data = content.get("data", {})
        said.append(content.get("text") or data.get("text/plain", ""))
        if message["msg_type"] == "error":
            said.append(f"{RAISED} " + content["ename"] + ": " + content["evalue"])

    try:
        client.execute_interactive(code, output_hook=hear, timeout=PATIENCE, allow_stdin=False)
    except TimeoutError:
        return PATIENCE, "no answer", True
    except RuntimeError as error:
        return time.monotonic() - begun, f"the kernel died: {error}", True
    return time.monotonic() - begun, "\n".join(filter(None, said)), False


def first_lines(text, length=160):
    """The beginning of what was said, for one cell of a table."""
    return re.sub(r"\s+", " ", text).replace("|", "/").strip()[:length] or "nothing"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
