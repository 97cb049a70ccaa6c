"""Runs one submitted notebook, untrusted, and hands to the judge what it hands to `ex`.

This process holds no exercise: no references, no draws, no mistakes. The library's functions that are themselves an
answer are replaced by questions to the judge, who refuses them while that exercise is judged. Figures are not drawn.
Started by `sandbox.worker` with its own file as the command: FOLDER OF LABKIT, SECONDS OF PROCESSOR TIME [ITS FOLDER].
"""

import functools
import importlib
import importlib.abc
import importlib.util
import os
import sys
import types

FIGURES = ("stages", "figures", "exercises", "table")  # modules of a chapter that are not loaded here


class Dull:
    """Stands for a figure, a Stage, a panel: takes everything, shows nothing."""

    def __init__(self, *args, **kwargs): ...

    def __call__(self, *args, **kwargs):
        return Dull()

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return Dull()

    def __iter__(self):
        return iter(())

    def _ipython_display_(self): ...


class DullModule(types.ModuleType):
    """A module of figures: its names in capitals are the judge's constants, what it computes is the judge's to compute,
    all others are dull.
    """

    constant = computed = None  # ask the judge

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        if name.startswith("compute_"):
            return functools.partial(DullModule.computed, self.__name__, name)
        return DullModule.constant(self.__name__, name) if name.isupper() else Dull()


class DullFinder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds the modules of figures without looking at their files."""

    def find_spec(self, name, path=None, target=None):
        parts = name.split(".")
        if parts[:2] == ["labkit", "chapters"] and len(parts) == 4 and parts[3] in FIGURES:
            return importlib.util.spec_from_loader(name, self)
        return None

    def create_module(self, spec):
        return DullModule(spec.name)

    def exec_module(self, module): ...


class Worker:
    """The notebook's side of the border."""

    def __init__(self, reading, writing):
        from labkit.collect.border import Border, run_guarded
        from labkit.exercises import scope

        self.scope = scope
        self.border = Border(reading, writing, run_guarded)
        self.border.handlers |= {"prepare": self._prepare, "run": self._run, "rerun": self.border._rerun}
        self.shell = self.pristine = None

    def _prepare(self, parts, chapter, exercises, references, library, secret, readable, own):
        """Take the library's answers away, lay the rails, open an empty notebook."""
        for name in library:
            self._take_away(name)
        session = sys.modules["labkit.exercises"]
        session.course = lambda name: Handover(self, chapter, exercises, name)
        session.course_map = session.progress_text = lambda: Dull()
        DullModule.constant = lambda module, name: self.border.ask("constant", module=module, name=name)["value"]
        DullModule.computed = lambda module, name, *args: self.border.ask(
            "compute", module=module, name=name, args=list(args)
        )["value"]
        from IPython.core.interactiveshell import InteractiveShell
        from traitlets.config import Config

        from labkit.collect import rails
        from labkit.exercises import guard

        config = Config()
        config.HistoryManager.enabled = False
        config.InteractiveShell.xmode = "Minimal"
        self.shell = InteractiveShell.instance(config=config)
        self.shell.showtraceback = self.shell.showsyntaxerror = lambda *args, **kwargs: None
        self.shell.ask_exit = self._exit
        self.shell.user_ns.update(references)  # a function whose cell was deleted spoils no later cell
        self.pristine = guard.Pristine()  # put back before each hand-in, not after each call
        self.pristine.look()
        rails.lay([sys.prefix, sys.base_prefix, *readable], secret, own or os.getcwd())
        return {}

    @staticmethod
    def _exit(*args):
        raise RuntimeError("exit() ends no notebook")

    def _take_away(self, name):
        """Whoever knows the library's function has it ask the judge from now on; its own code is gone."""
        module, _, attribute = name.rpartition(".")
        function = getattr(importlib.import_module(module), attribute)
        function = getattr(function, "__wrapped__", function)
        scope = {}
        exec(f"def {attribute}(*args, **kwargs):\n    return _asks_the_judge({name!r}, args, kwargs)", scope)
        function.__globals__["_asks_the_judge"] = self._ask_library
        function.__code__ = scope[attribute].__code__
        function.__defaults__ = function.__kwdefaults__ = None

    def _ask_library(self, name, args, kwargs):
        return self.border.ask("library", name=name, args=list(args), kwargs=kwargs)["value"]

    def _run(self, parts, cells, skip):
        """Run the notebook's code cells in order; what a cell raises ends this cell alone."""
        for k, source in enumerate(cells):
            if k in skip:
                continue
            self.border.ask("cell", number=k)
            result = self.shell.run_cell(source, silent=True, store_history=False)
            error = result.error_before_exec or result.error_in_exec
            if error is not None:
                self.border.ask("failed", number=k, error=f"{type(error).__name__}: {_text(error)}")
        return {}

    def hand(self, id, answer, unit):
        """What a notebook goes on with: its own answer, or the reference."""
        self.pristine.restore()
        if self._is_blank(answer):
            return self.border.ask("blank", id=id)["value"]
        with self.scope.own_name(answer, id):
            told = self.border.ask("hand", id=id, answer=answer, unit=unit)
        return told.get("value", answer)

    @staticmethod
    def _is_blank(answer):
        from labkit.exercises.outcome import is_blank

        return is_blank(answer)


def _text(error):
    try:
        return " ".join(str(error).split())[:300]
    except Exception:  # a student's exception class may fail to print itself
        return "(its message cannot be shown)"


class Handover:
    """What a notebook finds under `ex`: every answer is handed across the border."""

    def __init__(self, worker, chapter, exercises, name):
        if str(name).replace("_", "-") != chapter:
            raise ValueError(f"this notebook is judged as one of chapter {chapter}, and asks for {name!r}")
        self._worker, self._exercises = worker, exercises

    def __getattr__(self, id):
        if id.startswith("_") or id not in self._exercises:
            raise AttributeError(f"there is no exercise {id!r} in this chapter")
        return Bound(self._worker, id)

    def __dir__(self):
        return self._exercises

    def predict(self, id, answer=None, reveal=None):
        self._worker.border.ask("predict", id=id, answer=None if self._worker._is_blank(answer) else answer)

    def after(self, *ids):
        """Cells that would give an answer away wait for nothing here: nobody reads their output."""
        return True

    def progress(self): ...


class Bound:
    """One exercise: takes an answer, gives no help."""

    def __init__(self, worker, id):
        self._worker, self._id = worker, id

    def __call__(self, answer, unit=None):
        return self._worker.hand(self._id, answer, unit)

    def hint(self, number=None): ...

    def solution(self): ...

    starter = reset = solution


def main(root, cpu, own=None):
    sys.path.insert(0, root)
    sys.meta_path.insert(0, DullFinder())
    package = types.ModuleType("labkit.exercises")  # without the session, which would load every chapter's exercises
    package.__path__ = [os.path.join(root, "labkit", "exercises")]
    sys.modules["labkit.exercises"] = package
    from labkit.collect import sandbox

    sandbox.limit_this_process(int(cpu))
    reading, writing = os.dup(0), os.dup(1)
    null = os.open(os.devnull, os.O_RDWR)
    for standard in (0, 1, 2):
        os.dup2(null, standard)
    worker = Worker(reading, writing)
    from labkit.collect import wire

    try:
        worker.border.line.serve_all()
    except wire.Gone:
        return


if __name__ == "__main__":
    main(*sys.argv[1:])
