"""How far the twin is from the plant: its model, driven by what was recorded, against every reading, tag by tag.

Stretch by stretch the model begins where the readings are and follows the recorded commands in open loop, with the best
estimates of its parameters. What it says less than the instrument is the residual.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from homeostat.domain.snapshot import Snapshot
from homeostat.history.quality import severity
from homeostat.history.samples import Series, Span
from homeostat.history.store import HistoryReader
from homeostat.plants.plant import Plant
from homeostat.process.batch import ProcessError
from homeostat.service.historian.observed import PROCESS_TIME
from homeostat.twin.carried import Carrier
from homeostat.twin.history import History, Window
from homeostat.twin.replay import replay

STRETCH_TICKS: Final = 600
"""Length of a stretch [tick]."""
LEAST_TICKS: Final = 120
"""Shortest stretch that says anything [tick]."""
MOST: Final = 500
"""Most stretches that are looked at; of more, as many are taken evenly."""
BEFORE_TICKS: Final = 10
"""How far before a stretch it is looked for what a tag had when it began [tick]."""
MOST_HELD: Final = 0.1
"""Largest share of a stretch for which a reading may be unknown [1]."""
_DAY_S: Final = 86_400.0

Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Residual:
    """One tag: the reading less what the twin says, over all stretches."""

    tag: str
    """Name of the tag."""
    unit: str
    """Its unit; that of all numbers here but the last two."""
    mean: float
    """Mean over the stretches."""
    spread: float
    """Standard deviation of the stretches' means."""
    within: float
    """Standard deviation within a stretch: noise, and what the model does not follow."""
    drift: float
    """Change of the mean in a day, by a straight line through the stretches; NaN where they span less than an hour."""
    of_scale: float
    """The mean, as a share of what counts as a large change of the tag [1]."""


@dataclass(frozen=True, slots=True)
class Followed:
    """What a twin made of a history."""

    stretches: int
    """Number of stretches that were followed."""
    left_out: int
    """Those that were not: readings were missing, or the model left the physical world."""
    residuals: tuple[Residual, ...]
    """Tag by tag, the largest share of its scale first."""


def residuals(plant: Plant, history: HistoryReader, span: Span) -> Followed:
    """How far ``plant``'s twin is from what ``history`` has in ``span``; UnknownTag where it has no process time."""
    tags = plant.description.tags_by_name
    variables = {tag: v for tag, v in plant.description.variables.items() if v in plant.model.shown}
    times, means, within = list[float](), list[Values](), list[Values]()
    left_out = 0
    for window in _windows(plant, history, span):
        found = None if _lacking(window) else _followed(plant, window, tuple(variables.values()))
        if found is None:
            left_out += 1
            continue
        times.append(window.end_s)
        means.append(found.mean(axis=0))
        within.append(found.std(axis=0))
    if not times:
        return Followed(0, left_out, ())
    at_s, mean, std = np.array(times), np.array(means), np.array(within)
    rows = (
        Residual(
            tag,
            tags[tag].unit,
            float(mean[:, j].mean()),
            float(mean[:, j].std()),
            float(np.sqrt((std[:, j] ** 2).mean())),
            _slope(at_s, mean[:, j]) * _DAY_S,
            float(mean[:, j].mean() / tags[tag].scale),
        )
        for j, tag in enumerate(variables)
    )
    return Followed(len(times), left_out, tuple(sorted(rows, key=lambda r: -abs(r.of_scale))))


def _followed(plant: Plant, window: Window, variables: tuple[str, ...]) -> Values | None:
    """Readings less the twin's, shape (times, variables); None where the model does not get through."""
    carried = Carrier(plant.model, plant.description).carry([()], window)
    parameters = plant.true_parameters(1, spread=0.0)[None]
    try:
        said = replay(plant.model, window, parameters, carried, variables).predicted[0]
    except ProcessError:
        return None
    read = np.array([window.readings[v][1:] for v in variables]).T
    return np.asarray(read - said)


def _lacking(window: Window) -> bool:
    """Whether too many of its readings are unknown."""
    shares = [flags.mean() for flags in window.held.values()]
    return window.length < LEAST_TICKS or max(shares, default=0.0) > MOST_HELD


def _windows(plant: Plant, history: HistoryReader, span: Span) -> Iterator[Window]:
    """Stretches of ``span``, each between two gaps of process time, as many as are looked at.

    One is read at a time: months of every tag fit into no memory.
    """
    d = plant.description
    found = history.read([PROCESS_TIME], span)[PROCESS_TIME]
    tags = sorted(set(d.variables) & set(history.tags()))
    tick_s = d.timing.tick_s
    for first, end in _evenly(tuple(_stretches(found.value, tick_s))):
        times = found.time_us[first:end]
        from_us = span.from_us if first < BEFORE_TICKS else int(found.time_us[first - BEFORE_TICKS])
        read = history.read(tags, Span(from_us, int(times[-1]) + 1))
        columns = {tag: _at(series, times) for tag, series in read.items()}
        kept = History(d.variables, plant.model.inputs, plant.twin.settle_rows, STRETCH_TICKS, tick_s)
        for k, at_s in enumerate(found.value[first:end].tolist()):
            values = {tag: float(value[k]) for tag, (value, _) in columns.items()}
            bad = frozenset(tag for tag, (_, good) in columns.items() if not good[k])
            kept.append(Snapshot(at_s, values, bad))
        yield kept.whole


def _stretches(process_s: Values, tick_s: float) -> Iterator[tuple[int, int]]:
    """First and end of each stretch in which process time goes on without a gap of more than ten ticks."""
    step = np.diff(process_s)
    edges = np.flatnonzero((step <= 0.0) | (step > 10.0 * tick_s)) + 1
    for first, end in zip([0, *edges.tolist()], [*edges.tolist(), len(process_s)], strict=True):
        for begin in range(first, end, STRETCH_TICKS):
            yield begin, min(begin + STRETCH_TICKS, end)


def _at(series: Series, time_us: NDArray[np.int64]) -> tuple[Values, NDArray[np.bool_]]:
    """The last value at each moment, and whether it may be used: NaN is what a manual output on automatic has."""
    if not series.length:
        return np.full(len(time_us), np.nan), np.zeros(len(time_us), dtype=bool)
    place = np.searchsorted(series.time_us, time_us, side="right") - 1
    latest = np.maximum(place, 0)
    good = (place >= 0) & (severity(series.quality[latest]) < 2)
    return series.value[latest], good


def _evenly(stretches: Sequence[tuple[int, int]]) -> Sequence[tuple[int, int]]:
    chosen = np.unique(np.linspace(0, len(stretches) - 1, min(len(stretches), MOST)).astype(int)) if stretches else ()
    return [stretches[int(k)] for k in chosen]


def _slope(at_s: Values, mean: Values) -> float:
    """Change in a second by least squares; NaN where the stretches span less than an hour."""
    if at_s[-1] - at_s[0] < 3600.0 or len(at_s) < 3:
        return float("nan")
    return float(np.polyfit(at_s - at_s[0], mean, 1)[0])
