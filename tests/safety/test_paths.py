"""Paths through the state machine: what is enumerated is admissible, and what is not in the machine cannot be built."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.domain.plant.state_machine import SetpointRange, State, StateMachine, Transition
from homeostat.domain.plant.tag import Range, Role, Tag
from homeostat.domain.recovery import RecoveryPath
from homeostat.stl.formula import parse
from tests.plants.cstr.reactor import plant

EVENTS = ("fault", "trip")
COMPONENTS = ("pump", "valve", "vessel")
GUARDS = tuple(parse(text) for text in ("true", "false", "x >= 0.5", "x <= 0.5 and y >= 0.5"))
TRUE = GUARDS[0]
BLOCKED = st.frozensets(st.sampled_from(COMPONENTS))
VALUES = st.fixed_dictionaries({"x": st.floats(0.0, 1.0), "y": st.floats(0.0, 1.0)})


def state(
    name: str, risk: int = 0, initial: bool = False, target: bool = True, requires: frozenset[str] = frozenset()
) -> State:
    return State(name, name, risk, initial, target, TRUE, requires, ())


@st.composite
def machines(draw: st.DrawFn) -> StateMachine:
    count = draw(st.integers(1, 5))
    names = [f"s{k}" for k in range(count)]
    states = tuple(
        state(
            name, draw(st.integers(0, 3)), k == 0, draw(st.booleans()), draw(st.frozensets(st.sampled_from(COMPONENTS)))
        )
        for k, name in enumerate(names)
    )
    ends = draw(st.lists(st.tuples(st.sampled_from(names), st.sampled_from(names)), max_size=10))
    transitions = tuple(
        Transition(
            f"t{k}", source, target, draw(st.sampled_from(EVENTS)), draw(st.sampled_from(GUARDS)), draw(st.booleans())
        )
        for k, (source, target) in enumerate(ends)
    )
    return StateMachine("drawn", states, transitions)


def admissible(
    machine: StateMachine, path: tuple[Transition, ...], start: str, values: dict[str, float], blocked: frozenset[str],
    longest: int, unreliable: frozenset[str] = frozenset(),
) -> bool:  # fmt: skip
    """The definition, written down a second time."""
    states = [start, *(t.target for t in path)]
    joined = all(t.source == before for t, before in zip(path, states, strict=False))
    # A first step may stay where the plant is: new setpoints in the same state.
    visited = states[1:] if states[1] == start else states
    first_awaited = next((k for k, t in enumerate(path) if not t.on_decision), len(path))
    decisions, later = path[:first_awaited], path[first_awaited:]
    return (
        joined
        and len(set(visited)) == len(visited)
        and len(decisions) <= longest
        and all(t.event == "fault" and t.guard.holds(values) for t in decisions)
        and all(not t.on_decision and preferred(machine, t, unreliable) for t in later)
        and all(not machine.state(t.target).requires & blocked for t in path)
        and machine.state(states[-1]).recovery_target
    )


def preferred(machine: StateMachine, transition: Transition, unreliable: frozenset[str]) -> bool:
    """Whether it is the first of those that are awaited between its states and that can be relied on."""
    ends = (transition.source, transition.target)
    alike = [t for t in machine.transitions if not t.on_decision and (t.source, t.target) == ends]
    return transition == next((t for t in alike if not t.guard.tags & unreliable), None)


def walks(machine: StateMachine, start: str, before: tuple[Transition, ...] = ()) -> Iterator[tuple[Transition, ...]]:
    """Every way through the machine that visits no state twice, but may stay at the start with its first step."""
    been = [start, *(t.target for t in before)]
    for t in machine.transitions:
        if t.source == been[-1] and (t.target not in been or (not before and t.target == start)):
            yield (*before, t)
            yield from walks(machine, start, (*before, t))


@settings(max_examples=200)
@given(machines(), VALUES, BLOCKED, st.integers(1, 3), st.frozensets(st.sampled_from(["x", "y"])))
def test_exactly_the_admissible_paths_are_enumerated(
    machine: StateMachine, values: dict[str, float], blocked: frozenset[str], longest: int, unreliable: frozenset[str]
) -> None:
    start = machine.initial.name
    found = machine.paths(start, values, "fault", blocked, longest, unreliable)
    every = {
        path for path in walks(machine, start) if admissible(machine, path, start, values, blocked, longest, unreliable)
    }
    assert set(found) == every and len(found) == len(every)
    ranks = [(max(machine.state(t.target).risk for t in path), len(path)) for path in found]
    assert ranks == sorted(ranks), "least risk first, then the shortest"
    for path in found:
        assert RecoveryPath(machine, path).target == path[-1].target
        assert RecoveryPath(machine, path).decisions == tuple(t for t in path if t.on_decision)


def names(paths: tuple[tuple[Transition, ...], ...]) -> list[str]:
    return [" > ".join(t.name for t in path) for path in paths]


def by_itself(name: str, source: str, target: str, guard: str = "true") -> Transition:
    return Transition(name, source, target, "", parse(guard), on_decision=False)


def test_what_follows_by_itself_is_on_the_path_whatever_its_guard_says_now() -> None:
    machine = StateMachine(
        "m",
        (state("a", initial=True), state("b", target=False), state("c", target=False), state("d")),
        (
            Transition("t", "a", "b", "fault", TRUE),
            by_itself("u", "b", "c", "false"),
            by_itself("v", "c", "d", "x >= 9"),
            Transition("w", "c", "d", "fault", TRUE),
        ),
    )
    here = {"x": 0.0}
    assert names(machine.paths("a", here, "fault", ())) == ["t > u > v"], "nobody decides in the middle of a batch"
    assert names(machine.paths("b", here, "fault", ())) == ["u > v"], "there may be nothing to decide"
    assert set(names(machine.paths("c", here, "fault", ()))) == {"v", "w"}, "both, from there"
    assert names(machine.paths("a", here, "fault", (), longest=1)) == ["t > u > v"], "only decisions are counted"


def test_a_sensor_that_cannot_be_relied_on_is_gone_round() -> None:
    """Two ways to tell that the vessel is full; the first by name counts, as long as it can be read."""
    full = (by_itself("by_level", "a", "b", "x >= 1"), by_itself("by_weight", "a", "b", "y >= 1"))
    machine = StateMachine("m", (state("a", initial=True), state("b")), full)
    for lying, expected in (((), ["by_level"]), (("y",), ["by_level"]), (("x",), ["by_weight"]), (("x", "y"), [])):
        assert names(machine.paths("a", {"x": 0.0, "y": 0.0}, "fault", (), unreliable=lying)) == expected


@pytest.mark.parametrize("values", [{}, {"x": math.nan, "y": math.nan}])
def test_what_is_awaited_needs_no_reading_now(values: dict[str, float]) -> None:
    """A transmitter that is dead must not take the ways away on which nobody reads it yet, or at all."""
    full = (by_itself("by_level", "a", "b", "x >= 1"), by_itself("by_weight", "a", "b", "y >= 1"))
    machine = StateMachine("m", (state("a", initial=True), state("b")), full)
    assert names(machine.paths("a", values, "fault", (), unreliable=("x",))) == ["by_weight"]


def test_a_guard_of_a_decision_may_read_what_cannot_be_relied_on() -> None:
    """What is decided now is judged with the readings of now, by the gate too; only waiting for a liar is refused."""
    machine = StateMachine(
        "m", (state("a", initial=True), state("b")), (Transition("t", "a", "b", "fault", parse("x >= 1")),)
    )
    assert names(machine.paths("a", {"x": 1.0}, "fault", (), unreliable=("x",))) == ["t"]


@settings(max_examples=100)
@given(machines(), st.data())
def test_a_path_that_is_not_in_the_machine_cannot_be_built(machine: StateMachine, data: st.DataObject) -> None:
    some = st.lists(st.sampled_from(machine.transitions), max_size=4) if machine.transitions else st.just([])
    steps = data.draw(some)
    connected = all(a.target == b.source for a, b in itertools.pairwise(steps))
    awaited_first = any(b.on_decision and not a.on_decision for a, b in itertools.pairwise(steps))
    if steps and connected and not awaited_first:
        path = RecoveryPath(machine, tuple(steps))
        assert path.states == (steps[0].source, *(t.target for t in steps)) and path.target == steps[-1].target
    else:
        with pytest.raises(ValueError):
            RecoveryPath(machine, tuple(steps))
    for k, step in enumerate(steps):
        forged = [
            replace(step, guard=parse("x >= -1")),
            replace(step, source="elsewhere"),
            replace(step, target="elsewhere"),
            replace(step, event="forged"),
            replace(step, name="forged"),
            replace(step, on_decision=not step.on_decision),
        ]
        for false_step in forged:
            with pytest.raises(ValueError):
                RecoveryPath(machine, (*steps[:k], false_step, *steps[k + 1 :]))


def test_the_messages_name_the_mistake() -> None:
    machine = StateMachine(
        "m",
        (state("a", initial=True), state("b")),
        (t := Transition("t", "a", "b", "fault", TRUE), replace(t, name="u")),
    )
    with pytest.raises(ValueError, match=r"^a recovery path through 'm' needs at least one transition$"):
        RecoveryPath(machine, ())
    with pytest.raises(ValueError, match=r"^transition 'forged' is not in state machine 'm'$"):
        RecoveryPath(machine, (replace(t, name="forged"),))
    with pytest.raises(ValueError, match=r"^'t' ends in 'b', but 'u' leaves 'a'$"):
        RecoveryPath(machine, machine.transitions)
    with pytest.raises(ValueError, match=r"^state machine 'm' has no state 'c'$"):
        machine.state("c")


@pytest.mark.parametrize(
    ("states", "transitions", "message"),
    [
        ((state("a", initial=True), state("a")), (), "state names are not unique"),
        ((state("a"),), (), "exactly one state must be initial"),
        ((state("a", initial=True), state("b", initial=True)), (), "exactly one state must be initial"),
        ((state("a", initial=True),), (Transition("t", "a", "z", "e", TRUE),), "'t' joins unknown state 'z'"),
        ((state("a", initial=True),), (Transition("t", "z", "a", "e", TRUE),), "'t' joins unknown state 'z'"),
        ((state("a", initial=True),), (Transition("t", "a", "a", "e", TRUE),) * 2, "transition names are not unique"),
    ],
)
def test_a_broken_machine_cannot_be_built(
    states: tuple[State, ...], transitions: tuple[Transition, ...], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        StateMachine("m", states, transitions)


@pytest.mark.parametrize("low", [math.nan, math.inf, -math.inf, 2.0])
def test_a_setpoint_range_that_admits_anything_cannot_be_built(low: float) -> None:
    with pytest.raises(ValueError, match="must be finite, low <= high"):
        SetpointRange("T.sp", low, 1.0, None)
    with pytest.raises(ValueError, match="must be finite, low <= high"):
        SetpointRange("T.sp", 1.0 if math.isfinite(low) else 0.0, -low, None)


def test_a_setpoint_range_may_be_one_value() -> None:
    assert SetpointRange("T.sp", 310.0, 310.0, 310.0).low == 310.0


@pytest.mark.parametrize("limit", [math.nan, math.inf, -math.inf])
def test_a_rate_limit_that_limits_nothing_cannot_be_built(limit: float) -> None:
    with pytest.raises(ValueError, match=r"rate limit .* must be finite"):
        Tag("T.sp", Role.SP, "K", Range(0.0, 1.0), 1.0, rate_limit=limit)


@pytest.mark.parametrize("scale", [math.nan, math.inf, 0.0, -1.0])
def test_a_scale_is_positive(scale: float) -> None:
    with pytest.raises(ValueError, match=r"scale .* must be finite and > 0 K"):
        Tag("T", Role.PV, "K", Range(0.0, 1.0), scale)


@pytest.mark.parametrize(("low", "high"), [(1.0, 1.0), (2.0, 1.0), (math.nan, 1.0), (0.0, math.nan), (-math.inf, 0.0)])
def test_a_range_has_two_finite_ends(low: float, high: float) -> None:
    with pytest.raises(ValueError, match="must be finite with low < high"):
        Range(low, high)


@given(st.floats())
def test_a_range_contains_what_lies_between_its_ends(value: float) -> None:
    inside = Range(-1.0, 2.0)
    assert inside.contains(value) == (-1.0 <= value <= 2.0)
    if not math.isnan(value):
        assert inside.contains(inside.clip(value)) and (inside.clip(value) == value) == inside.contains(value)


STARTS = st.sampled_from(["normal", "compensated", "reduced_load", "holding"])
REACTOR = plant().machine


@settings(max_examples=40)
@given(STARTS, st.floats(290.0, 330.0), st.floats(0.0, 12.0), st.frozensets(st.sampled_from(["V1", "V2", "R1", "P1"])))
def test_the_reactor_s_paths_are_admissible(start: str, hot: float, level: float, blocked: frozenset[str]) -> None:
    for path in REACTOR.paths(start, {"T1": hot, "L1": level}, "fault_diagnosed", blocked):
        assert all(t.on_decision for t in path), "the reactor's recoveries wait for nothing"
        assert admissible_in_plant(REACTOR, path, start, {"T1": hot, "L1": level}, blocked)


def admissible_in_plant(
    machine: StateMachine, path: tuple[Transition, ...], start: str, values: dict[str, float], blocked: frozenset[str]
) -> bool:
    renamed = tuple(replace(t, event="fault") for t in path)
    return all(t.event == "fault_diagnosed" for t in path) and admissible(machine, renamed, start, values, blocked, 3)
