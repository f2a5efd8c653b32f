"""Released steps do not outlive the mode that writes: neither a change of the mode nor a restart brings them back."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.guard import SequenceLoaded
from homeostat.domain.events.people import AlarmRaised, ModeEntered
from homeostat.domain.events.writes import Cause, WriteIntended
from homeostat.domain.mode import Mode, Side, Verb
from homeostat.domain.plant.limits import LimitKind
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.guard.restart.memory import Memory
from homeostat.journal.encode import encode_fields
from tests.guard.test_memory import Line
from tests.guard.test_ramps import GUARDED, values
from tests.guard.vessel import ADJUSTED, BEGIN, LIMITS, MACHINE, POUR, RULES, Journal, World, limit, running, statuses

GENTLE = Step(MACHINE.transitions[2], (Command("F.sp", 0.01, 0.005), Command("V.man", 0.5, 0.2)))
"""The step that empties the vessel, otherwise than by design."""
GENTLY = ActionSet(ADJUSTED.commands, "running", (GENTLE,))
WHOLE = replace(RULES, nominal=(BEGIN, POUR))
WATCHING = [Mode.OBSERVE, Mode.ADVISE]


def released(actions: ActionSet = GENTLY, rules: GuardRules = WHOLE, ramp_s: int = 0) -> World:
    """A request was written, and its later step waits for the level; the guard may need ``ramp_s`` for a ramp [s]."""
    world = running(rules=rules)
    world.tick(ramp_s)
    world.ask(world.request(actions=actions, path=("adjust", "empty")))
    world.tick(2 + ramp_s)
    assert statuses(world)[-1] == "confirmed" and world.guard.carries
    world.vessel.wire.clear()
    return world


def through(world: World, mode: Mode, seconds: int = 1) -> None:
    """To a mode in which nobody writes, and back; the plant does not move meanwhile."""
    world.order(Verb.MODE, mode.value)
    world.tick(seconds)
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(1)


def killed(world: World, upto: int | None = None, **rest: Any) -> World:
    """The guard dies, and another one goes on with the first ``upto`` events of the journal."""
    journal = Journal(world.journal.events[:upto])
    memory = Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e, _ in journal.events)
    rest.setdefault("rules", WHOLE)
    return World(vessel=world.vessel, memory=memory, record=journal, **rest)


def withdrawn(world: World) -> list[str]:
    return [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == "withdrawn"]


@pytest.mark.parametrize("mode", WATCHING)
def test_what_was_released_is_not_written_when_a_mode_that_writes_returns(mode: Mode) -> None:
    world = released()
    through(world, mode)
    world.tick(6, L=9.5)
    assert GENTLE.commands not in world.sent and world.vessel.accepted["V.man"] != 0.5
    assert not world.guard.carries


@pytest.mark.parametrize("mode", WATCHING)
def test_an_alarm_names_what_comes_no_more(mode: Mode) -> None:
    world = released()
    world.order(Verb.MODE, mode.value)
    world.tick()
    (cause,) = withdrawn(world)
    assert "'empty'" in cause and f"Ada changed the mode to {mode.value!r}" in cause
    world.tick(5)
    assert len(withdrawn(world)) == 1


def test_the_guard_takes_its_own_recipe_up_again_from_where_the_plant_stands() -> None:
    world = released()
    through(world, Mode.OBSERVE)
    world.tick(6, L=9.5)
    assert world.sent == [POUR.commands] and world.seen[-1].state == "emptying"
    loads = world.journal.of(SequenceLoaded)[-1]
    assert (loads.source, loads.state, [s.transition for s in loads.steps]) == ("", "running", ["empty", "end"])


def test_a_recipe_of_the_plant_stays_the_plants() -> None:
    world = released(rules=replace(WHOLE, recipe=Side.PLANT))
    through(world, Mode.OBSERVE)
    world.tick(6, L=9.5)
    assert world.sent == [] and len(withdrawn(world)) == 1


@pytest.mark.parametrize(("recipe", "told"), [(Side.GUARD, False), (Side.PLANT, True)])
def test_what_was_released_just_as_the_recipe_has_it_goes_on_where_the_guard_runs_the_recipe(
    recipe: Side, told: bool
) -> None:
    end = Step(MACHINE.transitions[3], (Command("F.sp", 0.0, 0.005),))
    world = running(rules=replace(WHOLE, recipe=Side.GUARD))
    world = World(rules=replace(WHOLE, recipe=recipe), vessel=world.vessel)
    world.tick(3)
    assert world.seen[-1].state == "running"
    actions = ActionSet(ADJUSTED.commands, "running", (POUR, end))
    world.ask(world.request(actions=actions, path=("adjust", "empty", "end")))
    world.tick(2)
    world.vessel.wire.clear()
    through(world, Mode.OBSERVE)
    world.tick(6, L=9.5)
    assert bool(withdrawn(world)) is told and world.sent == ([] if told else [POUR.commands])


def test_a_guard_that_has_no_recipe_takes_none_up() -> None:
    world = released()
    bare = killed(world, rules=replace(WHOLE, nominal=()))
    bare.tick(1)
    bare.vessel.wire.clear()
    through(bare, Mode.OBSERVE)
    bare.tick(6, L=9.5)
    assert bare.sent == [] and len(withdrawn(bare)) == 1


def test_a_mode_and_back_within_one_tick_is_no_way_around_it() -> None:
    world = released()
    world.order(Verb.MODE, Mode.OBSERVE.value)
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(6, L=9.5)
    assert GENTLE.commands not in world.sent


def test_from_one_mode_that_writes_to_another_nothing_is_withdrawn() -> None:
    world = released()
    world.order(Verb.MODE, Mode.APPROVE.value)
    world.tick(4, L=9.5)
    assert world.sent == [GENTLE.commands] and withdrawn(world) == []


def test_what_a_start_leads_to_is_the_recipe_and_stays_so_without_a_word() -> None:
    world = released()
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick(3)
    for verb, subject in ((Verb.RESET, ""), (Verb.MODE, "closed-loop")):
        world.order(verb, subject, reason="over")
        world.tick(1, L=3.0)
    world.order(Verb.START, "restart")
    world.tick(3)
    assert world.guard.carries
    through(world, Mode.OBSERVE)
    assert withdrawn(world) == [] and not world.guard.carries
    world.tick(5, L=6.0)
    assert world.seen[-1].state == "running"


def test_a_step_that_is_owed_is_not_sent_again_after_a_mode_and_back_within_one_tick() -> None:
    world = released()
    world.vessel.ignores = True
    world.tick(7, L=9.5)
    assert len(world.sent) == 3 and world.seen[-1].state == "emptying"
    world.vessel.ignores = False
    world.order(Verb.MODE, Mode.OBSERVE.value)
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(20)
    assert len(world.sent) == 3 and not world.guard.carries
    (cause,) = withdrawn(world)
    assert "'empty'" in cause


@pytest.mark.parametrize("lives", [1, 2])
def test_a_kill_after_that_brings_nothing_back(lives: int) -> None:
    for seconds, owed in ((3, False), (20, True)):
        world = released()
        world.vessel.ignores = owed
        world.tick(7, L=9.5 if owed else 8.0)
        world.vessel.ignores = False
        world.vessel.wire.clear()
        world.order(Verb.MODE, Mode.OBSERVE.value)
        world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
        world.tick(1)
        for _ in range(lives):
            world = killed(world)
            world.tick(1)
        world.tick(seconds, L=9.5)
        assert GENTLE.commands not in world.sent


def test_a_guard_that_stands_in_observe_after_a_restart_has_left_what_was_released() -> None:
    world = killed(released(), goes_on=False)
    assert world.guard.mode is Mode.OBSERVE
    world.tick(2)
    assert withdrawn(world) == [
        "the guard stands in 'observe' after a restart: 'empty' waited to be written, and will not be"
    ]
    assert world.journal.of(ModeEntered)[-1].mode == "observe"
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(6, L=9.5)
    assert GENTLE.commands not in world.sent


def test_a_restart_in_the_mode_that_writes_goes_on() -> None:
    world = killed(released())
    world.tick(4, L=9.5)
    assert world.sent == [GENTLE.commands] and withdrawn(world) == []


@pytest.mark.parametrize("soon", [False, True])
def test_a_request_that_was_in_flight_at_the_kill_leaves_no_step_behind_in_observe(soon: bool) -> None:
    """Also where somebody orders a mode that writes before the plant was read."""
    world = running(rules=WHOLE)
    world.vessel.silent = True
    world.ask(world.request(actions=GENTLY, path=("adjust", "empty")))
    world.tick(1)
    world.vessel.silent = False
    world.vessel.wire.clear()
    world = killed(world, goes_on=False)
    if soon:
        world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
        world.silent(2)
    world.tick(2)
    assert world.seen[-1].state == "running" and world.vessel.accepted["F.sp"] == 0.02
    if not soon:
        world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(6, L=9.5)
    assert GENTLE.commands not in world.sent
    assert withdrawn(world) == ["nobody wrote after a restart: 'empty' waited to be written, and will not be"]


def test_wherever_the_journal_ends_after_the_order_what_was_released_stays_withdrawn() -> None:
    world = released()
    before = len(world.journal.events)
    world.order(Verb.MODE, Mode.OBSERVE.value)
    world.tick(3)
    for upto in range(before, len(world.journal.events) + 1):
        again = killed(world, upto)
        again.tick(1)
        ordered = any(isinstance(e, ModeEntered) and e.mode == "observe" for e, _ in world.journal.events[before:upto])
        assert (again.guard.mode is Mode.OBSERVE) is ordered
        if ordered:
            again.order(Verb.MODE, Mode.CLOSED_LOOP.value)
            again.vessel.wire.clear()
            again.tick(5, L=9.5)
            assert GENTLE.commands not in again.sent
            again.vessel.accepted.update({"F.sp": 0.02, "V.man": None})
            again.vessel.values["L"] = 8.0


@pytest.mark.parametrize("dies", [False, True])
def test_a_ramp_of_the_guard_stands_and_does_not_go_on(dies: bool) -> None:
    world = running(rules=GUARDED)
    world.tick(12)
    world.ask(actions=ActionSet((Command("T.sp", 300.0, 0.5),), "running"))
    world.tick(6)
    world.order(Verb.MODE, Mode.OBSERVE.value)
    world.tick(2)
    stood = world.vessel.accepted["T.sp"]
    assert stood is not None and 300.0 < stood < 310.0 and statuses(world)[-1] == "withdrawn"
    if dies:
        world = killed(world, rules=GUARDED)
        world.tick(1)
    world.vessel.wire.clear()
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(20)
    assert values(world, "T.sp") == [] and world.vessel.accepted["T.sp"] == stood
    assert world.guard.out_of_service == frozenset()


@pytest.mark.parametrize("dies", [False, True])
def test_a_ramp_of_a_released_step_stands_as_well(dies: bool) -> None:
    rules = replace(GUARDED, nominal=WHOLE.nominal, recipe=Side.GUARD)
    slow = Step(MACHINE.transitions[2], (Command("F.sp", 0.01, 0.0005),))
    world = released(ActionSet((Command("F.sp", 0.025, 0.005),), "running", (slow,)), rules, ramp_s=12)
    world.tick(6, L=9.5)
    stood = world.vessel.accepted["F.sp"]
    assert stood is not None and 0.01 < stood < 0.025
    world.order(Verb.MODE, Mode.OBSERVE.value)
    if not dies:
        world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(1)
    if dies:
        world = killed(world, rules=rules)
        world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
        world.tick(1)
    stood, writes = world.vessel.accepted["F.sp"], len(world.journal.of(WriteIntended))
    world.tick(15)
    assert world.vessel.accepted["F.sp"] == stood and len(world.journal.of(WriteIntended)) == writes
    assert {w.cause for w in world.journal.of(WriteIntended)} == {Cause.SEQUENCE, Cause.REQUEST}


def test_the_recipe_that_is_taken_up_again_is_under_its_permissives() -> None:
    shallow = limit("PRM-VALVE", LimitKind.PERMISSIVE, "V.man <= 0.6 or T <= 309")
    world = released(rules=replace(WHOLE, limits=replace(LIMITS, limits=(*LIMITS.limits, shallow))))
    through(world, Mode.OBSERVE)
    world.tick(12, T=311.0, Tx=311.0)
    world.tick(4, L=9.5)
    assert world.sent == [] and "PRM-VALVE" in (world.seen[-1].refused or "")
    world.tick(12, T=305.0, Tx=305.0)
    assert world.sent == [POUR.commands]
