"""Where the sequence goes on after a lapse: only where the plant's recipe has led, and where its state admits it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.events.guard import SequenceLoaded, StepTaken
from homeostat.domain.plant.state_machine import SetpointRange
from homeostat.domain.recovery import ActionSet, Command
from tests.guard.test_lapse import MORE, Sheds
from tests.guard.test_local_control import told
from tests.guard.test_recipe_and_lapse import PLANTS, TOLD_APART
from tests.guard.test_withdrawn_steps import killed
from tests.guard.vessel import ADJUSTED, MACHINE, POUR, World, state, statuses

NARROW = state(
    "running", SetpointRange("T.sp", 298.0, 312.0, 310.0), SetpointRange("F.sp", 0.01, 0.05, 0.03),
    SetpointRange("V.man", 0.0, 0.5, None), SetpointRange("X.cmd", 1.0, 1.0, 1.0), target=True,
)  # fmt: skip
END = MORE.nominal[2]
AJAR = replace(MACHINE, states=tuple(NARROW if s.name == "running" else s for s in TOLD_APART.states))
"""A vessel that feeds with its valve half open at most."""


def feeding(**rest: object) -> tuple[World, Sheds]:
    """A vessel that feeds; its valve is left to the plant."""
    vessel = Sheds()
    world = World(vessel=vessel, rules=replace(MORE, machine=AJAR, **rest))  # type: ignore[arg-type]
    world.tick(4)
    assert world.seen[-1].state == "running" and vessel.accepted["F.sp"] == 0.03
    vessel.wire.clear()
    return world, vessel


def lapse(world: World, vessel: Sheds, **moved: float | None) -> str:
    """The lease is lost, the plant's own control moves targets, and the lease is taken again; what a person is told."""
    vessel.tells = vessel.keeps = True
    vessel.shed(**moved)
    world.tick(3)
    vessel.keeps = False
    world.tick(15)
    ((text, _),) = told(world)
    return text.partition("; ")[2]


def test_the_nearest_state_of_the_recipe_counts_and_the_others_that_fit_are_named() -> None:
    world, vessel = feeding()
    said = lapse(world, vessel, F_sp=0.0, V_man=1.0)
    assert said == "the sequence goes on from state 'emptying', and 'rest' would fit, too"
    assert world.seen[-1].state == "emptying"
    world.tick(3, L=0.5)
    assert world.seen[-1].state == "rest" and world.sent == [(Command("F.sp", 0.0, 0.005),)]


def test_where_one_state_fits_no_other_is_named() -> None:
    world, vessel = feeding(nominal=MORE.nominal[:2])
    assert lapse(world, vessel, F_sp=0.0, V_man=1.0) == "the sequence goes on from state 'emptying'"


@pytest.mark.parametrize("moved", [{"F_sp": 0.0, "V_man": None}, {"F_sp": 0.03, "V_man": 1.0}])
def test_where_a_part_of_a_step_is_there_the_sequence_stops(moved: dict[str, float | None]) -> None:
    world, vessel = feeding()
    route = ActionSet((Command("V.man", 0.4, 0.2),), "running", (POUR, END))
    world.ask(world.request(actions=route, path=("adjust", "empty", "end")))
    world.tick(3)
    assert statuses(world)[-1] == "confirmed" and vessel.accepted["V.man"] == 0.4
    vessel.wire.clear()
    said = lapse(world, vessel, **moved)
    assert "does not admit that, so the sequence has stopped" in said
    assert world.journal.of(SequenceLoaded)[-1].steps == () and world.sent == []


def test_steps_that_were_released_stop_where_the_plant_s_recipe_has_left_their_state() -> None:
    vessel = Sheds()
    world = World(rules=replace(PLANTS, machine=AJAR), vessel=vessel)
    world.tick(3, L=4.0)
    vessel.accepted["F.sp"] = 0.03
    world.tick(2, L=6.0)
    route = ActionSet(ADJUSTED.commands, "running", (POUR, END))
    world.ask(world.request(actions=route, path=("adjust", "empty", "end")))
    world.tick(3)
    world.tick(4, L=9.5)
    assert statuses(world)[-1] == "confirmed" and world.seen[-1].state == "emptying" and world.guard.carries
    vessel.wire.clear()
    assert "has stopped" in lapse(world, vessel, V_man=None)
    assert not world.guard.carries
    world.tick(5, L=0.5)
    assert world.sent == []


def test_a_guard_that_came_back_in_observe_takes_no_step_for_the_plant() -> None:
    world, vessel = feeding()
    vessel.shed(F_sp=0.0, V_man=1.0)
    again = killed(world, rules=replace(MORE, machine=AJAR), goes_on=False)
    again.tick(3, L=3.0)
    assert again.seen[-1].state == "emptying" and again.journal.of(SequenceLoaded)[-1].source == "local control"
    taken = len(again.journal.of(StepTaken))
    again.tick(3, L=0.5)
    assert again.seen[-1].state == "rest" and again.journal.of(SequenceLoaded)[-1].source == ""
    assert len(again.journal.of(StepTaken)) == taken
