"""Both plants without a model: where each reading rests, and what moves it; the rest comes from the plant's rules."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from homeostat.domain.plant.rules import GuardRules
from homeostat.plants.plant import Plant
from tests.equipment.links.scripted import PlantScript, Push, ScriptedTag


@dataclass(frozen=True)
class Shape:
    """What is said of one plant by hand; a reading that is not named rests at zero and follows nothing."""

    start: Mapping[str, float]
    """Tag -> where it rests, in its unit."""
    gains: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Tag -> how it follows what is written."""
    violations: Mapping[str, tuple[tuple[str, float], ...]] = field(default_factory=dict)
    """Hard limit -> pushes of readings that violate it, each a tag and how far."""
    drained: Mapping[str, float] = field(default_factory=dict)
    """Writable tag -> where a person at the plant moves it before a restart: the reactor has to be drained."""


SHAPES = {
    "cstr": Shape(
        start={
            "T1": 308.0, "L1": 10.0, "T2": 350.0, "T3": 293.0, "F1": 1.0 / 30.0, "F2": 1.0 / 30.0, "F3": 0.4,
            "V1.pos": 0.5, "P1.pos": 0.5, "V2.pos": 0.6, "V1.cmd": 0.5, "P1.cmd": 0.5, "V2.cmd": 0.6,
        },
        gains={"L1": {"L1.sp": 1.0}, "F1": {"F1.sp": 1.0}},
        violations={
            "LIM-T-HIGH": (("T1", 9.0),), "LIM-L-HIGH": (("L1", 2.0),), "LIM-L-LOW": (("L1", -9.0),),
        },
        drained={"L1.sp": 2.5},
    ),
    "mixing_module": Shape(
        start={
            "B201.level": 0.03, "B202.level": 0.03, "B203.level": 0.03, "B204.level": 0.13,
            "B201.pressure": 0.3, "B202.pressure": 0.3, "B203.pressure": 0.3, "B204.pressure": 1.3,
        },
        gains={"B201.level": {"VI201.cmd": 0.05}, "B201.pressure": {"VI201.cmd": 0.5}},
        violations={
            "LIM-B201-HIGH": (("B201.level", 0.24), ("B201.pressure", 2.4)),
            "LIM-B202-HIGH": (("B202.level", 0.24), ("B202.pressure", 2.4)),
            "LIM-B203-HIGH": (("B203.level", 0.24), ("B203.pressure", 2.4)),
            "LIM-B204-HIGH": (("B204.level", 1.2), ("B204.pressure", 11.5)),
            "LIM-P101-IDLE": (("P101.idle", 30.0),), "LIM-P102-IDLE": (("P102.idle", 30.0),),
        },
    ),
}  # fmt: skip
LAG_S = 5.0


def script_of(
    plant: Plant, rules: GuardRules, end_s: float, seed: int, pushes: tuple[Push, ...] = (), lag_s: float = LAG_S
) -> PlantScript:
    """A script of ``case``: its tags with their stated noise, its writable tags at the start of a run."""
    shape = SHAPES[rules.plant]
    tags = tuple(
        ScriptedTag(tag, shape.start.get(tag, 0.0), shape.gains.get(tag, {}), lag_s, rule.noise or 0.0)
        for tag, rule in rules.qualities.items()
        if tag not in rules.writables
    )
    return PlantScript(tags, written_at_start(plant, rules), end_s, pushes, seed=seed)


def written_at_start(plant: Plant, rules: GuardRules) -> dict[str, float | None]:
    """Writable tag -> its value at the start of a run; None for automatic."""
    index = {tag: plant.model.inputs.index(plant.description.variables[tag]) for tag in rules.writables}
    values = {tag: float(plant.start[i]) for tag, i in index.items()}
    return {tag: None if math.isnan(v) else v for tag, v in values.items()}
