"""A step of the plant's own recipe that comes in parts is no hand; a hand is one within a tick all the same."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest

from homeostat.domain.events.guard import StepTaken
from homeostat.domain.events.people import AlarmRaised, ServiceChanged
from homeostat.domain.mode import Mode, Side, Verb
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.guard.restart.memory import Memory
from homeostat.journal.encode import encode_fields
from tests.guard.test_memory import Line
from tests.guard.vessel import BEGIN, MACHINE, POUR, RULES, Journal, Vessel, World, awaited, state

PLANTS = replace(RULES, recipe=Side.PLANT, nominal=(BEGIN, POUR))
MODES = [Mode.OBSERVE, Mode.ADVISE, Mode.CLOSED_LOOP]
PARTS = {"F.sp": 0.0, "V.man": 1.0}
"""What the step commands that empties the vessel."""


def fed(mode: Mode = Mode.CLOSED_LOOP, recipe: Side = Side.PLANT) -> World:
    """The plant's own recipe feeds, and the level is where its next step is open."""
    world = World(mode=mode, rules=replace(PLANTS, recipe=recipe))
    world.tick(3, L=4.0)
    world.vessel.accepted["F.sp"] = 0.03
    world.tick(2, L=6.0)
    world.tick(2, L=9.5)
    assert world.seen[-1].state == "running" and world.guard.out_of_service == frozenset()
    return world


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("order", list(itertools.permutations(PARTS)))
def test_a_step_that_arrives_over_two_samples_is_the_recipes(mode: Mode, order: tuple[str, ...]) -> None:
    world = fed(mode)
    for tag in order:
        world.vessel.accepted[tag] = PARTS[tag]
        world.tick(1)
    world.tick(5)
    assert world.seen[-1].state == "emptying" and world.guard.out_of_service == frozenset()
    assert world.journal.of(ServiceChanged) == [] and world.alarms == set()
    assert world.journal.of(StepTaken)[-1] == StepTaken("empty", "emptying")


@pytest.mark.parametrize("apart", [1, 2, 3, 4])
def test_the_rest_of_it_must_come_within_the_acceptance_time_of_the_tables(apart: int) -> None:
    world = fed()
    world.vessel.accepted["V.man"] = 1.0
    world.tick(apart)
    world.vessel.accepted["F.sp"] = 0.0
    world.tick(4)
    assert world.guard.out_of_service == (frozenset() if apart <= 2 else {"V.man"})
    assert ("moved:V.man" in world.alarms) is (apart > 2)


def test_a_part_that_nothing_follows_is_a_persons_once_the_acceptance_time_is_over() -> None:
    world = fed()
    world.vessel.accepted["V.man"] = 1.0
    world.tick(2)
    assert world.guard.out_of_service == frozenset()
    world.tick(1)
    assert world.guard.out_of_service == {"V.man"}
    assert [e.reason for e in world.journal.of(ServiceChanged)] == ["somebody changed 'V.man' from automatic to 1"]


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("tag", "target"), [("T.sp", 305.0), ("V.man", 0.5), ("F.sp", 0.02), ("X.cmd", 0.0)])
def test_a_target_of_no_step_is_a_persons_within_one_tick(mode: Mode, tag: str, target: float) -> None:
    world = fed(mode)
    world.vessel.accepted[tag] = target
    world.tick(1)
    assert world.guard.out_of_service == {tag}


def test_so_it_is_while_a_step_arrives() -> None:
    world = fed()
    world.vessel.accepted.update({"V.man": 1.0, "T.sp": 305.0})
    world.tick(1)
    assert world.guard.out_of_service == {"T.sp"}
    world.vessel.accepted["F.sp"] = 0.0
    world.tick(3)
    assert world.seen[-1].state == "emptying" and world.guard.out_of_service == {"T.sp"}


def test_a_target_of_a_step_that_is_not_open_is_a_persons_within_one_tick() -> None:
    world = fed()
    world.tick(4, L=7.0)
    world.vessel.accepted["V.man"] = 1.0
    world.tick(1)
    assert world.guard.out_of_service == {"V.man"}


def test_a_step_is_open_for_as_long_as_its_targets_may_take_after_its_guard_held_last() -> None:
    world = fed()
    world.vessel.accepted["V.man"] = 1.0
    world.tick(1, L=8.8)
    world.vessel.accepted["F.sp"] = 0.0
    world.tick(1)
    assert world.guard.out_of_service == frozenset() and world.seen[-1].state == "emptying"


