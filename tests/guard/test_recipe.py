"""A plant that runs its own recipe beside the guard: followed by its targets, and told from a person's hand."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.events.guard import SequenceLoaded, StepTaken
from homeostat.domain.events.people import ServiceChanged
from homeostat.domain.events.writes import WriteIntended
from homeostat.domain.mode import Mode, Side, Verb
from homeostat.domain.recovery import Command, Step
from homeostat.guard.restart.memory import Memory
from homeostat.journal.encode import encode_fields
from tests.guard.test_memory import Line
from tests.guard.vessel import BEGIN, MACHINE, POUR, ROUTE, RULES, Journal, World, awaited, statuses

PLANTS = replace(RULES, recipe=Side.PLANT)
MODES = [(Mode.OBSERVE, RULES), (Mode.ADVISE, RULES), (Mode.CLOSED_LOOP, PLANTS), (Mode.APPROVE, PLANTS)]


def begun(mode: Mode = Mode.CLOSED_LOOP, recipe: Side = Side.PLANT) -> World:
    """The plant has filled, and its own recipe has begun to feed."""
    world = World(mode=mode, rules=replace(RULES, recipe=recipe, nominal=(BEGIN, POUR)))
    world.tick(3, L=4.0)
    assert world.seen[-1].state == "waiting"
    world.vessel.accepted["F.sp"] = 0.03
    world.tick(2, L=6.0)
    return world


def pours(world: World) -> None:
    """The plant's recipe takes the step that empties the vessel."""
    world.vessel.accepted.update({c.tag: c.value for c in POUR.commands})
    world.tick(1, L=9.5)


@pytest.mark.parametrize(("mode", "rules"), MODES)
def test_the_guard_follows_and_neither_writes_nor_takes_anything_out_of_service(mode: Mode, rules: object) -> None:
    world = begun(mode, PLANTS.recipe if rules is PLANTS else Side.GUARD)
    assert world.seen[-1].state == "running"
    pours(world)
    assert world.seen[-1].state == "emptying"
    world.tick(3)
    assert world.sent == [] and world.journal.of(ServiceChanged) == []
    world.vessel.accepted["F.sp"] = 0.0
    world.tick(2, L=0.5)
    assert world.seen[-1].state == "rest" and world.alarms == set()


@pytest.mark.parametrize(("mode", "rules"), MODES)
def test_a_hand_on_the_plant_is_no_recipe(mode: Mode, rules: object) -> None:
    world = begun(mode, PLANTS.recipe if rules is PLANTS else Side.GUARD)
    world.vessel.accepted["T.sp"] = 305.0  # which the state admits, but nothing was entered with it
    world.tick(1)
    assert [e.tag for e in world.journal.of(ServiceChanged)] == ["T.sp"] and "moved:T.sp" in world.alarms


def test_a_guard_that_holds_enters_no_state_before_the_plant_has_its_targets() -> None:
    world = begun()
    world.tick(5, L=9.5)
    assert world.seen[-1].state == "running", "the plant's recipe has not taken the step"
    pours(world)
    assert world.seen[-1].state == "emptying"


def test_targets_that_several_states_share_move_the_guard_nowhere() -> None:
    world = begun()
    world.vessel.accepted["F.sp"] = 0.06  # which only a hand can have done
    world.tick(2)
    assert world.seen[-1].state == "running" and [e.tag for e in world.journal.of(ServiceChanged)] == ["F.sp"]
    assert world.journal.of(SequenceLoaded) == []


def test_released_steps_are_the_guards_and_the_recipe_goes_on_behind_them() -> None:
    world = begun()
    assert not world.guard.carries
    world.ask(world.request(actions=ROUTE, path=("adjust", "empty")))
    world.tick(1)
    assert world.guard.carries and world.sent == [ROUTE.commands]
    world.tick(2)
    assert statuses(world)[-1] == "confirmed" and world.guard.carries, "its later step is still to come"
    world.tick(3, L=9.5)
    assert world.sent == [ROUTE.commands, POUR.commands] and world.seen[-1].state == "emptying"
    assert not world.guard.carries
    world.vessel.accepted["F.sp"] = 0.0
    world.tick(2, L=0.5)
    assert world.seen[-1].state == "rest" and len(world.sent) == 2 and world.journal.of(ServiceChanged) == []


def test_a_restart_still_knows_whose_steps_wait() -> None:
    world = begun()
    world.ask(world.request(actions=ROUTE, path=("adjust", "empty")))
    world.tick(4)
    memory = Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e, _ in world.journal.events)
    again = World(rules=PLANTS, vessel=world.vessel, memory=memory, record=Journal(world.journal.events))
    again.tick(4, L=9.5)
    assert world.sent == [ROUTE.commands, POUR.commands]
    plain = begun()
    memory = Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e, _ in plain.journal.events)
    again = World(rules=PLANTS, vessel=plain.vessel, memory=memory, record=Journal(plain.journal.events))
    again.tick(4, L=9.5)
    assert plain.sent == [], "the nominal step is the plant's"


