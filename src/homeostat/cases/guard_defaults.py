"""What the guard knows of a plant whose tables do not say it."""

from __future__ import annotations

from dataclasses import replace

from homeostat.domain.plant_description import PlantDescription
from homeostat.domain.rules import QualityRule, StartUp, TripRule, WriteRule
from homeostat.stl.formula import parse

STALE_S = 5.0
"""Oldest reading that is still the present one [s]."""
GRACE_S = 10.0
"""How long a limit may be undecided [s]."""
CUSUM = 8.0
"""Violation times time at which a limit trips [smallest scale of its unit times s]."""
CONFIRM_S = 3.0
"""Time in which the plant must have accepted a command [s]."""


def trips(d: PlantDescription) -> dict[str, TripRule]:
    """Every hard limit by cumulative sums in the scale of its unit."""
    return {x.name: TripRule(x.name, CUSUM * d.scales.get(x.formula.unit, 1.0), GRACE_S) for x in d.limits.hard}


def qualities(d: PlantDescription) -> dict[str, QualityRule]:
    """Every reading by its age; a manual output on automatic has none."""
    manual = {r.tag for s in d.machine.states for r in s.setpoints if r.design is None}
    return {t.name: QualityRule(t.name, STALE_S) for t in d.tags if t.name not in manual}


def writables(d: PlantDescription) -> dict[str, WriteRule]:
    """Every tag that a state admits a command to."""
    found: dict[str, WriteRule] = {}
    for state in d.machine.states:
        for r in state.setpoints:
            automatic = r.design is None or (r.tag in found and found[r.tag].automatic)
            found[r.tag] = WriteRule(r.tag, d.tag(r.tag).scale / 20.0, CONFIRM_S, automatic=automatic)
    return found


def start_up(d: PlantDescription) -> StartUp:
    """No limit is judged before the initial state is left."""
    always = parse("true", d.tags_by_name)
    return StartUp(frozenset({d.machine.initial.name}), {x.name: replace(x, formula=always) for x in d.limits.hard})