def test_where_the_guard_runs_the_recipe_and_writes_every_move_is_a_persons() -> None:
    world = fed(Mode.OBSERVE, Side.GUARD)
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(1, L=8.5)
    world.tick(4)
    world.vessel.accepted["V.man"] = 1.0
    world.tick(1, L=9.5)
    assert "V.man" in world.guard.out_of_service


def test_a_fallback_that_comes_between_is_not_given_way_to_a_part_of_a_step() -> None:
    world = fed()
    world.vessel.accepted["V.man"] = 1.0
    world.tick(1)
    world.tick(6, L=14.0)
    assert world.guard.latched is not None and world.guard.out_of_service == frozenset()
    assert world.seen[-1].state == "shut" and world.vessel.accepted["X.cmd"] == 0.0


def killed(world: World, mode: Mode, rules: GuardRules) -> World:
    memory = Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e, _ in world.journal.events)
    return World(
        rules=rules, vessel=world.vessel, memory=replace(memory, mode=mode), record=Journal(world.journal.events)
    )


def test_a_part_at_the_moment_of_a_kill_is_not_taken_for_known_and_told_by_the_next_life() -> None:
    world = fed(Mode.OBSERVE)
    world.vessel.accepted["V.man"] = 1.0
    world.tick(1)
    again = killed(world, Mode.OBSERVE, PLANTS)
    again.tick(4)
    (cause,) = [e.cause for e in again.journal.of(AlarmRaised) if e.alarm == "local"]
    assert "V.man from automatic to 1" in cause


@pytest.mark.parametrize("recipe", list(Side))
@pytest.mark.parametrize("mode", MODES)
def test_a_step_that_the_recipe_takes_while_the_guard_is_dead_is_the_recipes(mode: Mode, recipe: Side) -> None:
    world = fed(Mode.OBSERVE, recipe)
    world.vessel.accepted.update(PARTS)
    again = killed(world, mode, replace(PLANTS, recipe=recipe))
    again.tick(3)
    assert again.guard.out_of_service == frozenset() and again.seen[-1].state == "emptying"


def strict(*more: State) -> GuardRules:
    """Rules by which every state has targets that no other one admits; ``more`` states are led to while running."""
    states = (
        state("rest", SetpointRange("F.sp", 0.0, 0.0, 0.0), target=True, settled="T.sp <= 311"),
        state("running", SetpointRange("F.sp", 0.03, 0.03, 0.03), SetpointRange("X.cmd", 1.0, 1.0, 1.0)),
        state("emptying", SetpointRange("F.sp", 0.0, 0.0, 0.0), SetpointRange("V.man", 1.0, 1.0, 1.0)),
        state("waiting", SetpointRange("F.sp", 0.01, 0.01, 0.01), initial=True),
    )
    by_name = {s.name: s for s in states}
    ways = tuple(awaited(s.name, "running", s.name, "L >= 9") for s in more)
    machine = replace(
        MACHINE, states=(*(by_name.get(s.name, s) for s in MACHINE.states), *more),
        transitions=(*MACHINE.transitions, *ways),
    )  # fmt: skip
    return replace(PLANTS, machine=machine)


def strictly(rules: GuardRules, mode: Mode = Mode.OBSERVE) -> World:
    """The plant's own recipe feeds, and is where its next step is open."""
    world = World(mode=mode, rules=rules, vessel=Vessel(F_sp=0.01, V_man=0.0))
    world.tick(3, L=4.0)
    world.vessel.accepted["F.sp"] = 0.03
    world.tick(2, L=6.0)
    world.tick(2, L=9.5)
    assert world.seen[-1].state == "running"
    return world


@pytest.mark.parametrize("mode", [Mode.OBSERVE, Mode.CLOSED_LOOP])
def test_a_part_that_looks_like_another_state_moves_the_guard_nowhere(mode: Mode) -> None:
    """Half of the step that ends the feed leaves a vessel at rest, which is another state."""
    world = strictly(strict(), mode)
    world.vessel.accepted["F.sp"] = 0.0
    for _ in range(2):
        world.tick(1)
        assert world.seen[-1].state == "running", "it would be 'rest' by its targets"
    world.vessel.accepted["V.man"] = 1.0
    world.tick(1)
    assert world.seen[-1].state == "emptying" and world.guard.out_of_service == frozenset()


