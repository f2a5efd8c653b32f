"""After each fallback a person can start again: by what holds then, or by what the safe state lets them move.

A state that a fallback leads to is left by a decision. Its guard has to hold once the plant has come to rest, or after
what the state leaves open (a setpoint, a command within its range) was moved from one end of it to the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, product
from typing import Final

import numpy as np

from homeostat.agents.search.candidates import design_commands
from homeostat.domain.plant.limits import LimitKind
from homeostat.domain.plant.state_machine import SetpointRange, Transition
from homeostat.domain.recovery import FallbackStrategy
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.course import Course, told_margin
from homeostat.evaluate.lint.deep.onward import Begun, onward
from homeostat.evaluate.lint.finding import Finding, Severity
from homeostat.plants.wired.assembly import fallbacks

MOST: Final = 26
"""Most sets of moves that are tried after one fallback, those of fewest moves first: all of three rows."""
ASKED: Final = 20
"""Moments at which it is asked at most whether a permissive forbids a start."""


@dataclass(slots=True)
class _After:
    """What a person finds after one fallback."""

    strategy: FallbackStrategy
    state: str
    """Where the plant stands."""
    courses: list[Trajectory]
    """The healthy plant once it has come to rest, and after what a person moved then; true values."""
    ways: tuple[Transition, ...]
    """Decisions that lead out of the state."""
    open: tuple[SetpointRange, ...]
    """What may be moved there."""
    taken: set[str] = field(default_factory=set)
    """Names of the ways that can be taken, at rest or after moves."""
    at_rest: frozenset[str] = frozenset()
    """Of those that can be taken as it stands."""


def ways_back(bench: Bench, courses: Sequence[Course]) -> Iterator[Finding]:
    """Decisions that can never be taken, and fallbacks after which there is none while there is one after another.

    ``courses``: the healthy plant after each of its fallbacks, in their order.
    """
    pairs = zip(fallbacks(bench.plant), courses, strict=True)
    every = [_after(bench, strategy, course) for strategy, course in pairs if course.states and not course.broke]
    said = set[str]()
    for state in dict.fromkeys(each.state for each in every):
        there = [each for each in every if each.state == state]
        for way in there[0].ways:
            if not any(way.name in each.at_rest for each in there):
                said.add(state)
                yield _never(bench, there, way)
    left = [each for each in every if each.taken]
    for each in every:
        if left and not each.taken and not (each.state in said and all(o.state != each.state for o in left)):
            yield _stranded(bench, each, left[0])


def _after(bench: Bench, strategy: FallbackStrategy, course: Course) -> _After:
    machine, name = bench.plant.description.machine, course.states[-1][0]
    ways = tuple(t for t in machine.transitions if t.source == name and t.target != name and t.on_decision)
    after = _After(strategy, name, [_rest_of(course)], ways, machine.state(name).open_setpoints)
    after.taken |= {way.name for way in ways if _taken(bench, after.courses[0], way)}
    after.at_rest = frozenset(after.taken)
    if ways and not after.taken and after.open:
        bench.told(f"the way back after {strategy.name}")
        after.courses += _moved(bench, after, course)
        after.taken |= {way.name for way in ways if any(_taken(bench, moved, way) for moved in after.courses[1:])}
    return after


def _rest_of(course: Course) -> Trajectory:
    """What is true once the plant counts as at rest after a fallback: half of what is simulated of it is over."""
    late, truth = course.after(0.5 * (course.acted_s + float(course.truth.times_s[-1]))), course.truth
    signals = {tag: values[:, late] for tag, values in truth.signals.items()}
    return Trajectory(float(truth.times_s[late][0]), truth.dt_s, signals)


def _moved(bench: Bench, after: _After, course: Course) -> list[Trajectory]:
    """The plant after the fallback and each set of moves, for as long again."""
    state, inputs = course.end
    variables, names = bench.plant.description.variables, bench.plant.model.inputs
    begun = []
    for moves in _moves(after.open):
        moved = inputs.copy()
        for tag, value in moves:
            if variables[tag] in names:
                moved[names.index(variables[tag])] = value
        begun.append(Begun(state, moved, float(course.truth.times_s[-1])))
    return onward(bench, begun, float(course.truth.times_s[-1]) - course.acted_s)


def _moves(rows: tuple[SetpointRange, ...]) -> list[tuple[tuple[str, float], ...]]:
    """What a person may move, as sets of tags and values: the ends of their ranges; fewest first."""
    ends = [(None, (row.tag, row.low), (row.tag, row.high)) for row in rows[:3]]
    together = (tuple(move for move in moves if move) for moves in product(*ends))
    alone = (((row.tag, end),) for row in rows[3:] for end in (row.low, row.high))
    return sorted((moves for moves in chain(together, alone) if moves), key=len)[:MOST]


def _margins(course: Trajectory, way: Transition) -> np.ndarray:
    """Margin of the guard at every moment, shape (times,); undecided counts as missed without limit."""
    margins = way.guard.margins(course.signals, course.dt_s)[0]
    return np.where(np.isfinite(margins) | (margins == np.inf), margins, -np.inf)


def _taken(bench: Bench, course: Trajectory, way: Transition) -> bool:
    """Whether the guard holds at some moment, and no permissive forbids the start then."""
    good = np.flatnonzero(np.broadcast_to(_margins(course, way), course.times_s.shape) >= 0.0)
    d = bench.plant.description
    commands = design_commands(d.machine.state(way.target), d.tags_by_name)
    given = {command.tag: command.value for command in commands if command.value is not None}
    free = {command.tag for command in commands}
    for moment in good[:: max(good.size // ASKED, 1)]:
        kept = {tag: float(values[0, moment]) for tag, values in course.signals.items() if tag not in free}
        rules = d.limits.of_kind(LimitKind.PERMISSIVE)
        if all(rule.formula.margin_at(kept | rule.following(given)) >= 0.0 for rule in rules):
            return True
    return False


def _nearest(there: list[_After], way: Transition) -> tuple[str, bool]:
    """Best margin of the guard in its unit, and whether it holds there: then a permissive forbids the start."""
    courses = [course for each in there for course in each.courses]
    best = max(courses, key=lambda course: float(np.max(_margins(course, way))))
    margins = _margins(best, way)
    return told_margin(way.guard, best.signals, margins, best=True), bool((margins >= 0.0).any())


def _why(there: list[_After], way: Transition) -> str:
    margin, holds = _nearest(there, way)
    if holds:
        return f"where '{way.guard}' ({way.name}) holds, a permissive forbids what {way.target!r} is by design"
    return f"'{way.guard}' ({way.name}) holds at no moment, its margin is {margin} at best"


def _never(bench: Bench, there: list[_After], way: Transition) -> Finding:
    """A decision that cannot be taken after any fallback that leads to its state."""
    margin, holds = _nearest(there, way)
    told = (
        f"a permissive forbids what {way.target!r} is by design wherever '{way.guard}' holds" if holds
        else f"'{way.guard}' holds at no moment"
    )  # fmt: skip
    size = "" if holds else f", its margin is {margin} at best"
    what = (
        f"{told} in {way.source!r} once the plant has come to rest after any fallback that leads there{size}, "
        f"so nobody can take {way.name!r}"
    )
    place = bench.places.row("transitions", id=way.name)
    remedy = "correct the guard, or let a fallback lead to where it holds"
    return Finding(Severity.ERROR, "fallbacks", place, what, remedy)


def _stranded(bench: Bench, each: _After, other: _After) -> Finding:
    """A fallback after which nobody can start again, while there is a way after the ``other``."""
    rows = ", ".join(f"{row.tag!r} ({row.low:g} to {row.high:g})" for row in each.open)
    why = (
        f"no decision leads out of {each.state!r}" if not each.ways
        else f"{'; '.join(_why([each], way) for way in each.ways)}, "
        + (f"whatever is made of what {each.state!r} leaves open, {rows}" if rows else f"and {each.state!r} leaves "
           "nothing open")
    ).replace("; ", ", and ")  # fmt: skip
    what = f"after {each.strategy.name!r} nobody can start again, unlike after {other.strategy.name!r}: {why}"
    place = bench.places.row("fallbacks", strategy=each.strategy.name)
    remedy = (
        f"let {each.state!r} leave open what brings the plant to where a start is possible (setpoints.csv), correct "
        "its commands, or let it lead to a state of its own with a guard that holds there"
    )
    return Finding(Severity.WARNING, "fallbacks", place, what, remedy)
