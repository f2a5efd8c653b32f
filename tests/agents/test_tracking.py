"""Tracking: a stuck actuator is held by hand near where it stands, and no other is."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from homeostat.agents.roles import Situation
from homeostat.agents.search.candidates import SearchSpace
from homeostat.agents.search.tracking import BESIDE, blind, held, search_space, tracking
from homeostat.domain.advice import Advice
from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath
from homeostat.process.types import Vec
from homeostat.twin.forecast import Ensemble
from tests.agents.stuck_valve import DIAGNOSIS, NOW_S, QUICK, STUCK, now, search, stuck
from tests.twin.followed import follow, reactor

PLANT = reactor().description


def thought(*hypotheses: Hypothesis) -> Situation:
    return replace(now(), diagnosis=replace(DIAGNOSIS, hypotheses=hypotheses))


REDUCE = RecoveryPath(PLANT.machine, (next(t for t in PLANT.machine.transitions if t.name == "t_reduce"),))
SURE = (Hypothesis((STUCK,), 1.0),)


def test_positions_follow_from_the_structure() -> None:
    assert PLANT.positions == {"V1": "V1.pos", "P1": "P1.pos", "V2": "V2.pos"}


def test_where_a_stuck_valve_stands_is_read_since_it_is_stuck() -> None:
    assert held(PLANT, thought(*SURE)) == {"V2.man": pytest.approx(0.3, abs=0.01)}


@pytest.mark.parametrize(
    "hypotheses",
    [
        (Hypothesis((), 1.0),),
        (Hypothesis((FaultState("fouling", 0.5, 1450.0),), 1.0),),
        (Hypothesis((STUCK,), 0.6), Hypothesis((FaultState("fouling", 0.5, 1450.0),), 0.4)),
    ],
)
def test_one_that_may_still_move_is_left_to_its_controller(hypotheses: tuple[Hypothesis, ...]) -> None:
    assert held(PLANT, thought(*hypotheses)) == {}


def test_where_nothing_shows_its_position_nothing_is_held() -> None:
    bad = frozenset({"V2.pos"})
    blind = tuple(replace(s, bad=bad) for s in now().recent)
    assert held(PLANT, replace(thought(*SURE), recent=blind)) == {}


def test_what_is_held_is_no_choice() -> None:
    state = PLANT.machine.state("reduced_load")
    space = search_space(PLANT, state, {"V2.man": 0.36})
    column = [r.tag for r in state.setpoints].index("V2.man")
    assert {point[column] for point in space.first(space.design)} == {0.36}
    free = SearchSpace(state, PLANT.tags_by_name)
    assert search_space(PLANT, state, {}).ranges == free.ranges


FROZEN = FaultState("T1_frozen", 1.0, 1450.0)
BIASED = FaultState("T1_reads_high", 2.0, 1450.0)
AT_NOW = {"V2.man": pytest.approx(now().snapshot.values["V2.cmd"])}
FEED_NOW = {"V1.man": pytest.approx(now().snapshot.values["V1.cmd"])}


@pytest.mark.parametrize(
    ("hypotheses", "found"),
    [
        ((Hypothesis((FROZEN,), 1.0),), AT_NOW), ((Hypothesis((FROZEN, BIASED), 1.0),), AT_NOW),
        ((Hypothesis((FROZEN,), 0.95), Hypothesis((), 0.05)), AT_NOW),
        ((Hypothesis((FROZEN,), 0.6), Hypothesis((), 0.4)), {}), ((Hypothesis((BIASED,), 1.0),), {}),
        ((Hypothesis((FaultState("F1_frozen", 1.0, 1450.0),), 1.0),), FEED_NOW),
    ],
)  # fmt: skip
def test_what_goes_by_a_frozen_instrument_has_its_output_where_it_is(
    hypotheses: tuple[Hypothesis, ...], found: dict[str, float]
) -> None:
    """Each loop has its own instrument; one that is off may be corrected for."""
    assert blind(PLANT, thought(*hypotheses)) == found


@pytest.mark.parametrize("command", [math.nan, 7.0, -3.0])
def test_an_output_that_nobody_knows_stays_on_automatic_and_another_one_is_brought_into_its_range(
    command: float,
) -> None:
    known = thought(Hypothesis((FROZEN,), 1.0))
    snapshot = replace(known.snapshot, values={**known.snapshot.values, "V2.cmd": command})
    found = blind(PLANT, replace(known, snapshot=snapshot))
    assert found == ({} if math.isnan(command) else {"V2.man": min(max(command, 0.0), 1.0)})


def test_by_hand_is_no_change_and_automatic_is_no_choice() -> None:
    state = PLANT.machine.state("reduced_load")
    column = [r.tag for r in state.setpoints].index("V2.man")
    space = search_space(PLANT, state, {}, {"V2.man": 0.37})
    tried = {point[column] for point in space.first(space.present({}))}
    assert {0.0, 0.37, 1.0} <= tried and None not in tried and space.design[column] == 0.37
    assert space.distance(space.design) == 0.0 and not space.admits((*space.design[:column], None))
    assert search_space(PLANT, state, {"V2.man": 0.2}, {"V2.man": 0.37}).design[column] == 0.2, "what is stuck is fixed"
    normal = PLANT.machine.state("normal")
    assert search_space(PLANT, normal, {}, {"V2.man": 0.37}).ranges == normal.setpoints, "which leaves no choice"


def first(sets: Sequence[ActionSet], ensemble: Ensemble) -> Vec:
    """A judge to whom the first is the best."""
    return np.arange(len(sets), dtype=np.float64)


def commanded(position: float, f1: float) -> float:
    """Where V2 is commanded to stand, stuck at ``position``, with a feed of ``f1`` [L/s] at 310 K."""
    orders = (Command("F1.sp", f1, 0.005), Command("T1.sp", 310.0, 0.5), Command("V2.man", position, 0.2))
    actions = ActionSet((*orders, Command("L1.sp", 10.0, 0.1), Command("XV1.cmd", 1.0, 0.05)), "reduced_load")
    found = tracking(PLANT, follow(stuck()[:NOW_S]), actions, {"V2.man": position}, first).command("V2.man")
    assert found is not None and found.value is not None
    return found.value


def test_it_is_commanded_to_where_its_controller_would_have_it() -> None:
    """Full feed needs half of the cooling water (0.51 by the hand check of the reactor's equations)."""
    assert commanded(0.2, 1.0 / 30.0) == pytest.approx(0.51, abs=0.05)


@pytest.mark.parametrize("position", [0.49, 0.53])
def test_where_that_is_where_it_is_stuck_it_stands_beside(position: float) -> None:
    assert abs(commanded(position, 1.0 / 30.0) - position) >= BESIDE - 0.005


def test_it_stands_on_the_side_on_which_the_plant_fares_better_once_it_moves() -> None:
    asked: list[list[float]] = []

    def warm(sets: Sequence[ActionSet], ensemble: Ensemble) -> Vec:
        asked.append([float(order.value or 0.0) for a in sets if (order := a.command("V2.man")) is not None])
        return np.array(asked[-1])

    orders = (Command("F1.sp", 1.0 / 30.0, 0.005), Command("T1.sp", 310.0, 0.5), Command("V2.man", 0.5, 0.2))
    actions = ActionSet((*orders, Command("L1.sp", 10.0, 0.1), Command("XV1.cmd", 1.0, 0.05)), "reduced_load")
    for judge, side in ((warm, -BESIDE), (lambda sets, ensemble: -warm(sets, ensemble), BESIDE)):
        order = tracking(PLANT, follow(stuck()[:NOW_S]), actions, {"V2.man": 0.5}, judge).command("V2.man")
        assert order is not None and order.value == pytest.approx(0.5 + side, abs=0.005)
    assert [sorted(each) for each in asked] == [pytest.approx([0.5 - BESIDE, 0.5 + BESIDE], abs=0.005)] * 2


def test_a_side_that_a_healthy_plant_cannot_bear_is_not_taken() -> None:
    """Full feed with a third of the cooling water would be too hot: the reactor's own search stands above it."""
    found = asyncio.run(search(QUICK).act(thought(*SURE), REDUCE, Advice()))
    assert isinstance(found, ActionSet) and (order := found.command("V2.man")) is not None
    assert order.value is not None and order.value >= 0.3 + BESIDE - 0.005


@pytest.mark.parametrize("position", [0.0, 1.0])
@pytest.mark.parametrize("f1", [0.002, 1.0 / 30.0])
def test_it_stays_inside_its_range(position: float, f1: float) -> None:
    assert 0.0 <= commanded(position, f1) <= 1.0


def narrowed(low: float, high: float) -> PlantDescription:
    """The reactor where reduced load admits the cooling valve by hand from ``low`` to ``high`` only."""
    states = tuple(
        replace(s, setpoints=tuple(replace(r, low=low, high=high) if r.tag == "V2.man" else r for r in s.setpoints))
        if s.name == "reduced_load"
        else s
        for s in PLANT.machine.states
    )
    return replace(PLANT, machine=replace(PLANT.machine, states=states))


@pytest.mark.parametrize(("low", "high"), [(0.0, 0.0), (0.0, 0.25)])
def test_it_stays_where_its_state_admits_it(low: float, high: float) -> None:
    actions = ActionSet((Command("F1.sp", 1.0 / 30.0, 0.005), Command("V2.man", low, 0.2)), "reduced_load")
    found = tracking(narrowed(low, high), follow(stuck()[:NOW_S]), actions, {"V2.man": 0.2}, first).command("V2.man")
    assert found is not None and found.value is not None and low <= found.value <= high


def test_nothing_else_is_changed() -> None:
    actions = ActionSet((Command("F1.sp", 0.02, 0.005),), "reduced_load")
    assert tracking(PLANT, follow(stuck()[:NOW_S]), actions, {"V2.man": 0.3}, first) is actions


def test_the_search_commands_it() -> None:
    found = asyncio.run(search(QUICK).act(thought(*SURE), REDUCE, Advice()))
    assert isinstance(found, ActionSet)
    order = found.command("V2.man")
    assert order is not None and order.value is not None and abs(order.value - 0.3) >= BESIDE - 0.005
