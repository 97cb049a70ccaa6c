"""Submissions that want marks, files, a network or the end of the batch, each as the cell that should check `invert`.

`{secret}` stands for a file outside, `{port}` for a port on which the test listens, `{root}` for the checkout.
"""

HANDS_IN = "\ninvert = ex.invert(invert)"
BY_FUNCTION = {  # bodies of an answer to `invert`
    "library call": "    from labkit.geometry import frames as f\n    return f.invert(T)",
    "library call, caught": "    from labkit.geometry import frames as f\n    try:\n        return f.invert(T)\n    except BaseException:\n        return T",
    "library's private function": "    from labkit.geometry import frames as f\n    return f._invert(T)",
    "library under another name": "    from labkit.geometry.frames import invert as upside_down\n    return list(map(upside_down, [T]))[0]",
    "library by its code": (
        "    import types, labkit.geometry.frames as f\n    return types.FunctionType(f.invert.__code__, vars(f))(T)"
    ),
    "library loaded again": (
        "    import sys, importlib\n    sys.modules.pop('labkit.geometry.frames')\n"
        "    return importlib.import_module('labkit.geometry.frames').invert(T)"
    ),
    "library's source": (
        "    import labkit.geometry.frames as f\n    space = dict(vars(f))\n"
        "    exec(open(f.__file__).read().replace('from ..', 'from labkit.'), space)\n    return space['invert'](T)"
    ),
    "library's bytecode": (
        "    import importlib.util, marshal, labkit.geometry.frames as f\n    space = dict(vars(f))\n"
        "    compiled = open(importlib.util.cache_from_source(f.__file__), 'rb').read()[16:]\n"
        "    exec(marshal.loads(compiled), space)\n    return space['invert'](T)"
    ),
    "inspected source": (
        "    import inspect, textwrap, labkit.geometry.frames as f\n    space = dict(vars(f))\n"
        "    exec(textwrap.dedent(inspect.getsource(f.invert)), space)\n    return space['invert'](T)"
    ),
    "expected value from the frames": (
        "    import sys\n    frame = sys._getframe()\n    while frame:\n        if 'expected' in frame.f_locals:\n"
        "            return frame.f_locals['expected']\n        frame = frame.f_back\n    return T"
    ),
    "garbage collector": (
        "    import gc, types\n    for thing in gc.get_objects():\n"
        "        if isinstance(thing, types.FunctionType) and thing.__name__ == 'invert':\n            return thing(T)\n    return T"
    ),
    "the exercise itself": "    return ex.invert(lambda T: T)(T)",
    "the bound item": "    return ex.invert._item.reference(T)",
    "the chapter": (
        "    from labkit.chapters.ch01_frames.exercises import CHAPTER\n    return CHAPTER['invert'].reference(T)"
    ),
    "the solutions": "    space = {'ex': ex}\n    exec(open('{root}/solutions/01_frames.py').read(), space)\n    return space['invert'](T)",
    "the solution's text": (
        "    text = open('{root}/solutions/01_frames.py').read()\n    start = text.index('def invert')\n    space = {'np': np}\n"
        "    exec(text[start:text.index('END SOLUTION', start)].rpartition('\\n')[0], space)\n    return space['invert'](T)"
    ),
    "an array that lies": (
        "    import numpy as np\n    class Liar(np.ndarray):\n        def __eq__(self, other): return np.ones((4, 4), bool)\n"
        "        def __sub__(self, other): return np.zeros((4, 4))\n    return np.array(T).view(Liar)"
    ),
    "an object that pickles": (
        '    class Bad:\n        def __reduce__(self): return (eval, (\'__import__("os").system("touch {secret}.pickle")\',))\n'
        "    return Bad()"
    ),
    "endless": "    while True:\n        try:\n            while True: pass\n        except BaseException: pass",
    "threads": (
        "    import threading, time\n    for _ in range(1000):\n"
        "        threading.Thread(target=time.sleep, args=(5,), daemon=True).start()\n    return T"
    ),
    "huge result": "    import numpy as np\n    return np.zeros((4000, 4000, 4))",
    "deep result": "    x = []\n    for _ in range(100000): x = [x]\n    return x",
    "writes the pipe": (
        "    import os\n    for fd in range(3, 40):\n        try: os.write(fd, b'\\x01\\0\\0\\0' * 1000)\n        except OSError: pass\n    return T"
    ),
    "forges answers": (
        "    import gc, sys\n    from labkit.collect import wire\n    wire.Line._send = lambda *a: None\n    return T"
    ),
}
BY_CELL = {  # whole cells
    "patched judge": (
        "from labkit.exercises import engine\nengine.Exercise.judge = lambda *a, **k: engine.Outcome('correct')\n"
        "invert = ex.invert(lambda T: T)"
    ),
    "patched metric": (
        "from labkit.exercises import metrics\nmetrics.Metric.equal = lambda *a: True\ninvert = ex.invert(lambda T: T)"
    ),
    "reference given, handed in again": "invert = ex.invert(lambda T: T)\ninvert = ex.invert(invert)",
    "reference wrapped, handed in again": "given = ex.invert(lambda T: T)\ninvert = ex.invert(lambda T: given(T))",
    "lucky draws": (
        "import random\nfor _ in range(10**6):\n    mine = lambda T: T.T if random.random() < 0.5 else -T\n"
        "    if ex.invert(mine) is mine: break"
    ),
    "forged progress": (
        "import json, os, pathlib\nplace = pathlib.Path(os.environ.get('LABKIT_PROGRESS', '{secret}.progress'))\n"
        "line = json.dumps({{'chapter': '01-frames', 'exercise': 'invert', 'event': 'correct'}})\nplace.write_text(line)\n"
        "invert = ex.invert(lambda T: T)"
    ),
    "forged message": (
        "ex._worker.border.ask('hand', id='invert', answer=lambda T: T, unit=None)\n"
        "ex._worker.border.line._send({{'do': 'verdict', 'status': 'correct', 'asked': 1}}, [])"
    ),
    "asks for the library while it is judged": (
        "def invert(T):\n    ask = ex._worker.border.ask\n"
        "    return ask('library', name='labkit.geometry.frames.invert', args=[T], kwargs={{}})['value']" + HANDS_IN
    ),
    "ends the process": "import os\nos._exit(0)",
    "kills its parent": "import os\nos.kill(os.getppid(), 9)",
    "kills itself": "import os, signal\nos.kill(os.getpid(), signal.SIGKILL)",
    "forks": "import os\nif os.fork() == 0:\n    open('{secret}', 'w').write('x')\n    os._exit(0)",
    "memory": "x = bytearray(50 << 30)\ninvert = ex.invert(lambda T: T)",
    "memory, bit by bit": "x = [np.empty(1 << 17) for _ in range(100000)]\ninvert = ex.invert(lambda T: T)",
    "output": "import os\nfor _ in range(2000):\n    print('x' * 100000)\n    os.write(1, b'x' * 100000)",
    "writes a file": "open('{secret}', 'w').write('x')",
    "writes by the shell": "!touch {secret}\nimport os, subprocess\nos.system('touch {secret}')",
    "writes by a process": "import subprocess\nsubprocess.run(['touch', '{secret}'])",
    "fills the disk": "open('big', 'wb').write(b'x' * (200 << 20))",
    "opens a connection": "import socket\nsocket.create_connection(('127.0.0.1', {port}), timeout=2)",
    "opens a connection by a library": "import urllib.request\nurllib.request.urlopen('http://127.0.0.1:{port}/', timeout=2)",
    "reads a secret": "found = open('{secret}.read').read()\ninvert = ex.invert(lambda T: T)",
    "exit": "exit()\nquit()",
    "sleeps": "import time\ntime.sleep(10**6)",
}


def code(name, **places):
    """The cell of an attack."""
    if name in BY_CELL:
        return BY_CELL[name].format(**places)
    body = BY_FUNCTION[name].replace("{root}", str(places["root"])).replace("{secret}", str(places["secret"]))
    return f"def invert(T):\n{body}" + HANDS_IN


ALL = (*BY_FUNCTION, *BY_CELL)
ENDS_THE_RUN = (  # these stop the notebook in which they stand: the others can be tried one after the other in one
    "writes the pipe",
    "ends the process",
    "kills itself",
    "kills its parent",
    "memory, bit by bit",
    "threads",
)
SAYS_NOTHING = ("endless", "sleeps", "forges answers", "forged message", "lucky draws")  # these make the judge wait
