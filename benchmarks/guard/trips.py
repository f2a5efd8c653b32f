"""How soon a step over a limit trips, and how often noise near a limit trips for nothing: the reactor's own tables."""

from __future__ import annotations

import math
from typing import Any

from benchmarks.guard.scripted_plants import SHAPES, script_of
from benchmarks.guard.store import Sizes, quantile
from homeostat.domain.events.trips import Tripped
from homeostat.domain.events.writes import Cause, WriteIntended
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.ports import GuardEvent
from homeostat.guard.guard import Guard
from homeostat.guard.parts import Attachment
from homeostat.links.simulated import SimulatedLink
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import guard_rules
from tests.equipment.links.scripted import PlantScript, Push, ScriptedPlant

BASES_K = (306.0, 310.0, 312.5)
"""Where the temperature stands before it steps [K]."""
STEPS_K = (3.0, 1.0, 0.5)
"""How far over the limit it steps [K]."""
LIMIT_K = 313.0
BASE_S = 10.0
STEP_S = 60.0
QUIET_K = 312.7
QUIET_S = 6000.0


class Kept:
    """A record that keeps its events in memory."""

    def __init__(self) -> None:
        self.events: list[tuple[float, GuardEvent]] = []

    def record(self, event: GuardEvent, at_s: float) -> None:
        self.events.append((at_s, event))

    def sync(self) -> None:
        """Nothing: memory is all there is."""


def measure(sizes: Sizes) -> dict[str, Any]:
    """Both figures."""
    plant = load_plant("cstr")
    rules = guard_rules(plant)
    steps = []
    for base_k in BASES_K:
        for over_k in STEPS_K:
            delays = [_delay_s(plant, rules, base_k, over_k, seed) for seed in range(sizes.trips)]
            steps.append(
                {
                    "base_k": base_k, "over_k": over_k, "runs": len(delays), "early": sum(map(math.isnan, delays)),
                    "median_s": quantile([d for d in delays if not math.isnan(d)], 0.5),
                    "max_s": max((d for d in delays if not math.isnan(d)), default=math.nan),
                }
            )  # fmt: skip
    tripped = [seed for seed in range(sizes.quiet) if _trips(plant, rules, seed)]
    return {"steps": steps, "quiet": {"runs": sizes.quiet, "length_s": QUIET_S, "tripped": tripped}}


def _delay_s(plant: Plant, rules: GuardRules, base_k: float, over_k: float, seed: int) -> float:
    """From the first reading of the step to the first command of a fallback [s]; infinite where none, NaN if early."""
    step = Push("T1", LIMIT_K + over_k - base_k, STEP_S)
    record = _run(script_of(plant, rules, STEP_S + 120.0, seed, (_to(base_k), step), lag_s=1e-3), rules)
    sent = [at_s for at_s, e in record.events if isinstance(e, WriteIntended) and e.cause is Cause.FALLBACK]
    if sent and sent[0] < STEP_S:
        return math.nan
    return sent[0] - STEP_S if sent else math.inf


def _trips(plant: Plant, rules: GuardRules, seed: int) -> bool:
    record = _run(script_of(plant, rules, QUIET_S, 10_000 + seed, (_to(QUIET_K),), lag_s=1e-3), rules)
    return any(isinstance(e, Tripped) for _, e in record.events)


def _to(base_k: float) -> Push:
    """Brings the temperature to ``base_k`` once start-up is over."""
    return Push("T1", base_k - SHAPES["cstr"].start["T1"], BASE_S)


def _run(script: PlantScript, rules: GuardRules) -> Kept:
    """What the guard journals until it latches or the run ends."""
    link, record = SimulatedLink(ScriptedPlant(script)), Kept()
    guard = Guard(rules, Attachment(record, lease=link))
    while not link.ended and guard.latched is None:
        sample = link.advance()
        guard.tick(link.now_s, sample)
    guard.stop("measured")
    return record