@pytest.mark.parametrize("mode", [Mode.OBSERVE, Mode.CLOSED_LOOP])
def test_a_plant_that_goes_elsewhere_in_one_sample_is_followed_though_a_step_is_open(mode: Mode) -> None:
    world = strictly(strict(), mode)
    world.vessel.accepted.update({"F.sp": 0.0, "X.cmd": 0.0, "V.man": 0.3, "T.sp": 312.0})
    world.tick(1)
    assert world.seen[-1].state == "shut" and world.guard.out_of_service == {"T.sp"}


def test_a_plant_that_comes_to_a_state_without_moving_a_target_is_found_there() -> None:
    world = World(rules=replace(strict(), recipe=Side.GUARD), vessel=Vessel(F_sp=0.01, V_man=0.0))
    world.tick(4, L=8.0)
    world.order(Verb.MODE, Mode.OBSERVE.value)
    world.tick(1)
    world.vessel.accepted.update({"F.sp": 0.0, "T.sp": 312.0})
    world.tick(2)
    assert world.seen[-1].state == "running"
    world.vessel.accepted["T.sp"] = 310.0
    world.tick(2)
    assert world.seen[-1].state == "rest"


@pytest.mark.parametrize(("apart", "out"), [(1, False), (2, False), (3, True)])
def test_what_else_a_step_commands_may_come_after_its_state_was_entered(apart: int, out: bool) -> None:
    world = fed()
    world.vessel.accepted["F.sp"] = 0.0
    world.tick(apart)
    assert world.seen[-1].state == "emptying"
    world.vessel.accepted["V.man"] = 1.0
    world.tick(1)
    assert world.guard.out_of_service == ({"V.man"} if out else frozenset())


def test_the_slowest_tag_of_a_step_says_how_long_it_may_take() -> None:
    rules = strict()
    slow = {"V.man": replace(rules.writables["V.man"], confirm_s=4.0)}
    world = strictly(replace(rules, writables={**rules.writables, **slow}))
    world.vessel.accepted["F.sp"] = 0.0
    world.tick(4)
    assert world.guard.out_of_service == frozenset()
    world.vessel.accepted["V.man"] = 1.0
    world.tick(1)
    assert world.seen[-1].state == "emptying" and world.guard.out_of_service == frozenset()


COOL = state(
    "cool", SetpointRange("F.sp", 0.0, 0.0, 0.0), SetpointRange("T.sp", 300.0, 300.0, 300.0),
    SetpointRange("V.man", 0.4, 0.5, 0.5),
)  # fmt: skip


def test_the_time_of_a_step_begins_with_its_first_target() -> None:
    world = strictly(strict(COOL))
    world.vessel.accepted["F.sp"] = 0.0
    world.tick(1)
    world.vessel.accepted["T.sp"] = 300.0
    world.tick(1)
    assert world.guard.out_of_service == frozenset()
    world.vessel.accepted["V.man"] = 0.9
    world.tick(1)
    assert world.guard.out_of_service == {"F.sp", "T.sp", "V.man"}


def test_of_two_steps_that_may_arrive_the_slower_one_has_its_time() -> None:
    rules = strict(COOL)
    slow = {"T.sp": replace(rules.writables["T.sp"], confirm_s=4.0)}
    world = strictly(replace(rules, writables={**rules.writables, **slow}))
    world.vessel.accepted["F.sp"] = 0.0
    world.tick(4)
    assert world.guard.out_of_service == frozenset()
    world.vessel.accepted.update({"T.sp": 300.0, "V.man": 0.5})
    world.tick(1)
    assert world.seen[-1].state == "cool" and world.guard.out_of_service == frozenset()


def test_a_step_of_a_state_that_was_left_arrives_no_more() -> None:
    world = strictly(strict(COOL))
    world.vessel.accepted.update(PARTS)
    world.tick(1)
    assert world.seen[-1].state == "emptying"
    world.vessel.accepted["T.sp"] = 300.0
    world.tick(1)
    assert world.guard.out_of_service == {"T.sp"}


def test_a_step_that_was_open_before_a_request_was_written_is_not_open_for_ever() -> None:
    world = fed()
    world.vessel.silent = world.vessel.ignores = True
    world.ask()
    world.tick(4)
    world.vessel.accepted["V.man"] = 1.0
    world.tick(1)
    assert world.guard.out_of_service == {"V.man"}
