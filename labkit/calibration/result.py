"""The one convention for results: what every estimator of this room returns.

Estimates stand under their role (`T_FS`, `tip`, `pivot`, `target`), beside `residuals`, `weights`, `std`, `covariance`
and `singular_values`. The entries of the covariance have names with units: `result.std_of("tip.x")` is one standard
deviation, `result.covariance_of("tip")` one block. Fields are what was estimated and the data behind it; whatever else
a result tells is a `functools.cached_property`, worked out when it is first asked for.
"""

import html
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..documented import documented
from ..geometry.lie import log_so3

result_class = dataclass(frozen=True, eq=False, repr=False)


class Parameter(NamedTuple):
    """One entry of a covariance: its dotted name, such as "T_FS.rotation.x", and its unit."""

    name: str
    unit: str


@documented
def point_parameters(name, axes="xyz"):
    """The coordinates of a point, as parameters in mm.

    Parameters
    ----------
    name : str
    axes : str

    Returns
    -------
    parameters : tuple of Parameter
        name.x, name.y, name.z.
    """
    return tuple(Parameter(f"{name}.{axis}", "mm") for axis in axes)


def pose_parameters(name):
    """The six of a transform T_AB: a rotation vector about the axes of B (rad), then the translation in A (mm)."""
    rotation = tuple(Parameter(f"{name}.rotation.{axis}", "rad") for axis in "xyz")
    return rotation + point_parameters(f"{name}.translation")


class Result:
    """Base of all results: picks named blocks of the covariance, and prints itself."""

    parameters = ()

    @documented
    def covariance_of(self, name, other=None):
        """Block of the covariance between the parameters under `name` and those under `other` (by default the same).

        Parameters
        ----------
        name, other : str
            A parameter ("tip.x") or a group of them ("tip", "T_FS.rotation").

        Returns
        -------
        block : array, shape (k, m)

        Raises
        ------
        ValueError
            For an unknown name, with all known ones.
        """
        rows = self._places(name)
        return self.covariance[np.ix_(rows, rows if other is None else self._places(other))]

    @documented
    def std_of(self, name):
        """Standard deviations of the parameters under `name`: a float for one, an array for a group.

        Parameters
        ----------
        name : str
        """
        std = np.sqrt(np.diagonal(self.covariance_of(name)))
        return float(std[0]) if any(p.name == name for p in self.parameters) else std

    def _places(self, name):
        found = [i for i, p in enumerate(self.parameters) if f"{p.name}.".startswith(f"{name}.")]
        if not found:
            known = ", ".join(p.name for p in self.parameters)
            raise ValueError(f"name must be one of {known}, or what stands before a dot in them, got {name!r}")
        return found

    def _groups(self):
        """(name, unit, values, standard deviations) of each point, translation, rotation and number, ready to print."""
        groups = {}
        for parameter in self.parameters:
            head, _, last = parameter.name.rpartition(".")
            groups.setdefault(head if len(last) == 1 else parameter.name, parameter.unit)
        for name, unit in groups.items():
            values, std = np.atleast_1d(self._value(name)), np.atleast_1d(self.std_of(name))
            if unit == "rad":
                unit, values, std = "deg", np.rad2deg(values), np.rad2deg(std)
            yield name, unit, values, std

    def _value(self, name):
        role, _, part = name.partition(".")
        value = getattr(self, role)
        if part == "rotation":
            return log_so3(value[:3, :3])
        return value[:3, 3] if part == "translation" else value

    def _rows(self):
        """What is printed, as rows (name, values, standard deviations, unit) of text."""
        for name, unit, values, std in self._groups():
            known = np.isfinite(std).all() and (std > 0).all()
            digits = int(np.clip(1 - np.floor(np.log10(std.min())), 0, 6)) if known else 3
            spread = _listed(std, digits) if known else "unknown"
            yield name, _listed(values, digits), spread, unit

    def _note(self):
        n, rejected = len(self.weights), int((self.weights == 0).sum())
        values = self.singular_values
        return (
            f"{n} measurements, {rejected} of them without weight; singular values {values[0]:.3g} to {values[-1]:.2g}"
        )

    def __repr__(self):
        rows = [f"  {name}  {values} {unit}  +- {std}" for name, values, std, unit in self._rows()]
        return "\n".join([type(self).__name__, *rows, f"  {self._note()}"])

    def _repr_html_(self):
        head = "".join(f"<th>{word}</th>" for word in ("", "estimate", "standard deviation", "unit"))
        rows = "".join(
            "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in self._rows()
        )
        caption = f"<caption>{type(self).__name__}: {html.escape(self._note())}</caption>"
        return f"<table>{caption}<tr>{head}</tr>{rows}</table>"


def _listed(values, digits):
    return ", ".join(f"{round(float(v), digits) + 0.0:.{digits}f}" for v in values)
