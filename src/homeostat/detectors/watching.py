"""Tables judged by a learned baseline: what `homeostat monitor` does, from tables to what was found in each."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from homeostat.detectors.alarms import Alarm, alarms
from homeostat.detectors.catalogue import USUAL, detectors
from homeostat.detectors.detector import Values
from homeostat.detectors.error import DetectionError
from homeostat.detectors.learning import LEAST_ROWS, Baseline, Judged
from homeostat.detectors.tables.agreement import agreed, refuse_other_units
from homeostat.detectors.tables.table import SignalTable

FALSE_ALARMS: Final = 0.01
"""Share of fault-free rows that may be beyond a limit, unless another is stated [1]."""
SEED: Final = 1
"""Seed of what a detector draws, unless another is stated."""
MOST_SIGNALS: Final = 1000
"""Most signals of a table."""
_SHARE: Final = 3
"""Without any other fault-free rows, one row of so many at the begin of a table is taken to be fault-free."""


@dataclass(frozen=True, slots=True)
class Watching:
    """How tables are judged."""

    detectors: tuple[str, ...] = USUAL
    """Names of the detectors that are combined."""
    false_alarms: float = FALSE_ALARMS
    """Share of fault-free rows that may be beyond the limit of all detectors together [1]."""
    healthy: int | None = None
    """Rows at the begin of each table that are fault-free, and that it is judged by."""
    seed: int = SEED
    """Seed of what a detector draws."""


@dataclass(frozen=True, slots=True)
class Course:
    """What was found in one table."""

    table: SignalTable
    """The table, with the signals that were watched."""
    judged: Judged
    """What is said of each row."""
    alarms: tuple[Alarm, ...]
    """What is out of the ordinary, in time order."""
    healthy: int
    """Rows at the begin that it was judged by."""
    names: tuple[str, ...]
    """Names of the detectors, as the scores' columns."""

    @property
    def over(self) -> NDArray[np.bool_]:
        """Rows beyond the limit, shape (rows,)."""
        over: NDArray[np.bool_] = self.judged.scores.max(axis=1) > 1.0
        return over

    @property
    def share(self) -> float:
        """Share of the judged rows that is beyond the limit [1]."""
        return float(self.over[self.healthy :].mean())


def watch(
    tables: Sequence[SignalTable],
    baselines: Sequence[SignalTable],
    how: Watching,
    notice: Callable[[str], None] = lambda text: None,
) -> tuple[Course, ...]:
    """Judge ``tables`` by fault-free ``baselines``, by their own first rows, or by both.

    ``notice`` is told what is left out. Raises DetectionError where they cannot be judged.
    """
    if len(tables[0].signals) > MOST_SIGNALS:
        text = f"{tables[0].name} has {len(tables[0].signals)} signals; at most {MOST_SIGNALS} are judged together"
        raise DetectionError(f"{text}; leave some out with --ignore, or cut the table")
    asked = detectors(how.detectors, how.seed)
    names = tuple(detector.name for detector in asked)
    judged, fault_free = _prepared(tables, baselines)
    healthy = how.healthy if how.healthy is not None or baselines else _first_rows(judged, notice)
    if healthy is not None:
        for table in judged:
            _refuse_short(table, healthy)
    runs = [t.values for t in fault_free] + ([t.values[:healthy] for t in judged] if healthy is not None else [])
    moving = _moving(judged[0].signals, runs, notice)
    judged, runs = (
        tuple(t.of(moving) for t in judged),
        [r[:, [judged[0].signals.index(n) for n in moving]] for r in runs],
    )
    baseline = Baseline.of(runs, asked, how.false_alarms, healthy)
    found = []
    for table in judged:
        refuse_other_units(table, runs if healthy is None else [table.values[:healthy]])
        said = baseline.judge(table.values, healthy)
        found.append(Course(table, said, alarms(said, names, moving, healthy or 0), healthy or 0, names))
    return tuple(found)


def _prepared(
    tables: Sequence[SignalTable], baselines: Sequence[SignalTable]
) -> tuple[tuple[SignalTable, ...], tuple[SignalTable, ...]]:
    together = [table.filled() for table in agreed([*tables, *baselines])]
    return tuple(together[: len(tables)]), tuple(together[len(tables) :])


def _first_rows(tables: Sequence[SignalTable], notice: Callable[[str], None]) -> int:
    shortest = min(len(table) for table in tables)
    healthy = max(2 * LEAST_ROWS, shortest // _SHARE)
    notice(f"the first {healthy} rows are taken to be fault-free; --healthy or --baseline says which are")
    return healthy


def _refuse_short(table: SignalTable, healthy: int) -> None:
    if healthy < 2 * LEAST_ROWS:
        raise DetectionError(f"{healthy} fault-free rows are too few to judge by; at least {2 * LEAST_ROWS} are needed")
    if len(table) <= healthy:
        text = f"{table.name} has {len(table)} rows; none is left to judge after {healthy} fault-free ones"
        raise DetectionError(f"{text}; give it more rows, or fault-free ones with --baseline")


def _moving(signals: Sequence[str], runs: Sequence[Values], notice: Callable[[str], None]) -> tuple[str, ...]:
    """Signals that move somewhere in the fault-free rows; of the others nothing can be learned."""
    still = np.all([np.ptp(run, axis=0) == 0.0 for run in runs], axis=0)
    if still.all():
        raise DetectionError("every signal is constant in the fault-free rows; there is nothing to learn from")
    left_out = [repr(name) for name, stands in zip(signals, still, strict=True) if stands]
    if left_out:
        notice(f"constant in the fault-free rows, and left out: {', '.join(left_out)}")
    return tuple(name for name, stands in zip(signals, still, strict=True) if not stands)
