"""Where the plant stands after a lapse, a reset, and under a person's hand: the guard says where it cannot tell."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.events.guard import SequenceLoaded, StartUpBegan
from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.trips import LatchReset
from homeostat.domain.mode import Mode, Side, Verb
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.plant.state_machine import SetpointRange, StateMachine
from homeostat.domain.recovery import Command, Step
from tests.guard.test_lapse import Sheds, causes
from tests.guard.vessel import BEGIN, MACHINE, POUR, RULES, World, decided, state


def held(name: str, risk: int = 0, feed: float = 0.0, **rest: object) -> object:
    """A state of rest that is told from no other one by its targets."""
    made = state(name, SetpointRange("F.sp", feed, feed, feed), SetpointRange("X.cmd", 0.0, 0.0, 0.0), **rest)  # type: ignore[arg-type]
    return replace(made, risk=risk)


def vessel(*more: object, ways: tuple[object, ...] = (), leave_out: tuple[str, ...] = ()) -> GuardRules:
    """The vessel's rules with further states and transitions."""
    states = (*(s for s in MACHINE.states if s.name not in leave_out), *more)
    kept = (t for t in MACHINE.transitions if not {t.source, t.target} & set(leave_out))
    machine = StateMachine("vessel", states, (*kept, *ways))  # type: ignore[arg-type]
    return replace(RULES, machine=machine, nominal=(BEGIN,))


def reset(rules: GuardRules, **accepted: float | None) -> World:
    """After a fallback that stands a person moves targets by hand and resets the latch."""
    world = World(rules=rules)
    world.tick(4)
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick(3)
    moved = {tag.replace("_", "."): v for tag, v in accepted.items()}
    world.vessel.accepted.update(moved)
    world.tick(1, L=3.0)
    for tag in moved:
        world.order(Verb.IN_SERVICE, tag)
    world.tick(1)
    world.order(Verb.RESET, reason="seen")
    world.tick(1)
    return world


def said(world: World, alarm: str = "position") -> list[str]:
    return [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == alarm]


def test_the_state_in_which_the_fallback_left_the_plant_counts_where_it_fits() -> None:
    world = reset(vessel(held("closed", risk=9)))
    assert world.journal.of(LatchReset)[-1].state == "shut" == world.seen[-1].state
    assert world.journal.of(LatchReset)[-1].candidates == () and said(world) == []


def test_else_a_state_that_follows_on_it_is_taken_before_any_other() -> None:
    ways = (decided("clean", "shut", "closed"),)
    world = reset(vessel(held("other", risk=9), held("closed"), ways=ways, leave_out=("rest",)), V_man=None)
    assert world.seen[-1].state == "closed" and said(world) == []


@pytest.mark.parametrize("order", [1, -1])
def test_where_nobody_can_tell_the_most_cautious_one_is_taken_and_all_are_named(order: int) -> None:
    """A state of start-up least, one from which something follows by itself before it, then the one of higher risk."""
    starts = replace(state("waiting", SetpointRange("F.sp", 0.0, 0.05, 0.0), initial=True), risk=99)
    flows = replace(state("running", SetpointRange("F.sp", 0.0, 0.05, 0.03), target=True), risk=50)
    states = (starts, flows, held("safe", risk=2), held("safer", risk=3), *MACHINE.states[2:])
    kept = tuple(t for t in MACHINE.transitions if t.name != "restart")
    machine = StateMachine("vessel", states[::order], kept)  # type: ignore[arg-type]
    world = reset(replace(RULES, machine=machine), V_man=None)
    (event,) = world.journal.of(LatchReset)
    assert event.state == "safer" == world.seen[-1].state
    assert set(event.candidates) == {"waiting", "running", "safe", "safer", "rest"}
    (cause,) = said(world)
    assert all(repr(name) in cause for name in event.candidates) and "'safer' is taken" in cause


def test_of_a_start_up_and_a_state_that_goes_on_by_itself_the_second_is_taken() -> None:
    flows = state("running", SetpointRange("F.sp", 0.0, 0.05, 0.03), SetpointRange("X.cmd", 0.0, 1.0, 1.0), target=True)
    starts = state(
        "waiting", SetpointRange("F.sp", 0.0, 0.05, 0.0), SetpointRange("X.cmd", 0.0, 1.0, 1.0), initial=True
    )
    states = (starts, flows, *(s for s in MACHINE.states[2:] if s.name != "rest"))
    kept = tuple(t for t in MACHINE.transitions if t.name not in ("restart", "end"))
    world = reset(replace(RULES, machine=StateMachine("vessel", states, kept)), V_man=None)
    assert world.journal.of(LatchReset)[-1].candidates == ("waiting", "running")
    assert world.seen[-1].state == "running" and len(world.journal.of(StartUpBegan)) == 1
    world.tick(15, T=316.0, Tx=316.0)
    assert "trip:LIM-HOT" in world.alarms


