"""Situations of the reactor in which a wait, a test or a release for a stated time is the better answer."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from benchmarks.decisions.loop import FromThenOn, operated
from benchmarks.decisions.seats import OneAnswer
from benchmarks.unknown.causes import KNOWN, Cause
from homeostat.agents.roles import Monitoring
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.evaluate.scenario import Fault, departing, scenario_of
from homeostat.llm.scripted import ScriptedModel
from homeostat.plants.plant import Plant
from homeostat.recovery.bounds import Budget

PATIENT: Final = Budget(latency_s=60.0)
"""As in a plant that leaves a model time to answer."""
HELD_AT: Final = "compensated"
DEAR: Final = {HELD_AT: 8.0, "reduced_load": 8.0}
"""Price of states other than normal operation in which nobody would stay for good, in EUR an hour."""
ONSET_S: Final = 1450.0
WEAK: Final = FaultState("pump_degrade", 0.5, ONSET_S)
STUCK: Final = FaultState("cool_stuck_closed", 0.7, ONSET_S)
DRIFTING: Final = FaultState("temp_bias", 2.0, ONSET_S)


@dataclass(frozen=True, slots=True)
class Case:
    """A plant, a fault and a moment, and the answer that is better than any that lasts."""

    kind: AlternativeKind
    """What kind of answer it is."""
    why: str
    """Why it is the better one."""
    fault: FaultState
    """The fault of the true plant."""
    plan: Mapping[str, Any]
    """What the model answers at its first chance."""
    followed_s: float
    """How long the plant is followed after the onset [s]."""
    seed: int = 401
    """Seed of the run; a ledger tells runs by their fault and seed."""
    commands: Mapping[str, float] = field(default_factory=dict)
    """Tag -> what the model commands."""
    prices: Mapping[str, float] = field(default_factory=dict)
    """State -> price in EUR an hour, where it is not that of the tables."""
    told: tuple[Hypothesis, ...] = ()
    """What the first diagnosis says; none where it is that of the plant's own monitoring."""
    told_s: float = 0.0
    """When that is [s]."""
    intervention: Mapping[str, Any] = field(default_factory=dict)
    """Bounds of the intervention that are not those of the plant."""

    def plant(self, plant: Plant) -> Plant:
        """``plant`` with the prices and bounds of this situation."""
        prices = replace(plant.prices, states={**plant.prices.states, **self.prices})
        return replace(plant, prices=prices, intervention=replace(plant.intervention, **self.intervention))

    def given(self, monitoring: Monitoring) -> Monitoring:
        """``monitoring``, in front of which the first diagnosis is what this situation says."""
        return FromThenOn(monitoring, self.told, self.told_s) if self.told else monitoring


CASES: Final = (
    Case(
        AlternativeKind.WAIT,
        "the valve has just stuck: for 20 s full feed does no harm yet",
        replace(STUCK, onset_s=1700.0),
        {"wait_s": 20.0},
        500.0,
    ),
    Case(
        AlternativeKind.HOLD,
        "the level has to come away from the weir once, and another state costs 8 EUR an hour",
        WEAK,
        {"path": HELD_AT, "hold_s": 60.0},
        500.0,
        commands={"F1.sp": 0.033, "L1.sp": 9.4, "T1.sp": 310.0},
        prices=DEAR,
        told=(Hypothesis((WEAK,), 1.0),),
        told_s=1520.0,
    ),
    Case(
        AlternativeKind.TEST,
        "20 s of another feed tell a stuck valve from a thermometer that lies",
        STUCK,
        {"test": "test 1"},
        500.0,
        told=(Hypothesis((STUCK,), 0.75), Hypothesis((DRIFTING,), 0.25)),
        told_s=1460.0,
        seed=3,
        intervention={"probe_s": 20.0, "answer_s": 10.0},
    ),
)


@dataclass(frozen=True, slots=True)
class Better:
    """What one situation came to, with the search alone and with the stated answer beside it."""

    fault: str
    seed: int
    kind: str
    alone: float | None
    """Points with the search alone; None where nothing was detected."""
    cost: float | None
    """Points with the model beside it."""
    done: dict[str, int]
    """Kind of alternative -> how often it was done as the model's own."""
    outside_s: float
    """Seconds outside a hard limit with the model, from detection on [s]."""

    @property
    def own(self) -> bool:
        """Whether the stated answer was done and counted as the model's."""
        return self.done.get(self.kind, 0) > 0


def causes() -> list[tuple[Cause, int]]:
    """Each situation as a cause that a ledger can tell from the others, with its seed."""
    return [
        (Cause(c.kind.value, KNOWN, fault=c.fault.fault, severity=c.fault.severity, onset_s=c.fault.onset_s), c.seed)
        for c in CASES
    ]


def measure_better(plant: Plant, cause: Cause, seed: int, mismatch: str, end_s: float = math.inf) -> Better:
    """Carry out the situation that is named by ``cause``, at most until ``end_s`` [s]; thinking costs one second."""
    case = next(c for c in CASES if c.kind.value == cause.id)
    priced, f = case.plant(plant), case.fault
    until_s = min(end_s, f.onset_s + case.followed_s)
    told = scenario_of(priced, [Fault(f.fault, f.severity, f.onset_s)], seed, until_s)
    chosen = departing(priced, told, (), mismatch)
    alone = operated(priced, chosen, case.given, None, PATIENT)
    model = ScriptedModel("stated", OneAnswer(case.plan, case.commands))
    run = operated(priced, chosen, case.given, model, PATIENT)
    return Better(f.fault, seed, case.kind.value, alone.points, run.points, run.done, run.outside_s)
