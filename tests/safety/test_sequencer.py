"""Attacks on the sequencer: a step waits for its guard and its permissives, and nothing but what was loaded is sent."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.plant.state_machine import State, StateMachine, Transition
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath, Step
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.sequence.sequencer import Sequencer, nominal_route, under_way, what_follows
from homeostat.stl.formula import parse
from tests.safety.world import (
    ADJUST,
    BATCH,
    DRAIN,
    EMPTY,
    END,
    FEED,
    GOOD,
    LIMITS,
    MACHINE,
    NO_LIMITS,
    POUR,
    REST,
    START,
    TAGS,
    awaited,
    reading,
    rule,
    sequencer,
)

FULL, LOW = 9.5, 0.5
"""Levels at which the second step may be taken and at which the third one may [L]."""
GO = Step(START, (Command("F.sp", 0.03, 0.005),))
"""The vessel's start, as part of a nominal route."""


def loaded(limits: Limits = LIMITS, actions: ActionSet = BATCH) -> Sequencer:
    """A sequencer that has just been given ``actions``."""
    subject = sequencer(limits)
    subject.load(actions, 0.0)
    return subject


# --- guards -----------------------------------------------------------------------------------------------------


def test_at_the_start_it_stands_in_the_initial_state_and_waits() -> None:
    subject = sequencer()
    assert subject.state == "waiting" and subject.refused is None and subject.drain() == ()
    assert subject.sample(reading()) == () and subject.way() is None
    assert subject.rest() == ActionSet((), "waiting") and subject.drain() == ()


def test_a_step_waits_until_its_guard_holds_and_is_taken_once() -> None:
    subject = loaded()
    assert [subject.sample(reading(float(k), L=level)) for k, level in enumerate((8.0, 8.999, 9.0, 9.5))] == [
        (), (), POUR.commands, (),
    ]  # fmt: skip
    assert subject.state == "emptying"


def test_every_condition_of_a_guard_counts() -> None:
    subject = loaded()
    assert subject.sample(reading(L=FULL, T=310.5)) == () and subject.state == "running" and subject.refused is None
    assert subject.sample(reading(L=FULL, T=310.0)) == POUR.commands


def test_steps_are_taken_in_their_order_one_per_look() -> None:
    subject = loaded()
    assert subject.sample(reading(L=LOW)) == () and subject.state == "running", "the last guard holds, not the next"
    assert subject.sample(reading(L=FULL)) == POUR.commands
    assert subject.sample(reading(L=LOW)) == () and subject.state == "still", "a step may send nothing"
    assert subject.sample(reading(L=FULL)) == () and subject.way() is None


def test_two_guards_that_hold_together_take_two_looks() -> None:
    both = replace(BATCH, then=(replace(POUR, transition=replace(EMPTY, guard=parse("true"))), END))
    subject = loaded(actions=both)
    assert subject.sample(reading(L=LOW)) == POUR.commands and subject.state == "emptying"
    assert subject.sample(reading(L=LOW)) == () and subject.state == "still"


WILD = [math.nan, math.inf, -math.inf]


@pytest.mark.parametrize("tag", ["L", "T"])
@pytest.mark.parametrize("value", WILD)
def test_a_reading_that_says_nothing_fires_no_guard(tag: str, value: float) -> None:
    subject = loaded(NO_LIMITS)
    assert subject.sample(reading(**{"L": FULL, tag: value})) == ()
    assert subject.state == "running" and subject.refused is None
    assert subject.sample(reading(L=FULL)) == POUR.commands, "it goes on as soon as there is a reading"


@pytest.mark.parametrize("tag", ["L", "T"])
def test_a_reading_that_is_marked_or_missing_fires_no_guard(tag: str) -> None:
    subject = loaded(NO_LIMITS)
    assert subject.sample(reading(bad=frozenset({tag}), L=FULL)) == ()
    values = {t: v for t, v in (GOOD | {"L": FULL}).items() if t != tag}
    assert subject.sample(Snapshot(101.0, values)) == () and subject.state == "running"


@pytest.mark.parametrize("text", ["L <= 9 or T <= 310", "L >= 9 implies T <= 310"])
def test_a_guard_that_the_other_readings_decide_needs_no_more(text: str) -> None:
    step = replace(POUR, transition=replace(EMPTY, guard=parse(text, TAGS)))
    for value in WILD:
        subject = loaded(NO_LIMITS, replace(BATCH, then=(step,)))
        assert subject.sample(reading(L=value)) == POUR.commands


