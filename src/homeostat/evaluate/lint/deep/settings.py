"""Settings that only a course shows to be wrong: what is produced, and when a fault begins."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.finding import Finding, Place, Severity, amount
from homeostat.evaluate.score.scoring import made
from homeostat.plants.files.folder import SETTINGS

LIKE: Final = 2.0
"""By how many times what is delivered may differ from what the throughput says."""


def of_settings(bench: Bench) -> Iterator[Finding]:
    """Of a plant that comes to its operation by itself; batches are priced as a whole."""
    plant, course = bench.plant, bench.quiet
    if course.broke or len(course.states) > 2 or not math.isfinite(course.settled_s):
        return
    until_s, settled_s = float(course.truth.times_s[-1]), course.settled_s
    if plant.onset_s < settled_s < until_s:
        what = (
            f"a fault begins at {plant.onset_s:g} s, and the fault-free plant is watched for symptoms from "
            f"{settled_s:g} s on (it starts in {course.started_s:g} s, and settle_s = {plant.monitoring.settle_s:g} s)"
        )
        place, remedy = Place(SETTINGS, None, "run, onset_s"), "let it begin later, or settle sooner (settle_s)"
        yield Finding(Severity.WARNING, "fault-free", place, f"{what}: none is noticed before", remedy)
    if not plant.delivered or settled_s >= until_s:
        return
    production = plant.production
    design, delivered = production.made(until_s - settled_s), made(course.truth, plant.delivered, settled_s)
    if not design / LIKE <= delivered <= LIKE * design:
        unit = next(t.unit for t in plant.description.tags if t.name == production.throughput)
        what = (
            f"{amount(production.design_rate, unit)} for each {production.per_s:g} s are {design:.6g} by design in "
            f"{until_s - settled_s:g} s, and the fault-free plant delivers {delivered:.6g} "
            f"({', '.join(plant.delivered)}): decisions count losses against the one, results against the other"
        )
        remedy = "let throughput, design_rate and per_s count what is delivered, in its unit"
        yield Finding(Severity.WARNING, "fault-free", Place(SETTINGS, None, "objective, delivered"), what, remedy)
