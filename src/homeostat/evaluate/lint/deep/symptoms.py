"""Which symptoms a course shows, as monitoring would see them by the reference values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from homeostat.agents.monitoring.features import FeatureFilter
from homeostat.agents.monitoring.symptoms import SymptomWatch
from homeostat.domain.diagnosis import SymptomRule
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.course import Course

LAGS: Final = 10.0
"""Time constants after which a filter has forgotten where it began [1]."""


@dataclass(frozen=True, slots=True)
class Shown:
    """What one rule made of a course."""

    confirmed_s: float | None
    """When it was confirmed first [s]; None for never."""
    largest: float
    """Largest deviation to its side, in thresholds."""
    opposite: float
    """Largest deviation to the other side, in thresholds; 0 where both count."""
    threshold: float
    """Least deviation that counts, in the feature's unit."""


def first_symptoms(bench: Bench, course: Course, from_s: float) -> dict[SymptomRule, Shown]:
    """What each rule shows from ``from_s`` on [s]; the features are followed from long enough before."""
    d = bench.plant.description
    filters = [FeatureFilter(feature, d.timing.tick_s) for feature in d.features]
    watches = {f.name: [SymptomWatch(r, bench.baselines[f.name]) for r in d.symptom_rules if r.feature == f.name]
               for f in d.features}  # fmt: skip
    confirmed: dict[str, float] = {}
    largest = dict.fromkeys((rule.name for rule in d.symptom_rules), 0.0)
    opposite = dict(largest)
    before_s = max((f.window_s + LAGS * f.filter_s for f in d.features), default=0.0)
    for snapshot in course.seen:
        if snapshot.at_s <= from_s - before_s:
            continue
        values = [each.update(snapshot) for each in filters]
        if snapshot.at_s <= from_s:
            continue
        for feature, value in zip(d.features, values, strict=True):
            if value is None:
                continue
            for watch in watches[feature.name]:
                name, deviation = watch.rule.name, value - bench.baselines[feature.name].mean
                signed = {"high": deviation, "low": -deviation}.get(watch.rule.direction.value, abs(deviation))
                largest[name] = max(largest[name], signed / watch.threshold)
                opposite[name] = max(opposite[name], -signed / watch.threshold)
                if watch.update(value, snapshot.at_s) is not None:
                    confirmed.setdefault(name, snapshot.at_s)
    return {watch.rule: _shown(watch, confirmed, largest, opposite) for every in watches.values() for watch in every}


def _shown(
    watch: SymptomWatch, confirmed: dict[str, float], largest: dict[str, float], opposite: dict[str, float]
) -> Shown:
    name = watch.rule.name
    return Shown(confirmed.get(name), largest[name], opposite[name], watch.threshold)
