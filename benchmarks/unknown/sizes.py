"""Whether sizes lie where they are said to lie: the true size of what is named, and the interval that is stated."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from benchmarks.unknown.causes import what_changes
from benchmarks.unknown.jobs import Job, scenario_of
from benchmarks.unknown.judge import Statement, is_right
from benchmarks.unknown.tally import Look
from homeostat.domain.diagnosis import EffectKind, FaultMode
from homeostat.domain.disturbance import Disturbance, Effect
from homeostat.evaluate.reference.unsupervised import true_plant
from homeostat.plants.plant import Plant
from homeostat.process.model import column

NOMINAL = 0.95
"""Share of intervals that ought to hold the truth: they reach two standard deviations to either side [1]."""
SUMS, FACTORS = (Effect.PLUS, Effect.READS_PLUS), (Effect.TIMES, Effect.READS_TIMES)


@dataclass(frozen=True, slots=True)
class Sized:
    """One size that was said of what is truly there."""

    fault: str
    """Name of the fault, or of the unknown change."""
    true: float
    """Its true size, in its unit."""
    interval: tuple[float, float] | None
    """Between what it is said to lie; None where one size alone is stated."""

    @property
    def holds(self) -> bool:
        """Whether the interval holds the truth; one size alone does not."""
        return self.interval is not None and self.interval[0] <= self.true <= self.interval[1]

    @property
    def width(self) -> float:
        """Width of the interval as a share of the true size [1]; NaN for none, and of nothing."""
        if self.interval is None or not self.true:
            return math.nan
        return (self.interval[1] - self.interval[0]) / abs(self.true)


def sized(plant: Plant, looks: Iterable[Look]) -> Iterator[Sized]:
    """Every size that the best statement of a look says of what is truly there, where its true size is known."""
    modes = {mode.name: mode for mode in plant.description.fault_modes}
    for look in looks:
        best = look.best if look.looked else None
        if best is None or best.name not in modes or not is_right(best, look.job.cause):
            continue
        true = true_size(plant, look.job, best, modes[best.name], look.judged.at_s)
        if true is not None:
            yield Sized(best.name, true, best.interval)


def true_size(plant: Plant, job: Job, said: Statement, mode: FaultMode, at_s: float) -> float | None:
    """True size at ``at_s`` of what ``said`` names, in its unit; None where what happened is not measured in it.

    Of a fault of the tables its severity. What is said of a reading or a parameter has a size where a disturbance adds
    to it or multiplies it; a relative error of a transmitter only where it is multiplied.
    """
    if job.cause.fault:
        return job.cause.severity if job.cause.fault == said.name else None
    if not job.cause.spec:
        return None
    happened = Disturbance.parse(job.cause.spec)
    if happened.every_s or math.isfinite(happened.to_s) or happened.effect not in (*SUMS, *FACTORS):
        return None
    per_unit, relative, grows, quantity = _measured_in(plant, mode)
    if quantity != happened.name or not per_unit:
        return None
    change = _change(plant, job, happened, relative, at_s)
    growing = happened.over_s > 0.0 and at_s < happened.from_s + happened.over_s
    if change is None or grows != growing:
        return None
    return change / per_unit / (at_s - happened.from_s if growing else 1.0)


def _measured_in(plant: Plant, mode: FaultMode) -> tuple[float, bool, bool, str]:
    """Change of a quantity per unit of ``mode``, whether it is relative, whether it grows, and the quantity.

    A transmitter's quantity is its tag, that of an unknown change a parameter; no quantity where there is neither.
    """
    effect, signals = mode.effect, plant.description.signals
    if effect is None:
        changes = what_changes(plant.name).get(mode.name)
        if changes is None:
            return 0.0, False, False, ""
        return changes["per_unit"], changes.get("relative", False), changes.get("grows", False), changes["name"]
    if mode.unknown:
        quantity = effect.quantity if effect.kind is EffectKind.PARAMETER else ""
        return effect.per_unit, False, effect.grows, quantity
    tag = next((s.tag for s in signals if s.component == mode.component and mode.name.startswith(s.tag.name)), None)
    if tag is None or effect.kind not in (EffectKind.PARAMETER, EffectKind.READING):
        return 0.0, False, False, ""
    unit = mode.severity_unit.removesuffix("/s") if effect.grows else mode.severity_unit
    return effect.per_unit, unit != tag.unit, effect.grows, tag.name


def _change(plant: Plant, job: Job, happened: Disturbance, relative: bool, at_s: float) -> float | None:
    """By how much what ``happened`` has moved its quantity at ``at_s``, as a share where ``relative``; else None."""
    share = happened.share(at_s)
    if happened.effect in SUMS:
        return None if relative else happened.size * share
    if relative:
        return (happened.size - 1.0) * share
    if happened.effect is Effect.READS_TIMES or happened.name not in plant.model.parameters:
        return None
    parameters = true_plant(plant, scenario_of(plant, job)).parameters
    return (happened.size - 1.0) * share * float(parameters[column(plant.model.parameters, happened.name)])
