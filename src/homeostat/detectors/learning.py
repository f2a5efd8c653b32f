"""From fault-free rows to detectors with limits at a stated rate of false alarms."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from homeostat.detectors.detector import Detector, Learned, Values
from homeostat.detectors.error import DetectionError
from homeostat.detectors.kinds.ewma import Ewma
from homeostat.detectors.level import WANDERS, departures, levelled
from homeostat.detectors.splits import Split, folds, pairs

LEAST_ROWS: Final = 60
"""Fewest fault-free rows of a run that is learned from."""
LEAST_ALARMS: Final = 2.0
"""Fewest false alarms among the judged fault-free rows that a limit is read from."""
FARTHEST: Final = 1e6
"""Deviations beyond which a signal is no farther away [1]."""
_FLOOR: Final = 0.05
"""Least deviation of a signal in a run, as a share of its usual one [1]: some stand still for a while."""


@dataclass(frozen=True, slots=True)
class Fitted:
    """Detectors that have learned, with the scale on which they see the signals."""

    centre: Values
    """Mean of each signal, shape (signals,), in its unit."""
    deviation: Values
    """Standard deviation of each signal, shape (signals,), in its unit."""
    wander: NDArray[np.bool_]
    """Signals that are watched by their changes, shape (signals,)."""
    learned: tuple[Learned, ...]
    """One for each detector."""

    @classmethod
    def to(
        cls, runs: Sequence[Values], detectors: Sequence[Detector], wander: NDArray[np.bool_], least: Values
    ) -> Self:
        """What ``runs`` teach; ``least``: least deviation of each signal, shape (signals,), in its unit."""
        seen = [levelled(run, wander) for run in runs]
        rows = np.concatenate(seen)
        centre, deviation = rows.mean(axis=0), np.maximum(rows.std(axis=0), least)
        scaled = [(run - centre) / deviation for run in seen]
        return cls(centre, deviation, wander, tuple(d.learn(scaled) for d in detectors))

    def statistics(self, rows: Values) -> tuple[Values, ...]:
        """For each detector its statistics of ``rows``, each of shape (rows, statistics)."""
        scaled = np.clip((levelled(rows, self.wander) - self.centre) / self.deviation, -FARTHEST, FARTHEST)
        return tuple(learned.statistics(scaled) for learned in self.learned)


@dataclass(frozen=True, slots=True)
class Limits:
    """Where statistics are out of the ordinary, so that each detector has the same share in the false alarms."""

    statistics: tuple[Values, ...]
    """For each detector the limit of each of its statistics [1]."""
    detectors: Values
    """For each detector the limit of its largest statistic, each over its limit, shape (detectors,) [1]."""
    together: float
    """The limit of the largest detector, each over its limit [1]."""

    @classmethod
    def of(cls, found: Sequence[Values], false_alarms: float) -> Self:
        """Limits that ``false_alarms`` [1] of the judged rows exceed; ``found`` as from `Fitted.statistics`."""
        limits = tuple(_limit(values, false_alarms) for values in found)
        largest = np.stack([(v / x).max(axis=1) for v, x in zip(found, limits, strict=True)], axis=1)
        detectors = _limit(largest, false_alarms)
        return cls(limits, detectors, float(_limit((largest / detectors).max(axis=1, keepdims=True), false_alarms)[0]))

    def scores(self, found: Sequence[Values]) -> Values:
        """How far each detector is on the way to an alarm, shape (rows, detectors) [1]: above 1 it is one."""
        largest = [(v / x).max(axis=1) for v, x in zip(found, self.statistics, strict=True)]
        scores: Values = np.stack(largest, axis=1) / self.detectors / self.together
        return scores


def _limit(values: Values, false_alarms: float) -> Values:
    """What ``false_alarms`` of the rows exceed in each column; 1 where a statistic never moves."""
    limit = np.quantile(values, 1.0 - false_alarms, axis=0)
    return np.where(limit > 0.0, limit, 1.0)


@dataclass(frozen=True, slots=True)
class Judged:
    """What is said of each row of a table."""

    scores: Values
    """How far each detector is on the way to an alarm, which is at 1, shape (rows, detectors) [1]."""
    signals: Values
    """How far each signal's weighted mean is from its level, shape (rows, signals) [its fault-free limit]."""


