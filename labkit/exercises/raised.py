"""What is said of an answer that raises: the error in plain words, where, and for which call."""

import re
from dataclasses import replace

import numpy as np

from . import guard, scope, shapes
from . import steps as own_steps
from .explanations import Explanations
from .outcome import NOT_YET, RAISED, TO_DO
from .wording import closed, leading

BEFORE = "It was right before, on other draws: what is different about this one?"
OTHER_SHAPES = "It was right before, on other draws: what is different about this one, its shapes perhaps?"
OWN_REFUSAL = re.compile(r"line \d+: (raise|assert)\b")
IN_ORDER = "This call is in order, and nothing in it is to be refused."
WORDLESS = {  # what is raised without a word
    MemoryError: "your code asks for more memory than there is",
    KeyboardInterrupt: "the check was interrupted",
}
OF_ARRAYS = "|".join(name for name in dir(np.ndarray) if name not in dir(list))
ADVICE = {  # what NumPy means, by a regular expression
    r"string to float: .*'[-+\d]*,": "`float` reads 1.5, but not 1,5: replace a decimal comma by a point first.",
    "must be square": "`solve`, `inv` and `det` take square matrices; `lstsq` takes more equations than unknowns.",
    "Singular matrix": "Its rows depend on one another: is one missing, 0, or there twice? Has a loop run off?",
    "Incompatible dimensions": "`lstsq` needs as many numbers on the right as the matrix has rows: see `.ravel()`.",
    "^matmul: .*core dimension": "The inner sizes must agree, (n, k) @ (k, m); rows of vectors take `v @ R.T`.",
    "^solve: .*core dimension": "The right side needs as many rows as the matrix.",
    "not aligned": "The inner sizes must agree, (n, k) @ (k, m); rows of vectors take `v @ R.T`.",
    "can be converted to Python scalars": "`math` and `float` take one number; `np.sin` and the like take arrays.",
    "inhomogeneous": "The parts of this array differ in shape.",
    "return arrays must be of ArrayType": "`np.arctan` and the like write the result into what is handed over last; "
    "`np.arctan2` takes two numbers.",
    "truth value of an array": "`if`, `and`, `max` and the like take one truth value; `np.where`, `&`, `np.maximum` go "
    "entry by entry.",
    "bitwise_xor": "`^` is no power in Python: write `**`.",
    r"for \^: ": "`^` is no power in Python: write `**`.",
    r"out of bounds for axis .* \d+$": "Indices count from 0; of a matrix the row comes first: [row, column].",
    "math domain error": "A root or a logarithm of a negative number, or an arccosine beyond 1, say; where "
    "rounding alone brings it there, see `np.clip`.",
    "requires a buffer of": "The format and the data differ in length: in `struct`, d takes 8 bytes, f takes 4.",
    f"'list' object has no attribute '({OF_ARRAYS})'": "A list is no array: `np.array(...)` makes one of it.",
    "float' object has no attribute": "Here stands a single number, and no array.",
    "float64' object has no attribute": "Here stands a single number, and no array.",
    "float' object is not subscriptable": "Brackets take an entry out of several: here stands a single number.",
    "remapped shapes": "`@` takes as many matrices on either side, or one; one letter of `einsum` has one length.",
    "could not be broadcast": "Entry by entry these shapes do not fit: is `@` meant, is a sum over an axis missing?",
}


class Raised(Explanations):
    """The error of a call, beside the calls before it."""

    def _raised(self, run, args, words=None):
        error = run.error
        if isinstance(error, NotImplementedError):
            return self.outcome(TO_DO)
        if isinstance(error, guard.TimeLimit):
            text = (
                f"your code did not finish within {self.exercise.limit:g} s: is there a loop without an end,"
                " or one that tries far more than it must?"
            )
            return self.outcome(NOT_YET, text)
        if isinstance(error, scope.TwinCalled):
            return self.outcome(
                NOT_YET, f"your function calls the library's `{error}`: that is the function you are asked to write."
            )
        if isinstance(error, guard.Forbidden):
            return self.outcome(
                NOT_YET,
                f"your code calls {error}, which a checked function must not do: it gets its data as arguments.",
            )
        if isinstance(error, SystemExit):
            return self.outcome(NOT_YET, "your code calls exit(): a function ends with `return`.")
        if isinstance(error, TypeError) and not run.line and re.search(r"(?<!\(\) )argument", run.said):
            wanted = ", ".join(self._names(args) if args else self.exercise.arguments)
            return self.outcome(NOT_YET, f"your function cannot be called with ({wanted}): {run.said}.")
        if isinstance(error, NameError) and error.name and "free variable" not in run.said:
            where = f"\nin {run.line}" if run.line else ""
            nowhere = "neither where it is read nor in a cell that has been run since the kernel started"
            return self.outcome(RAISED, f"NameError: `{error.name}` is not known: it is defined {nowhere}.{where}")
        if isinstance(error, RecursionError):
            return self.outcome(RAISED, "RecursionError: your code calls itself again and again: what ends that?")
        said = run.said or WORDLESS.get(type(error), "" if isinstance(error, AssertionError) else "it says no more")
        if isinstance(error, AssertionError) and not said:
            said = "`assert` raises; an answer is handed over with `return`"
        if not (args or run.line):
            where = f"{type(error).__name__}: {said}"
            return self.outcome(NOT_YET, closed(f"what your function returned could not be worked with: {where}"))
        advice = self._advice(error, args, said)
        where = f"\nin {run.line}" if run.line else ""
        return self.outcome(RAISED, f"{type(error).__name__}: {said}{advice}{where}{self._given(run, args, words)}")

    def _advice(self, error, args, said):
        """What an error means, as one more sentence, "" where that is not known."""
        handed = scope.handed_over(error, dict(zip(self._names(args), args)), self.exercise.reference)
        meant = (told for words, told in ADVICE.items() if re.search(words, said))
        told = handed or shapes.strange_size(said, args) or next(meant, "")
        return told if handed or not told else f". {told}"

    def _given(self, run, args, words):
        """The call that raised, as a line; of a property, what it says it gave."""
        if not args:
            return f"\nwhen given {run.error.given}" if hasattr(run.error, "given") else ""
        told = f"\nwhen called as {self._call(args)}"
        if OWN_REFUSAL.match(run.line) and not any(map(callable, args)):  # a function may well be wrong
            told += f"\n{IN_ORDER}"
        if self.pairs and all(m and m.equal(r, e) for m, (r, e) in zip(self.metrics, self.pairs)):
            told += f"\n{leading(words) or self._special_case(args) or self._before(args)}"
        return told + self._about_globals()

    def _before(self, args):
        """That it was right before, and whether shapes may be what is different now."""
        shapes_before = [[np.shape(arg) for arg in others if isinstance(arg, np.ndarray)] for others in self.inputs]
        shape = [np.shape(arg) for arg in args if isinstance(arg, np.ndarray)]
        return BEFORE if shape in shapes_before else OTHER_SHAPES

    def _mended(self, outcome, args, metric, expected):
        """What was raised, with the change of the student's code that gives the right result, if one does."""
        if outcome.status != RAISED or metric is None or metric is not self.exercise.metric:
            return outcome
        drawn = [own_steps.Case(args, metric, expected), *self._fresh[:2]]
        search = own_steps.search(self.function, self._names(args), drawn, self._judging(), self.budget)
        words = search and (search.finer_words() or search.words())
        return replace(outcome, text=f"{outcome.text}\n{words[0].upper()}{closed(words[1:])}") if words else outcome
