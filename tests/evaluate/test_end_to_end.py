"""From the alarm to the score on the real reactor, with declared thinking time: a few seeds, short runs."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from homeostat.domain.events.recovery import Attempted, Diagnosed, FallbackArmed, Noticed, ReleasedActions
from homeostat.domain.outcome import Outcome
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.reference.unsupervised import unsupervised
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import Scenario, scenario
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.evaluate.score.scoring import exposures
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.recovery.bounds import Budget
from tests.twin.followed import reactor

ONSET_S = 1450.0
LASTS_S = {"fouling": 4000.0}
"""Seconds from the onset to the end of a run; fouling creeps, and cooling copes with it for most of an hour."""


ALIKE = {
    "pump_degrade": ("outlet_block",),
    "fouling": ("temp_bias", "unknown_heat_R1_growing", "unknown_heat_R1_UA_growing"),
}
"""What the first readings cannot tell from a fault: what cools less and less may foul, or lose heat otherwise."""


def short(fault: str, seed: int) -> Scenario:
    if fault == "none":
        return scenario(reactor(), fault, seed, end_s=1900.0)
    return scenario(reactor(), fault, seed, onset_s=ONSET_S, end_s=ONSET_S + LASTS_S.get(fault, 400.0))


def done(fault: str, seed: int, budget: Budget | None = None) -> tuple[Run, MemoryTrace]:
    trace = MemoryTrace()
    return run(reactor(), short(fault, seed), trace, DeclaredClock(1.0), Proposing(budget=budget or Budget())), trace


@functools.cache
def ran(fault: str, seed: int) -> tuple[Run, MemoryTrace]:
    return done(fault, seed)


RECOVERABLE = [
    ("cool_stuck_closed", 1),
    pytest.param("cool_stuck_closed", 4, marks=pytest.mark.wide),
    pytest.param("pump_degrade", 1, marks=pytest.mark.wide),
    pytest.param("pump_degrade", 2, marks=pytest.mark.wide),
    pytest.param("fouling", 2, marks=pytest.mark.wide),
]


@pytest.mark.parametrize(("fault", "seed"), RECOVERABLE)
def test_the_reactor_is_recovered_and_never_too_hot(fault: str, seed: int) -> None:
    result, _ = ran(fault, seed)
    assert result.outcome is Outcome.RECOVERED and result.good, result.reason
    assert result.actor == "search" and result.attempts >= 1 and result.reason == ""
    running = result.truth.times_s > 600.0
    assert result.truth.signals["T1"][0, running].max() <= 313.0
    assert {e.limit: e.total_s for e in result.exposures if e.total_s > 0.0} == {}
    assert result.production_loss < 0.5


@pytest.mark.parametrize(("fault", "seed"), RECOVERABLE)
def test_the_fault_is_named_before_anything_is_released(fault: str, seed: int) -> None:
    result, trace = ran(fault, seed)
    assert result.detected_s is not None and result.released_s is not None
    assert ONSET_S <= result.detected_s < result.released_s
    kinds = [entry.event.kind for entry in trace.entries]
    order = [kinds.index(e.kind) for e in (Noticed, Diagnosed, FallbackArmed, Attempted, ReleasedActions)]
    assert order == sorted(order), "noticed, diagnosed, fallback armed, attempted, released"
    alike = {fault, *ALIKE.get(fault, ())}
    assert sum(h.probability for h in result.hypotheses if h.name in alike) >= 0.9


def test_without_action_the_same_valve_overheats_the_reactor() -> None:
    """The test above means something: nobody acting is worse."""
    force = LimitsInForce.after(reactor().description, 600.0)
    truth = unsupervised(reactor(), short("cool_stuck_closed", 1)).truth
    exposed = {e.limit: e.total_s for e in exposures(truth, force, None)}
    assert exposed["LIM-T-HIGH"] > 100.0


@pytest.mark.parametrize("seed", [1, 2])
def test_a_healthy_reactor_is_left_alone(seed: int) -> None:
    result, trace = ran("none", seed)
    assert trace.of(Diagnosed) == () and trace.of(ReleasedActions) == ()
    assert result.outcome is Outcome.NO_ACTION and result.good and result.actor == "none"
    assert result.production_loss == 0.0 and result.detected_s is None and result.actions == ()


ALIKE_OTHERS = ("cool_stuck_open", "outlet_block", "level_bias", "inlet_stuck_open")
"""Valves that are stuck open, what starves the outlet as a worn pump does, and another transmitter that lies."""
OTHERS = [
    *("temp_bias", "leak"),
    *(pytest.param(fault, marks=pytest.mark.wide) for fault in ALIKE_OTHERS),
]


@pytest.mark.slow
@pytest.mark.parametrize("fault", OTHERS)
def test_acting_never_breaks_a_limit_for_longer_than_not_acting(fault: str) -> None:
    result, _ = done(fault, 1)
    limits, force = reactor().description.limits, LimitsInForce.after(reactor().description, 600.0)
    alone = {e.limit: e.total_s for e in exposures(unsupervised(reactor(), short(fault, 1)).truth, force, None)}
    acted = {e.limit: e.total_s for e in exposures(result.truth, force, None)}
    hard = {limit.name for limit in limits.hard}
    assert {name: (acted[name], alone[name]) for name in hard if acted[name] > alone[name]} == {}
    assert result.detected_s is not None and result.detected_s - ONSET_S <= 60.0
    assert result.outcome is not Outcome.NOT_DETECTED


def test_what_is_recorded_is_what_the_plant_said() -> None:
    result, _ = ran("pump_degrade", 1)
    assert result.measured.length == result.truth.length
    difference = result.measured.signals["T1"] - result.truth.signals["T1"]
    assert 0.2 < float(np.std(difference[0, 700:1400])) < 1.0, "instruments are noisy, the truth is not"


def test_the_scenario_is_what_was_run() -> None:
    result, _ = ran("cool_stuck_closed", 1)
    assert result.scenario == short("cool_stuck_closed", 1)
    before = result.truth.times_s < ONSET_S
    after = result.truth.times_s > ONSET_S + 10.0
    moved = result.truth.signals["V2.pos"][0]
    assert moved[after] == pytest.approx(1.0 - 0.7, abs=0.01) and moved[before][-1] > 0.4