def lapsed(rules: GuardRules) -> World:
    """The lease is lost while the vessel is emptied; its valve goes to automatic, which that state does not admit."""
    more = replace(rules, nominal=(BEGIN, POUR, Step(rules.machine.transitions[3], (Command("F.sp", 0.0, 0.005),))))
    world = World(vessel=Sheds(), rules=more)
    world.tick(4)
    world.tick(4, L=9.5)
    world.tick(2, L=3.0)
    assert world.seen[-1].state == "emptying" and isinstance(world.vessel, Sheds)
    world.vessel.tells = True
    world.vessel.shed()
    world.tick(3)
    return world


def test_after_a_lapse_a_state_that_follows_is_taken_before_one_of_start_up() -> None:
    world = lapsed(RULES)
    assert world.seen[-1].state == "rest" and world.journal.of(SequenceLoaded)[-1].steps == ()
    assert [c for c in causes(world, "local") if "has stopped" in c and "fit" not in c]


def test_after_a_lapse_that_leaves_it_open_where_the_plant_stands_every_state_is_named() -> None:
    ends = state("rest", SetpointRange("F.sp", 0.0, 0.0, 0.0), target=True, settled="L <= 1")
    vent = replace(state("vent", SetpointRange("F.sp", 0.0, 0.0, 0.0), target=True), risk=7)
    states = (*(ends if s.name == "rest" else s for s in MACHINE.states), vent)
    world = lapsed(replace(RULES, machine=replace(MACHINE, states=states)))
    assert world.seen[-1].state == "vent" and world.sent[-1] == POUR.commands
    (cause,) = causes(world, "local")
    assert "'waiting'" in cause and "'running'" in cause and "'vent' is taken" in cause and "has stopped" in cause


PLANTS = replace(RULES, recipe=Side.PLANT, nominal=(BEGIN, POUR))


@pytest.mark.parametrize("mode", [Mode.OBSERVE, Mode.CLOSED_LOOP])
def test_a_hand_outside_the_range_keeps_no_state_from_being_recognised(mode: Mode) -> None:
    begun = World(mode=mode, rules=PLANTS)
    begun.tick(3, L=4.0)
    begun.vessel.accepted["T.sp"] = 320.0
    begun.tick(2)
    assert begun.guard.out_of_service == {"T.sp"} and begun.seen[-1].state == "waiting"
    begun.vessel.accepted["F.sp"] = 0.03
    begun.tick(2, L=6.0)
    assert begun.seen[-1].state == "running", "the rest of the recipe's targets says so"
    begun.order(Verb.IN_SERVICE, "T.sp")
    begun.tick(1)
    assert begun.seen[-1].state == "running"


def test_a_reset_finds_the_plant_although_a_person_holds_a_tag() -> None:
    world = World(rules=RULES)
    world.tick(4)
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick(3)
    world.vessel.accepted.update({"T.sp": 320.0, "F.sp": 0.02, "V.man": 0.5, "X.cmd": 1.0})
    world.tick(1, L=3.0)
    for tag in ("F.sp", "V.man", "X.cmd"):
        world.order(Verb.IN_SERVICE, tag)
    world.tick(1)
    assert world.guard.out_of_service == {"T.sp"}
    world.order(Verb.RESET, reason="seen")
    world.tick(1)
    assert world.journal.of(LatchReset)[-1].state == "waiting", "it follows on 'shut'"


@pytest.mark.parametrize(("off", "same"), [(0.0004, True), (0.0006, False), (-0.0004, True), (-0.0006, False)])
def test_a_target_that_the_plant_rounds_is_compared_within_the_tolerance_of_its_table(off: float, same: bool) -> None:
    fed = state("running", SetpointRange("F.sp", 0.03, 0.03, 0.03), SetpointRange("X.cmd", 1.0, 1.0, 1.0), target=True)
    machine = replace(MACHINE, states=tuple(fed if s.name == "running" else s for s in MACHINE.states))
    world = World(mode=Mode.OBSERVE, rules=replace(RULES, machine=machine))
    world.tick(2, L=4.0)
    world.vessel.accepted["F.sp"] = 0.03 + off
    world.tick(1, L=6.0)
    assert (world.seen[-1].state == "running") is same
    assert (world.guard.out_of_service == frozenset()) is same


def test_targets_that_fit_no_state_break_nothing() -> None:
    world = World(mode=Mode.OBSERVE, rules=PLANTS)
    world.tick(3, L=4.0)
    world.vessel.accepted.update({"F.sp": 0.06, "X.cmd": 0.5})
    world.tick(3)
    assert not [e for e in world.journal.of(AlarmRaised) if e.alarm.startswith("guard:")]
    assert world.seen[-1].state == "waiting" and world.guard.out_of_service == {"F.sp", "X.cmd"}