@pytest.mark.parametrize("text", ["L <= 9 or T >= 310", "not (L <= 9)", "L >= 9 implies T >= 310", "L >= 9 or L <= 9"])
def test_no_way_of_writing_a_guard_makes_up_for_a_missing_reading(text: str) -> None:
    step = replace(POUR, transition=replace(EMPTY, guard=parse(text, TAGS)))
    for value in WILD:
        subject = loaded(NO_LIMITS, replace(BATCH, then=(step,)))
        assert subject.sample(reading(L=value)) == () and subject.state == "running"


def test_a_guard_that_reads_nothing_needs_no_reading() -> None:
    step = replace(POUR, transition=replace(EMPTY, guard=parse("true")))
    assert loaded(NO_LIMITS, replace(BATCH, then=(step,))).sample(Snapshot(100.0, {})) == POUR.commands


def test_tags_that_the_guard_does_not_read_may_say_anything() -> None:
    assert loaded(NO_LIMITS).sample(reading(L=FULL, F=math.nan, V_man=math.inf)) == POUR.commands


# --- permissives ------------------------------------------------------------------------------------------------


def test_a_permissive_holds_a_step_back_and_says_why() -> None:
    subject = loaded()
    assert subject.sample(reading(L=11.5)) == () and subject.state == "running"
    assert subject.refused == "What PRM-FEED protects: 'L <= 11' is violated by 0.5 L at 0 s (PRM-FEED)"
    assert subject.rest().then == BATCH.then and subject.rest().commands == ()
    assert subject.sample(reading(L=11.0)) == POUR.commands and subject.refused is None


def test_the_reason_is_gone_with_what_was_in_the_way() -> None:
    subject = loaded()
    subject.sample(reading(L=11.5))
    subject.sample(reading(L=8.0))
    assert subject.refused is None, "now it is the guard that does not hold"
    subject = loaded(actions=replace(BATCH, then=(POUR,)))
    subject.sample(reading(L=11.5))
    subject.load(DRAIN.actions, 0.0)
    subject.sample(reading(L=11.5))
    assert subject.refused is None, "nothing waits"


def test_the_first_permissive_that_is_violated_is_named_wherever_it_stands() -> None:
    cool = rule("PRM-COOL", LimitKind.PERMISSIVE, "T <= 300")
    for limits in (Limits((FEED, cool), ()), Limits((cool, FEED), ())):
        subject = loaded(limits)
        assert subject.sample(reading(L=FULL, T=305.0)) == ()
        assert subject.refused is not None and "PRM-COOL" in subject.refused


def test_a_permissive_is_judged_with_what_the_step_commands() -> None:
    closed = Limits((rule("PRM-CLOSED", LimitKind.PERMISSIVE, "F.sp <= 0.001"),), ())
    assert loaded(closed).sample(reading(L=FULL, F_sp=0.03)) == POUR.commands
    opened = Limits((rule("PRM-OPEN", LimitKind.PERMISSIVE, "F.sp >= 0.02"),), ())
    subject = loaded(opened)
    assert subject.sample(reading(L=FULL, F_sp=0.03)) == () and "PRM-OPEN" in str(subject.refused)


def test_a_permissive_without_reading_holds_a_step_back() -> None:
    blind = Limits((rule("PRM-FLOW", LimitKind.PERMISSIVE, "F <= 1"),), ())
    subject = loaded(blind)
    assert subject.sample(reading(L=FULL, F=math.nan)) == ()
    assert subject.refused is not None and "PRM-FLOW" in subject.refused and "'F'" in subject.refused
    assert subject.sample(reading(L=FULL)) == POUR.commands


def test_only_permissives_hold_a_step_back() -> None:
    """Trip limits and envelopes are watched by the gate; a batch that is out of its envelope may still go on."""
    soft = Limits((rule("LIM-X", LimitKind.ENVELOPE, "T >= 400"), rule("LIM-Y", LimitKind.TRIP_LIMIT, "T >= 400")), ())
    assert loaded(soft).sample(reading(L=FULL)) == POUR.commands


# --- what is loaded, what is left -------------------------------------------------------------------------------


def test_loading_replaces_what_waits() -> None:
    subject = loaded()
    subject.load(DRAIN.actions, 0.0)
    assert subject.state == "still" and subject.way() is None
    assert subject.sample(reading(L=FULL)) == () and subject.rest() == ActionSet((), "still")


