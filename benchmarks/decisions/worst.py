"""The three runs that a review found to lose most, and what they cost now."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.decisions.measure import Decision, measure
from benchmarks.unknown.causes import KNOWN, Cause
from homeostat.plants.plant import Plant

FOLLOWED_S = 2500.0
"""How long each is followed after its onset [s]."""


@dataclass(frozen=True, slots=True)
class Before:
    """One of them, with what was found then; production lost in points of the fault-free one."""

    fault: str
    severity: float
    seed: int
    onset_s: float
    lost: float
    """Lost with everything on."""
    best: float
    """Lost by the best constant."""


BEFORE = (
    Before("pump_degrade", 0.699, 1002, 939.0, 73.7, 35.1),
    Before("cool_stuck_closed", 0.734, 1003, 2122.0, 67.4, 26.7),
    Before("outlet_block", 0.595, 1000, 1076.0, 67.5, 10.1),
)


def causes() -> list[tuple[Cause, int]]:
    """Each with its seed."""
    return [
        (Cause(b.fault, KNOWN, known=True, fault=b.fault, severity=b.severity, onset_s=b.onset_s), b.seed)
        for b in BEFORE
    ]


def measure_worst(plant: Plant, cause: Cause, seed: int, mismatch: str) -> Decision:
    """Run one of them until :data:`FOLLOWED_S` after its onset."""
    return measure(plant, cause, seed, mismatch, cause.onset_s + FOLLOWED_S)
