"""Random and adversarial requests straight to a guard with each plant's own rules, and an oracle made of the tables."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from typing import Any

from benchmarks.guard.scripted_plants import SHAPES, written_at_start
from benchmarks.guard.store import Sizes
from homeostat.domain.plant.rules import GuardRules
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import guard_rules
from tests.guard.adversary import attack

STATES = {"cstr": "normal", "mixing_module": "emptying_B201"}
"""Plant -> the state in which it is asked."""
READS: Mapping[str, Mapping[str, float]] = {
    "cstr": {},
    "mixing_module": {
        "B201.level": 0.2, "B202.level": 0.2, "B203.level": 0.2, "B204.level": 0.7,
        "B201.pressure": 1.96, "B202.pressure": 1.96, "B203.pressure": 1.96, "B204.pressure": 6.87,
    },
}  # fmt: skip
"""Plant -> what it reads there, where that is not what it reads at the start."""
EDGES: Mapping[str, tuple[Mapping[str, float], ...]] = {
    "cstr": ({"T1": 313.0}, {"L1": 11.0}),
    "mixing_module": (
        {"B201.level": 0.217, "B201.pressure": 2.11}, {"B204.level": 1.101, "B204.pressure": 10.8}, {"P101.idle": 16.0},
    ),
}  # fmt: skip
"""Plant -> readings at the edge of a hard limit; noise does the rest."""


def measure(plant: str, sizes: Sizes) -> dict[str, Any]:
    """What became of the requests to ``plant``."""
    case = load_plant(plant)
    rules = guard_rules(case)
    state, accepted = STATES[plant], _accepted(case, rules)
    report = attack(rules, _readings(rules, 11), state, accepted, sizes.requests, seed=11)
    return {
        "plant": plant, "asked": report.asked, "accepted": report.accepted, "wrongly": report.wrongly,
        "unanswered": report.unanswered, "altered": report.altered, "refusals": dict(report.refusals.most_common()),
    }  # fmt: skip


def _accepted(case: Plant, rules: GuardRules) -> dict[str, float | None]:
    """The plant's targets in the state in which it is asked."""
    design = {r.tag: r.design for r in rules.machine.state(STATES[rules.plant]).setpoints}
    return {**written_at_start(case, rules), **design}


def _readings(rules: GuardRules, seed: int) -> Callable[[float], dict[str, float]]:
    """A restless plant: noise, now and then an instrument that fails for a moment or a limit that is near."""
    draw, shape = random.Random(seed), SHAPES[rules.plant]
    rest = {**dict.fromkeys(rules.qualities.keys() - rules.writables.keys(), 0.0), **shape.start, **READS[rules.plant]}
    measured = sorted(rest)

    def readings(now_s: float) -> dict[str, float]:
        values = {
            t: rest[t] + draw.gauss(0.0, 1.0) * (((r := rules.qualities.get(t)) and r.noise) or 0.0) for t in rest
        }
        match draw.random():
            case p if p < 0.02:
                values[draw.choice(measured)] = math.nan
            case p if p < 0.06:
                edge = draw.choice(EDGES[rules.plant])
                values |= {t: v + draw.gauss(0.0, 1.0) * (rules.qualities[t].noise or 0.0) for t, v in edge.items()}
        return values

    return readings