def test_loading_in_the_middle_goes_on_with_the_new_steps() -> None:
    subject = loaded()
    subject.sample(reading(L=FULL))
    again = replace(BATCH, then=(replace(POUR, commands=(Command("F.sp", 0.01, 0.005),)),))
    subject.load(again, 0.0)
    assert subject.state == "running" and subject.sample(reading(L=FULL)) == again.then[0].commands
    assert subject.state == "emptying" and subject.way() is None


def test_the_nominal_route_is_followed_until_something_is_loaded() -> None:
    subject = sequencer(LIMITS, GO, POUR)
    assert subject.sample(reading(L=4.0)) == () and subject.state == "waiting"
    assert subject.sample(reading(L=5.0)) == GO.commands and subject.state == "running"
    subject.load(ActionSet((), "running"), 0.0)
    assert subject.sample(reading(L=FULL)) == ()


def test_what_is_left_shrinks_step_by_step() -> None:
    subject = loaded()
    subject.sample(reading(L=8.0))
    assert subject.rest() == ActionSet((), "running", BATCH.then)
    assert subject.way() == RecoveryPath(MACHINE, (EMPTY, REST))
    subject.sample(reading(L=FULL))
    assert subject.rest() == ActionSet(POUR.commands, "emptying", (END,)), "no snapshot shows these commands yet"
    assert subject.way() == RecoveryPath(MACHINE, (REST,))
    subject.sample(reading(L=8.0))
    assert subject.rest() == ActionSet((), "emptying", (END,)), "the last snapshot shows them"
    subject.sample(reading(L=LOW))
    assert subject.rest() == ActionSet((), "still") and subject.way() is None


RAMP = Command("F.sp", 0.0, 0.005)
"""A ramp down that takes several seconds."""


@pytest.mark.parametrize(
    ("sent", "before", "now", "goes_on"),
    [
        (RAMP, 0.03, 0.025, True),
        (replace(RAMP, value=0.05), 0.03, 0.035, True),
        (RAMP, 0.03, 0.03, False),
        (RAMP, 0.02, 0.025, False),
        (RAMP, 0.005, 0.0, False),
        (replace(RAMP, value=0.01), 0.04, 0.01, False),
        (replace(RAMP, value=0.05), 0.035, 0.03, False),
        (RAMP, 0.03, math.nan, False),
        (RAMP, math.nan, 0.03, False),
        (replace(RAMP, rate=None), 0.03, 0.025, False),
        (replace(RAMP, value=None), 0.03, 0.025, False),
    ],
    ids=[
        "down",
        "up",
        "stands",
        "somebody else's",
        "there",
        "there above zero",
        "away",
        "blind",
        "was blind",
        "step",
        "automatic",
    ],
)
def test_a_ramp_that_goes_on_is_part_of_what_is_left(sent: Command, before: float, now: float, goes_on: bool) -> None:
    seen = reading(100.0, **{"F.sp": before}), reading(101.0, **{"F.sp": now})
    assert under_way((sent,), seen[1], seen[0]) == ((sent,) if goes_on else ())
    assert under_way((sent,), seen[1], None) == (), "one look tells no movement"


def test_a_ramp_is_left_to_do_until_it_arrives() -> None:
    """Idling means that the pump runs down, not that it stays at the speed it passes through just now."""
    subject = sequencer(LIMITS)
    subject.sample(reading(0.0, **{"F.sp": 0.03}))
    subject.load(ActionSet((RAMP,), "running"), 0.0)
    assert subject.rest().commands == (RAMP,), "no snapshot shows it yet"
    left = []
    for k, value in enumerate((0.025, 0.015, 0.0, 0.0), 1):
        subject.sample(reading(float(k), **{"F.sp": value}))
        left.append(subject.rest().commands)
    assert left == [(RAMP,), (RAMP,), (), ()]


def test_states_are_told_once_each_with_the_time_of_the_look() -> None:
    subject = sequencer(LIMITS, GO)
    subject.load(ActionSet((), "running"), 0.0)
    assert subject.drain() == (("running", 0.0),), "before the first look nothing has happened yet"
    subject = sequencer(LIMITS, GO)
    subject.sample(reading(100.0, L=8.0))
    subject.sample(reading(101.0))
    subject.load(BATCH, 0.0)
    subject.sample(reading(102.0, L=FULL))
    assert subject.drain() == (("running", 100.0), ("emptying", 102.0)), "a release that stays in the state is no entry"
    assert subject.drain() == ()
    subject.sample(reading(103.0, L=LOW))
    assert subject.drain() == (("still", 103.0),)


