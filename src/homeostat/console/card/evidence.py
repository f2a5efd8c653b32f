"""The trend that a symptom was seen in: its feature over time, with the band of healthy plants."""

from dataclasses import dataclass

import numpy as np

from homeostat.agents.monitoring.features import FeatureFilter
from homeostat.console.opened import KnownPlant
from homeostat.console.readings import Readings, Values, thinned
from homeostat.domain.snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class Trend:
    """Values over time."""

    times_s: tuple[float, ...]
    """Process times [s]."""
    series: tuple[tuple[str, tuple[float, ...]], ...]
    """Name -> values at these times, NaN where there is none."""


@dataclass(frozen=True, slots=True)
class FeatureTrend:
    """A feature over time."""

    trend: Trend
    """Its values."""
    unit: str
    """Its unit."""
    band: tuple[float, float]
    """Between what 98 % of the values of healthy plants lie."""


class Evidence:
    """Features of one run, each computed once; readings are as they were recorded."""

    def __init__(self, plant: KnownPlant, readings: Readings) -> None:
        """Nothing is computed yet."""
        self._plant, self._readings = plant, readings
        self._known: dict[str, Values] = {}

    @property
    def last_s(self) -> float:
        """Time of the last reading [s]."""
        return self._readings.last_s

    def feature(self, name: str, from_s: float, to_s: float, width: int) -> FeatureTrend | None:
        """The feature called ``name`` from ``from_s`` to ``to_s`` [s], on ``width`` pixels.

        None where the plant has no such feature or no reference for it.
        """
        baseline = self._plant.baselines.get(name)
        feature = next((f for f in self._plant.description.features if f.name == name), None)
        if baseline is None or feature is None:
            return None
        if name not in self._known:
            self._known[name] = self._computed(FeatureFilter(feature))
        part = self._readings.between(from_s, to_s)
        times, values = self._readings.times_s[part], self._known[name][part]
        kept = thinned(times, [values], width)
        trend = Trend(tuple(times[kept].tolist()), ((name, _drawn(values[kept])),))
        return FeatureTrend(trend, feature.unit, (baseline.p01, baseline.p99))

    def _computed(self, watched: FeatureFilter) -> Values:
        feature, signals = watched.feature, self._readings.signals
        used = feature.tags
        columns = {tag: signals[tag].tolist() for tag in used if tag in signals}
        values = np.full(self._readings.times_s.size, np.nan)
        for index, at_s in enumerate(self._readings.times_s.tolist()):
            found = watched.update(Snapshot(at_s, {tag: column[index] for tag, column in columns.items()}))
            values[index] = np.nan if found is None else found
        return values


def readings_trend(readings: Readings, tags: tuple[str, ...], from_s: float, to_s: float, width: int) -> Trend:
    """Readings of ``tags`` from ``from_s`` to ``to_s`` [s], on ``width`` pixels; KeyError for a tag that has none."""
    part = readings.between(from_s, to_s)
    times, series = readings.times_s[part], [readings.signals[tag][part] for tag in tags]
    kept = thinned(times, series, width)
    drawn = zip(tags, series, strict=True)
    return Trend(tuple(times[kept].tolist()), tuple((tag, _drawn(values[kept])) for tag, values in drawn))


def _drawn(values: Values) -> tuple[float, ...]:
    """Values with as many digits as a screen can show."""
    return tuple(float(f"{value:.6g}") for value in values.tolist())
