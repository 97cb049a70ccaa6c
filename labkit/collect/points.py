"""Points for verdicts: a status and a named mistake weigh so much of what an exercise is worth."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

from ..reading import regular

DEFAULT = """\
# What share of an exercise's points each verdict earns.
[status]
correct = 1.0
named = 0.5         # wrong, but as a named mistake: one slip away from correct
wrong = 0.0
raised = 0.0
unfinished = 0.0
not_reached = 0.0
library = 0.0       # calls the library's own answer
predicted = 0.0     # a prediction earns for having been made, right or wrong; a click on a button leaves no trace
no_prediction = 0.0

# What an exercise is worth, if not 1 point: "chapter/exercise" = points
[worth]

# A named mistake that weighs otherwise, by the id that class.html shows: "chapter/mistake" = share
[mistake]
"""


class PointsError(ValueError):
    """A file of points that cannot be used, with the reason in one sentence."""


@dataclass(frozen=True)
class Points:
    """Weights of statuses, of mistakes, and what each exercise is worth."""

    status: dict
    worth: dict
    mistake: dict

    def of(self, chapter, id, verdict):
        """The points of one verdict, a dictionary with `status` and maybe `mistake`."""
        status = verdict["status"].replace(" ", "_")
        share = self.status["named" if status == "wrong" and verdict.get("mistake") else status]
        share = self.mistake.get(f"{chapter}/{verdict.get('mistake')}", share)
        return round(share * self.best(chapter, id, verdict), 4)

    def best(self, chapter, id, verdict):
        """The most that this exercise can bring."""
        predictions = max(self.status["predicted"], self.status["no_prediction"])
        default = 1.0 if not verdict["status"].endswith(("predicted", "no prediction")) else float(predictions > 0)
        return self.worth.get(f"{chapter}/{id}", default)


def read(path=None):
    """The `Points` of a TOML file, missing entries as in the default.

    Raises
    ------
    PointsError
        Naming the file and the entry that is wrong.
    """
    default = tomllib.loads(DEFAULT)
    if path is None:
        return Points(**default)
    name = Path(path).name
    try:
        given = tomllib.loads(regular(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise PointsError(f"{name}: cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise PointsError(f"{name}: {error}") from None
    for section, entries in given.items():
        if section not in default or not isinstance(entries, dict):
            raise PointsError(f"{name}: expected the sections {', '.join(default)}, got {section!r}")
        for key, amount in entries.items():
            if section == "status" and key not in default["status"]:
                raise PointsError(f"{name}: [status] knows {', '.join(default['status'])}, got {key!r}")
            if isinstance(amount, bool) or not isinstance(amount, int | float) or not 0 <= amount < 1e6:
                raise PointsError(f"{name}: [{section}] {key} must be a number from 0 on, got {amount!r}")
    return Points(**{section: {**default[section], **given.get(section, {})} for section in default})
