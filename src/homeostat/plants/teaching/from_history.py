"""Reference values from what a plant's instruments said while it was well, instead of from its model.

A span that has gaps, bad readings, too little in it or a violated limit teaches nothing: it is refused, with why.
"""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from homeostat.agents.monitoring.features import FeatureFilter
from homeostat.domain.plant.baseline import Baseline
from homeostat.domain.snapshot import Snapshot
from homeostat.history.quality import severity
from homeostat.history.samples import Series, Span
from homeostat.history.store import HistoryReader
from homeostat.history.times import told_time
from homeostat.plants.error import PlantError
from homeostat.plants.files.baselines import read_baselines, write_baselines
from homeostat.plants.files.generated import baseline_sources
from homeostat.plants.plant import Plant

LEAST_S: Final = 3600
"""Least time with values of all features that is learned from [s]."""
STALE_S: Final = 3
"""A reading counts for so long after it was taken [s]."""
LONGEST_GAP_S: Final = 30
"""Longest time for which a reading may be unknown at a stretch [s]."""
MOST_UNKNOWN: Final = 0.01
"""Largest share of the time for which it may be unknown altogether [1]."""
MOST_VIOLATED_S: Final = 5
"""Longest time for which noise may show a hard limit as violated [s]."""
STRETCHES: Final = 12
"""Parts of the span whose means say how much the plant wanders."""
_SECOND_US: Final = 1_000_000

Readings = Mapping[str, NDArray[np.float64]]


def learned_from_history(plant: Plant, history: HistoryReader, span: Span) -> bytes:
    """The file of reference values for ``plant``, learned from what was recorded in ``span``.

    What a simulation finds between plants of one design is taken from the stretches of the span: there is one plant.
    Raises PlantError where the span is not well, UnknownTag where the history lacks a tag of a feature, GraphError
    where what was learned is absurd.
    """
    values = feature_values(plant, history, span)
    content = write_baselines(_baselines(plant, values), baseline_sources(plant))
    read_baselines(content, plant.description)
    return content


def feature_values(plant: Plant, history: HistoryReader, span: Span) -> NDArray[np.float64]:
    """Feature values second by second once the plant has settled, shape (times, features).

    Raises PlantError and UnknownTag as :func:`learned_from_history`.
    """
    length = (span.to_us - span.from_us) // _SECOND_US
    least_s = LEAST_S + round(plant.monitoring.settle_s)
    if length < least_s:
        settle = f"{plant.monitoring.settle_s:g} s to settle and {LEAST_S} s to learn from"
        raise _sick(span, f"it is {length} s long; at least {least_s} s are needed, {settle}")
    features = plant.description.features
    used = {tag for f in features for e in (f.expression, f.accumulation) if e is not None for tag in e.tags}
    readings = _readings(history, sorted(used), span, length)
    _refuse_unknown(readings, span)
    _refuse_violated(plant, history, span, length)
    filters, rows = [FeatureFilter(f) for f in features], list[list[float]]()
    for k in range(length):
        snapshot = Snapshot(float(k), {tag: float(values[k]) for tag, values in readings.items()})
        found = [f.update(snapshot) for f in filters]
        if k >= plant.monitoring.settle_s and None not in found:
            rows.append([v for v in found if v is not None])
    if len(rows) < LEAST_S * (1.0 - MOST_UNKNOWN * len(used)):
        raise _sick(span, f"its features are all known for {len(rows)} s only; at least {LEAST_S} s are needed")
    return np.array(rows)


def _baselines(plant: Plant, values: NDArray[np.float64]) -> tuple[Baseline, ...]:
    parts = np.array_split(values, STRETCHES)
    means = np.array([part.mean(axis=0) for part in parts])
    within = np.concatenate([part - mean for part, mean in zip(parts, means, strict=True)]).std(axis=0)
    percentiles = np.percentile(values, [1, 5, 50, 95, 99], axis=0)
    columns = np.vstack([values.mean(axis=0), within, means.std(axis=0), percentiles]).T.tolist()
    return tuple(Baseline(f.name, *c) for f, c in zip(plant.description.features, columns, strict=True))


def _readings(history: HistoryReader, tags: Sequence[str], span: Span, length: int) -> Readings:
    """Tag -> its good reading at each second of ``span``, NaN where there is none that is fresh, shape (length,)."""
    early = Span(span.from_us - STALE_S * _SECOND_US, span.to_us)
    at_us = span.from_us + np.arange(length, dtype=np.int64) * _SECOND_US
    return {tag: _each_second(series, at_us) for tag, series in history.read(tags, early).items()}


def _each_second(series: Series, at_us: NDArray[np.int64]) -> NDArray[np.float64]:
    if not series.length:
        return np.full(len(at_us), np.nan)
    place = np.searchsorted(series.time_us, at_us, side="right") - 1
    latest = np.maximum(place, 0)
    fresh = (place >= 0) & (at_us - series.time_us[latest] <= STALE_S * _SECOND_US)
    good = (severity(series.quality[latest]) == 0) & np.isfinite(series.value[latest])
    return np.where(fresh & good, series.value[latest], np.nan)


def _refuse_unknown(readings: Readings, span: Span) -> None:
    """PlantError where a reading is missing or not good for too long."""
    for tag, values in readings.items():
        unknown = np.isnan(values)
        edges = np.flatnonzero(np.diff(np.r_[False, unknown, False]))
        starts, lengths = edges[::2], np.diff(edges)[::2]
        if len(lengths) and lengths.max() > LONGEST_GAP_S:
            at = told_time(span.from_us + int(starts[lengths.argmax()]) * _SECOND_US)
            text = f"{tag!r} has no good reading for {lengths.max()} s from {at} on"
            raise _sick(span, f"{text}; at most {LONGEST_GAP_S} s are allowed")
        if unknown.mean() > MOST_UNKNOWN:
            text = f"{tag!r} has no good reading for {unknown.sum()} of {len(unknown)} s ({unknown.mean():.1%})"
            raise _sick(span, f"{text}; at most {MOST_UNKNOWN:.0%} are allowed")


def _refuse_violated(plant: Plant, history: HistoryReader, span: Span, length: int) -> None:
    """PlantError where readings violate a hard limit; one whose tags were not recorded is not looked at."""
    recorded = set(history.tags())
    for limit in plant.description.limits.hard:
        if limit.formula.tags <= recorded:
            readings = _readings(history, sorted(limit.formula.tags), span, length)
            # What is unknown is nobody's violation; how much of that there may be was asked before.
            outside = limit.formula.margins({t: v[None] for t, v in readings.items()}, 1.0)[0] < 0.0
            if outside.sum() > MOST_VIOLATED_S:
                at = told_time(span.from_us + int(np.argmax(outside)) * _SECOND_US)
                text = f"'{limit.formula}' ({limit.name}) does not hold for {outside.sum()} s, first at {at}"
                raise _sick(span, text)


def _sick(span: Span, why: str) -> PlantError:
    where = f"the history from {told_time(span.from_us)} to {told_time(span.to_us)}"
    return PlantError(f"{where} is nothing to learn from: {why}; choose another span")