def test_a_trip_acts_and_nothing_of_the_recipe_is_followed_while_latched() -> None:
    world = begun()
    world.tick(4, L=14.0)
    assert world.guard.latched is not None and [w.cause.value for w in world.journal.of(WriteIntended)] == ["fallback"]
    assert world.seen[-1].state == "shut"
    world.order(Verb.RESET, reason="repaired")
    world.tick(3, L=3.0)
    assert world.seen[-1].state == "shut" and world.guard.latched is None
    world.order(Verb.MODE, "closed-loop")
    world.tick(1)
    world.order(Verb.START, "restart")
    world.tick(3)
    assert world.seen[-1].state == "waiting"
    world.tick(10, L=6.0)
    causes = [w.cause.value for w in world.journal.of(WriteIntended)]
    assert causes == ["fallback", "person"], "what follows the start is the plant's"


def test_brought_to_a_mode_that_writes_the_guard_goes_on_where_the_plant_stands() -> None:
    world = begun(Mode.OBSERVE, Side.GUARD)
    assert world.seen[-1].state == "running"
    world.order(Verb.MODE, "closed-loop")
    world.tick(2)
    assert world.sent == []
    world.tick(3, L=9.5)
    assert [w.source for w in world.journal.of(WriteIntended)] == ["empty"] and world.seen[-1].state == "emptying"


def test_what_the_plant_takes_is_journalled_as_a_step_once_and_nothing_else_is() -> None:
    world = begun()
    pours(world)
    world.tick(3)
    assert world.journal.of(StepTaken) == [StepTaken("start", "running"), StepTaken("empty", "emptying")]
    assert world.journal.of(SequenceLoaded) == [] and world.alarms == set()
    assert world.seen[-1].rest.commands == (), "the plant holds what its recipe has sent"


def test_a_way_that_the_nominal_sequence_does_not_take_is_followed_all_the_same() -> None:
    vent = awaited("vent", "running", "rest", "L >= 8")
    machine = replace(MACHINE, transitions=(*MACHINE.transitions, vent))
    world = World(rules=replace(PLANTS, machine=machine, nominal=(BEGIN, POUR)))
    world.tick(3, L=4.0)
    world.vessel.accepted["F.sp"] = 0.03
    world.tick(2, L=6.0)
    world.vessel.accepted["F.sp"] = 0.0
    world.tick(3, L=8.5)  # no step of the nominal sequence is open
    assert world.seen[-1].state == "rest" and world.seen[-1].rest.then == () and world.alarms == set()
    assert world.journal.of(SequenceLoaded) == [SequenceLoaded("", "rest", (), False)]


@pytest.mark.parametrize("mode", [Mode.OBSERVE, Mode.CLOSED_LOOP])
def test_before_the_first_sample_there_is_nothing_to_follow(mode: Mode) -> None:
    world = World(mode=mode, rules=PLANTS)
    world.silent(3)
    assert world.alarms == {"link"} and world.seen[-1].state == "waiting"
    world.tick(1, L=4.0)
    assert world.alarms == set()


def test_while_a_write_is_under_way_nobody_looks_where_the_plant_stands() -> None:
    world = begun()
    world.vessel.hangs = True
    world.ask()
    world.tick()
    pours(world)
    assert world.seen[-1].state == "running" and world.guard.carries


def test_what_was_released_is_over_once_the_plant_has_gone_on_by_itself() -> None:
    world = begun()
    end = Step(MACHINE.transitions[3], (Command("F.sp", 0.0, 0.001),))
    world.ask(world.request(actions=replace(ROUTE, then=(POUR, end)), path=("adjust", "empty", "end")))
    world.tick(3)
    assert statuses(world)[-1] == "confirmed" and world.guard.carries
    world.order(Verb.MODE, Mode.OBSERVE.value)
    world.tick()
    pours(world)
    assert world.seen[-1].state == "emptying"
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(3, L=0.5)
    assert not world.guard.carries and len(world.sent) == 1


def test_a_plant_that_tells_no_state_moves_the_guard_nowhere_and_breaks_nothing() -> None:
    world = begun()
    world.vessel.accepted.update({"F.sp": 0.06, "T.sp": 300.0})
    world.tick(5)
    assert world.seen[-1].state == "running" and not [a for a in world.alarms if a.startswith("guard:")]
