"""Probing on the reactor: what is offered is small, open, and worth more than it costs, or nothing is offered."""

from __future__ import annotations

import asyncio
import functools
import math
from dataclasses import replace

import pytest

from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.pricing import Pricing
from homeostat.agents.probing.moves import CHANGE, RISK, STEPS, Move, moves
from homeostat.agents.probing.twin_probing import TwinProbing
from homeostat.agents.roles import Probe, Situation
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.journal.beside.archive import MemoryArchive
from homeostat.plants.plant import load_plant
from homeostat.recovery.probing import LEAST
from homeostat.twin.twin import Twin
from tests.twin.followed import disturbed, follow, reactor

NOW_S = 1650
IDLE = ActionSet((), "normal")
DRIFT = FaultState("T1_drifts_up", 0.03, 1500.0)
JACKET = FaultState("unknown_heat_R1_UA", -140.0, 1500.0)
HEAT = FaultState("unknown_heat_R1", 1.5, 1500.0)


@functools.cache
def seen() -> Twin:
    return follow(disturbed(1, NOW_S, "UA * 0.75 from 1500", mismatch="plant"))


def situation(*weighted: tuple[FaultState | None, float]) -> Situation:
    sets = tuple(Hypothesis(() if f is None else (f,), p) for f, p in weighted)
    now = disturbed(1, NOW_S, "UA * 0.75 from 1500", mismatch="plant")[-1]
    return Situation(now, Diagnosis(now.at_s, (), sets), "normal")


def probes(asked: Situation, seconds: float = 300.0) -> tuple[Probe, ...]:
    plant, d = reactor(), reactor().description
    grounding = Grounding(plant.graph, plant.namespace, MemoryArchive())
    probing = TwinProbing(seen(), d, grounding, Pricing(plant.prices, d.limits, d.scales))
    return asyncio.run(probing.probes(asked, IDLE, seconds))


@functools.cache
def offered() -> tuple[Probe, ...]:
    return probes(situation((JACKET, 0.6), (DRIFT, 0.4)))


@pytest.mark.slow
def test_a_drift_that_time_will_tell_is_waited_for() -> None:
    best = offered()[0]
    assert best.path is None and best.actions == IDLE, "nothing is cheaper than to wait"
    assert best.apart == ("unknown_heat_R1_UA", "T1_drifts_up")
    assert best.nats > 10.0 and best.value - best.cost > LEAST and best.cost == min(p.cost for p in offered())


def test_everything_that_is_offered_pays_and_the_best_comes_first() -> None:
    gains = [p.value - p.cost for p in offered()]
    assert min(gains) > 0.0 and gains == sorted(gains, reverse=True)


def test_what_asks_for_the_same_is_not_told_apart() -> None:
    assert probes(situation((JACKET, 0.55), (HEAT, 0.45))) == ()


@pytest.mark.parametrize("weighted", [
    ((JACKET, 1.0),),
    ((JACKET, 0.985), (DRIFT, 0.015)),
    ((JACKET, 0.7), (replace(JACKET, severity=-150.0), 0.3)),
    ((None, 1.0),),
    (),
])  # fmt: skip
def test_where_one_explanation_is_left_nothing_is_offered(
    weighted: tuple[tuple[FaultState | None, float], ...],
) -> None:
    assert probes(situation(*weighted)) == ()


def test_equal_questions_have_equal_answers() -> None:
    assert probes(situation((JACKET, 0.6), (DRIFT, 0.4))) == offered()


def test_an_explanation_that_the_model_cannot_carry_stops_nobody() -> None:
    beyond = FaultState("unknown_heat_R1", 1e308, 1500.0)
    assert probes(situation((JACKET, 0.5), (beyond, 0.5))) == ()


# --- moves ---------------------------------------------------------------------------------------------------------


def paths() -> list[RecoveryPath]:
    machine = reactor().description.machine
    values = {"T1": 310.0, "L1": 10.0}
    found = machine.paths("normal", values, machine.recovery_event, blocked=())
    return [RecoveryPath(machine, transitions) for transitions in found]


STANDS = {"T1.sp": 310.0, "L1.sp": 10.0, "F1.sp": 1.0 / 30.0, "V2.man": math.nan, "XV1.cmd": 1.0}


def found(**changed: float) -> list[Move]:
    given = {name.replace("_", "."): value for name, value in changed.items()}
    return list(moves(paths(), reactor().description.tags_by_name, STANDS | given))


def test_moves_are_one_small_step_of_one_setpoint_inside_its_range() -> None:
    machine = reactor().description.machine
    assert found()
    for move in found():
        assert move.path is not None and move.path.target in ("compensated", "reduced_load")
        state = machine.state(move.path.target)
        changed = []
        for command in move.actions.commands:
            admitted = state.setpoint(command.tag)
            assert admitted is not None
            if command.value is None:
                continue
            assert admitted.low <= command.value <= admitted.high
            if abs(command.value - STANDS[command.tag]) > 1e-6:
                changed.append(abs(command.value - STANDS[command.tag]) / (admitted.high - admitted.low))
        assert len(changed) == 1 and min(abs(changed[0] - step) for step in STEPS) < 1e-6


def test_a_move_costs_something_and_the_more_the_further_and_riskier() -> None:
    one = [m for m in found() if m.path is not None and m.path.target == "compensated"]
    assert all(m.once > CHANGE and m.risk == pytest.approx(RISK) for m in one)
    other = [m for m in found() if m.path is not None and m.path.target == "reduced_load"]
    assert all(m.risk == pytest.approx(2.0 * RISK) for m in other)


def test_no_move_is_offered_twice() -> None:
    digests = [m.actions.digest for m in found()]
    assert len(digests) == len(set(digests))


def test_nothing_is_moved_to_a_state_that_the_plant_does_not_stand_in() -> None:
    assert not any(m.path is not None and m.path.target == "holding" for m in found())
    assert {m.path.target for m in found(F1_sp=0.02) if m.path} == {"reduced_load"}, "full load is no small step"


def module_moves(state: str, **values: float) -> list[str]:
    """Where the moves of the module lead that is in ``state``, with both pumps at rest."""
    d = load_plant("mixing_module").description
    now = {tag: 0.0 for tag in d.tags_by_name} | {name.replace("_", ".", 1): v for name, v in values.items()}
    ways = d.machine.paths(state, now, d.machine.recovery_event, blocked=())
    taken = moves([RecoveryPath(d.machine, way) for way in ways], d.tags_by_name, now)
    return [move.path.target for move in taken if move.path is not None]


def test_a_stop_is_a_move_where_somebody_may_go_on_from_it() -> None:
    assert "held" in module_moves("filling_B201"), "it shuts a valve that may be stuck"
    assert "held" not in module_moves("filling_B202"), "from there on the module wants B201 to be full"
    assert "held" in module_moves("filling_B202", B201_level=0.2)


def test_nothing_leaves_its_range_where_the_plant_stands_at_its_end() -> None:
    for move in found(T1_sp=312.6, L1_sp=10.4):
        assert all(c.value is None or c.value <= 312.6 for c in move.actions.commands)
