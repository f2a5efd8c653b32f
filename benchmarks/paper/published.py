"""Published figures: the paper's tables, and what its authors measured again later."""

from __future__ import annotations

import functools
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from homeostat.evaluate.report.groups import ALL

FILE: Final = Path(__file__).with_name("published.toml")
ORIGINS: Final = {"paper": "published", "rerun": "published rerun"}
"""Source -> where its figures come from, as lines of tables say it."""


@dataclass(frozen=True, slots=True)
class Published:
    """One line of a published table; None where a figure is not known."""

    case: str
    """Name of our plant."""
    row: str
    """Row of the table; ``all`` for the last one."""
    model: str
    """Language model, as the authors label it."""
    source: str
    """``paper``, or ``rerun`` for the authors' own later runs."""
    successes: int
    """Runs that succeeded."""
    runs: int
    """Runs."""
    recovered: int | None = None
    """Successes among the runs with at least one refused proposal."""
    reprompted: int | None = None
    """Runs with at least one refused proposal."""
    recovery: float | None = None
    """The quotient of these, where it is all that is known [%]."""
    plans: float | None = None
    """Next states that were named rightly, mean over runs [%]."""
    actions: float | None = None
    """Sets of actuators that were named rightly [%]."""
    precision: float | None = None
    """Of actuators that were switched on [%]."""
    recall: float | None = None
    """Of actuators that had to be switched on [%]."""
    tokens_in: int | None = None
    """Tokens of all questions, mean per run."""
    tokens_out: int | None = None
    """Tokens of all answers, mean per run."""
    time_s: float | None = None
    """Wall-clock time of a run, mean [s]."""
    call_s: float | None = None
    """Time of an answer, mean [s]."""
    remark: str = ""
    """What to know when reading the line."""

    @property
    def origin(self) -> str:
        """Where the line comes from, in words."""
        return ORIGINS[self.source]


@functools.cache
def published() -> tuple[Published, ...]:
    """All published lines, in the order of the tables."""
    return tuple(
        Published(case=plant, row=row, model=model, source=source, **figures)
        for plant, sources in tomllib.loads(FILE.read_text(encoding="utf-8")).items()
        for source, rows in sources.items()
        for row, models in rows.items()
        for model, figures in models.items()
    )


def published_rows(plant: str) -> tuple[str, ...]:
    """Rows of the plant's published table without the last one, in its order; empty where there is none."""
    return tuple(dict.fromkeys(line.row for line in published() if line.case == plant and line.row != ALL))


def published_lines(plant: str, row: str) -> tuple[Published, ...]:
    """Lines of one row of the plant's published table: the paper's, then the later runs'."""
    lines = [line for line in published() if (line.case, line.row) == (plant, row)]
    return tuple(sorted(lines, key=lambda line: line.source))