LEVELS = st.floats(0.0, 14.0) | st.sampled_from([math.nan, math.inf, -math.inf, 9.0, 1.0, 11.0])
SAMPLES = st.lists(st.tuples(LEVELS, st.floats(300.0, 320.0), st.booleans()), max_size=12)


@given(SAMPLES)
def test_what_is_sent_is_what_was_loaded_step_by_step_each_behind_its_guard(
    seen: list[tuple[float, float, bool]],
) -> None:
    subject, waiting = loaded(), [POUR, END]
    for k, (level, hot, bad) in enumerate(seen):
        snapshot = reading(float(k), frozenset({"L"}) if bad else frozenset(), L=level, T=hot)
        before = subject.state
        sent = subject.sample(snapshot)
        legible = math.isfinite(level) and not bad
        guard = {"running": legible and level >= 9.0 and hot <= 310.0, "emptying": legible and level <= 1.0}
        fires = bool(waiting) and guard[before] and level <= 11.0
        assert (subject.refused is not None) == (bool(waiting) and guard[before] and level > 11.0)
        if fires:
            step = waiting.pop(0)
            assert sent == step.commands and subject.state == step.target
        else:
            assert sent == () and subject.state == before
        assert subject.rest() == ActionSet(sent, subject.state, tuple(waiting))
        way = subject.way()
        assert (way.transitions if way else ()) == tuple(s.transition for s in waiting)


# --- with the gate ----------------------------------------------------------------------------------------------


# --- the nominal route ------------------------------------------------------------------------------------------


def state(name: str, risk: int = 0, initial: bool = False) -> State:
    return State(name, name, risk, initial, True, parse("true"), frozenset(), ())


def route(states: tuple[State, ...], *transitions: Transition) -> tuple[Step, ...]:
    commands = {s.name: (Command(f"{s.name}.sp", float(k), None),) for k, s in enumerate(states)}
    return nominal_route(StateMachine("m", states, transitions), commands)


A, B, C = state("a", initial=True), state("b"), state("c")
A_B, B_C, C_A = awaited("t", "a", "b", "true"), awaited("u", "b", "c", "true"), awaited("v", "c", "a", "true")


def test_the_nominal_route_is_what_follows_by_itself() -> None:
    assert route((A, B, C), A_B, B_C) == (
        Step(A_B, (Command("b.sp", 1.0, None),)),
        Step(B_C, (Command("c.sp", 2.0, None),)),
    )


def test_the_nominal_route_ends_where_somebody_must_decide() -> None:
    decided = Transition("u", "b", "c", "fault_diagnosed", parse("true"))
    assert [s.target for s in route((A, B, C), A_B, decided)] == ["b"]
    assert route((A, B), replace(A_B, on_decision=True)) == ()
    assert route((A,)) == ()


def test_the_nominal_route_returns_nowhere() -> None:
    assert [s.target for s in route((A, B, C), A_B, B_C, C_A)] == ["b", "c"]
    assert route((A,), awaited("t", "a", "a", "true")) == ()
    back = awaited("w", "c", "b", "true")
    assert [s.target for s in route((A, B, C), A_B, B_C, back)] == ["b", "c"]


@pytest.mark.parametrize("order", [1, -1])
def test_the_nominal_route_takes_the_least_risky_way(order: int) -> None:
    risky, safe = state("b", risk=2), state("c", risk=1)
    ways = (A_B, awaited("u", "a", "c", "true"))[::order]
    assert [s.target for s in route((A, risky, safe), *ways)] == ["c"]


def test_of_equal_ways_the_first_is_nominal() -> None:
    ways = (awaited("one", "a", "b", "true"), awaited("two", "a", "b", "L >= 5"))
    for first, second in (ways, ways[::-1]):
        assert route((A, B), first, second)[0].transition == first


def test_the_vessel_runs_and_is_emptied_by_itself() -> None:
    commands = {s.name: (Command(f"{s.name}.sp", 0.0, None),) for s in MACHINE.states}
    assert [s.transition for s in nominal_route(MACHINE, commands)] == [START, EMPTY, REST]
    assert ADJUST not in [s.transition for s in nominal_route(MACHINE, commands)]


def test_what_follows_begins_anywhere() -> None:
    commands = {s.name: (Command(f"{s.name}.sp", 0.0, None),) for s in MACHINE.states}
    assert [s.transition for s in what_follows(MACHINE, "running", commands)] == [EMPTY, REST]
    assert what_follows(MACHINE, "still", commands) == ()