@dataclass(frozen=True, slots=True)
class Baseline:
    """What is known of the normal course: which signals wander, how much they move, and where limits lie."""

    detectors: tuple[Detector, ...]
    """What judges, and last what tells which signals it is."""
    wander: NDArray[np.bool_]
    """Signals without a level, shape (signals,)."""
    least: Values
    """Least deviation of each signal, shape (signals,), in its unit."""
    limits: Limits
    """Limits at the stated rate."""
    blame: Values
    """Limit of each signal's weighted mean, shape (signals,) [1]."""
    fitted: Fitted | None
    """What judges every table; None where each is judged by its own first rows."""

    @classmethod
    def of(
        cls, runs: Sequence[Values], detectors: Sequence[Detector], false_alarms: float, healthy: int | None = None
    ) -> Self:
        """Learn from fault-free ``runs``, each of shape (rows, signals).

        ``healthy``: rows at the begin of each table that is judged which are fault-free, and all that it is judged by;
        ``runs`` then say how far a signal departs from what so few rows teach. Raises DetectionError where there are
        too few rows.
        """
        shortest = min(len(run) for run in runs)
        if shortest < LEAST_ROWS:
            text = f"{shortest} fault-free rows are too few to learn from"
            raise DetectionError(f"{text}; at least {LEAST_ROWS} are needed")
        wander = departures(runs, healthy) > WANDERS
        usual = np.sqrt(np.mean([levelled(run, wander).var(axis=0) for run in runs], axis=0))
        least = np.maximum(_FLOOR * usual, 1e-12)
        splits = folds(runs) if healthy is None else pairs(runs, healthy)
        together = (*detectors, Ewma())
        *found, signals = _judged(splits, together, wander, least, false_alarms)
        fitted = Fitted.to(runs, together, wander, least) if healthy is None else None
        return cls(together, wander, least, Limits.of(found, false_alarms), _limit(signals, false_alarms), fitted)

    def judge(self, rows: Values, healthy: int | None = None) -> Judged:
        """What is said of each of ``rows``, shape (rows, signals).

        ``healthy``: fault-free rows at the begin, where the table is judged by them; they are judged, too.
        """
        fitted = self.fitted or Fitted.to([rows[:healthy]], self.detectors, self.wander, self.least)
        *found, signals = fitted.statistics(rows)
        return Judged(self.limits.scores(found), signals / self.blame)


def _judged(
    splits: Sequence[Split],
    detectors: Sequence[Detector],
    wander: NDArray[np.bool_],
    least: Values,
    false_alarms: float,
) -> tuple[Values, ...]:
    """For each detector its statistics of all judged fault-free rows."""
    count = sum(len(split.judged) - split.context for split in splits)
    if count * false_alarms < LEAST_ALARMS:
        needed, least_share = math.ceil(LEAST_ALARMS / false_alarms), _rounded_up(LEAST_ALARMS / max(count, 1))
        text = f"a rate of false alarms of {false_alarms:g} cannot be told from {count} fault-free rows"
        raise DetectionError(f"{text}; give {needed} rows, or allow at least {least_share:.2g}")
    found = list(_each(splits, detectors, wander, least))
    return tuple(np.concatenate(values) for values in zip(*found, strict=True))


def _rounded_up(share: float) -> float:
    """``share`` with two digits, never less: what is told as enough has to be."""
    unit = 10.0 ** (math.floor(math.log10(share)) - 1)
    return math.ceil(share / unit - 1e-9) * unit


def _each(
    splits: Sequence[Split], detectors: Sequence[Detector], wander: NDArray[np.bool_], least: Values
) -> Iterator[tuple[Values, ...]]:
    known: tuple[Values, ...] = ()
    fitted: Fitted | None = None
    for split in splits:
        if fitted is None or split.learned is not known:
            known, fitted = split.learned, Fitted.to(split.learned, detectors, wander, least)
        yield tuple(values[split.context :] for values in fitted.statistics(split.judged))
