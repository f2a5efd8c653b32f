"""A lapse at its edges: what is told of it, what is put right behind it, and how far a recipe has led."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.mode import Mode, Verb
from homeostat.domain.recovery import Command, Step
from homeostat.guard.writing.lapse import local
from tests.guard.test_lapse import Sheds, lapsing
from tests.guard.test_local_control import told
from tests.guard.vessel import BEGIN, POUR, RULES, World

END = Step(RULES.machine.transitions[3], (Command("F.sp", 0.0, 0.005), Command("V.man", None, None)))
ROUTE = replace(RULES, nominal=(BEGIN, POUR, END))
"""A recipe that goes on to its end by itself."""


def test_what_a_person_has_moved_on_is_not_told_as_local_control() -> None:
    world, vessel = lapsing(keeps=True)
    vessel.shed()
    world.tick(2)
    vessel.accepted["V.man"] = 0.2
    world.tick(2)
    assert world.guard.out_of_service == {"V.man"}
    vessel.keeps = False
    world.tick(15)
    assert told(world) == []


def test_what_local_control_has_moved_there_and_back_is_not_told() -> None:
    world = World(vessel=Sheds(), rules=ROUTE)
    world.tick(4)
    vessel = world.vessel
    assert isinstance(vessel, Sheds)
    vessel.tells = vessel.keeps = True
    for target in (1.0, None):
        vessel.shed(V_man=target)
        world.tick(2)
    vessel.keeps = False
    world.tick(15)
    assert told(world) == [] and world.guard.out_of_service == frozenset()


def test_what_local_control_moves_in_two_steps_is_told_as_one() -> None:
    world, vessel = lapsing(keeps=True, rules=ROUTE)
    for target in (None, 1.0):
        vessel.shed(V_man=target)
        world.tick(2)
    vessel.keeps = False
    world.tick(15)
    assert len(told(world)) == 1 and "moved V.man from 0.4 to 1;" in told(world)[0][0]


@pytest.mark.parametrize(("tag", "target", "may"), [
    ("V.man", None, True), ("F.sp", None, False), ("F.sp", 0.03, True), ("F.sp", 0.0305, True), ("F.sp", 0.032, False),
    ("T.sp", 0.03, False), ("V.man", 1.0, True), ("V.man", 0.03, False), ("X.cmd", 0.0, False),
])  # fmt: skip
def test_local_control_does_what_the_tables_let_it_do(tag: str, target: float | None, may: bool) -> None:
    assert local(ROUTE, tag, target) is may


def test_who_gives_up_a_lost_lease_lets_the_plant_s_own_control_move_its_targets() -> None:
    world, vessel = lapsing(keeps=True)
    vessel.void = True
    world.tick(2)
    assert not world.guard._parts.tenure.held
    world.order(Verb.MODE, Mode.OBSERVE.value, reason="a test")
    world.tick(2)
    vessel.accepted["V.man"] = None
    world.tick(3)
    assert world.guard.out_of_service == frozenset()
