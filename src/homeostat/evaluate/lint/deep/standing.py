"""What a fallback itself violates while the plant stands in its safe state for long: limits, and charged criteria.

A plant that is shut down cools, or empties, until it is outside what its limits say of operation. Where nothing is
wrong but the shutdown, the guard has nothing better to send, and who reads the costs finds what nobody can avoid.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from homeostat.domain.lasting import lasting
from homeostat.domain.plant.limits import Criterion, Limit, LimitKind
from homeostat.domain.recovery import FallbackStrategy
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.course import Course, told_margin
from homeostat.evaluate.lint.deep.onward import Begun, onward
from homeostat.evaluate.lint.finding import Finding, Severity, amount
from homeostat.plants.wired.assembly import fallbacks
from homeostat.process.types import Vec
from homeostat.stl.formula import Formula

Flags: TypeAlias = NDArray[np.bool_]

RUNS: Final = 10.0
"""For how long a shutdown is looked at, in runs of the plant [1]."""
WORK: Final = 2e7
"""States that are simulated for a tick at most, all fallbacks together: some seconds [1]."""
SOON: Final = 2.0
"""What is violated after more runs of the plant than that is a note: somebody will have looked at it by then [1]."""
TOLD: Final = 4
"""So many of its commands are told."""
MISSED: Final = 0.9
"""Share of the second half of that time for which a criterion counts as missed by the shutdown itself [1]."""


@dataclass(frozen=True, slots=True)
class _Standing:
    """The healthy plant in the safe state of one fallback: what the check simulates, and what follows it."""

    strategy: FallbackStrategy
    course: Course
    later: Trajectory

    @property
    def length_s(self) -> float:
        """How long it is looked at [s]."""
        return float(self.course.truth.times_s[-1]) - self.course.acted_s + self.later.length * self.later.dt_s

    def outside(self, formula: Formula) -> tuple[Flags, Vec]:
        """At which moments it is violated, and when these are after the fallback [s]."""
        course, later = self.course, self.later
        begun = _violated(formula, course.truth.signals, course.truth.dt_s) & course.after(course.acted_s)
        then = _violated(formula, later.signals, later.dt_s)
        end_s = float(course.truth.times_s[-1])
        times_s = np.concatenate([course.truth.times_s, end_s + later.dt_s * np.arange(1, then.size + 1)])
        return np.concatenate([begun, then]), times_s - course.acted_s


def _violated(formula: Formula, signals: Mapping[str, np.ndarray], dt_s: float) -> Flags:
    margins = np.broadcast_to(formula.margins(signals, dt_s)[0], next(iter(signals.values())).shape[1:])
    return np.asarray(margins < 0.0)


def standing(bench: Bench, courses: Sequence[Course]) -> Iterator[Finding]:
    """Limits that a shutdown violates by itself, and a note of the criteria that it is charged for.

    ``courses``: the healthy plant after each of its fallbacks, in their order.
    """
    every = _every(bench, courses)
    limits = [limit for limit in bench.plant.description.limits.limits if limit.kind is not LimitKind.PERMISSIVE]
    for limit in limits:
        found = [each for each in every if _lasts(bench, each, limit)]
        if found:
            yield _of_limit(bench, limit, found)
    yield from _charged(bench, every)


def _every(bench: Bench, courses: Sequence[Course]) -> list[_Standing]:
    pairs = [(s, c) for s, c in zip(fallbacks(bench.plant), courses, strict=True) if c.states and not c.broke]
    if not pairs:
        return []
    bench.told("shutdowns that last")
    begun = [Begun(*course.end, float(course.truth.times_s[-1])) for _, course in pairs]
    most_s = WORK / len(bench.plant.model.states) / len(begun) * bench.plant.description.timing.tick_s
    later = onward(bench, begun, min(RUNS * bench.plant.end_s, most_s))
    return [_Standing(s, c, after) for (s, c), after in zip(pairs, later, strict=True)]


def _lasts(bench: Bench, each: _Standing, limit: Limit) -> bool:
    """Whether ``limit`` is violated at the end although it held before, and no other check says so."""
    flags, _ = each.outside(limit.formula)
    if not flags[-1] or each.course.outside(limit)[~each.course.after(each.course.acted_s)][-1:].any():
        return False
    return not (limit.hard and (each.course.outside(limit) & each.course.after(each.course.acted_s)).any())


def _of_limit(bench: Bench, limit: Limit, found: Sequence[_Standing]) -> Finding:
    first = found[0]
    flags, times_s = first.outside(limit.formula)
    begins_s = float(times_s[int(np.argmax(flags))])
    names = " and ".join(repr(each.strategy.name) for each in found)
    signals, margins = first.later.signals, limit.formula.margins(first.later.signals, first.later.dt_s)[0]
    most = told_margin(limit.formula, signals, margins, best=False).removeprefix("-")
    commands = first.strategy.actions.commands
    given = ", ".join(_command(bench, c.tag, c.value) for c in commands[:TOLD]) + (" ..." if commands[TOLD:] else "")
    what = (
        f"{limit.name} is violated by {names} itself, with nothing wrong but the shutdown: {lasting(begins_s)} after "
        f"it '{limit.formula}' does not hold any more, by up to {most} and to the end of the {lasting(first.length_s)} "
        f"that were looked at, because of what it commands ({given})"
    )
    rows = bench.places.row("fallbacks", strategy=first.strategy.name)
    remedy = (
        f"say where the limit counts ('... or TAG <= VALUE' of what stands still then), let the fallback hold it "
        f"({rows}), or state the value that equipment bears while it stands"
    )
    severity = Severity.WARNING if begins_s <= SOON * bench.plant.end_s else Severity.NOTE
    return Finding(severity, "fallbacks", bench.places.row("limits", id=limit.name), what, remedy)


def _command(bench: Bench, tag: str, value: float | None) -> str:
    return f"{tag} on automatic" if value is None else f"{tag} = {amount(value, bench.plant.description.tag(tag).unit)}"


def _charged(bench: Bench, every: Sequence[_Standing]) -> Iterator[Finding]:
    """One note of the soft criteria that are missed all the time while the plant stands."""
    told, first = list[str](), None
    for criterion in bench.plant.description.limits.criteria:
        missed = [each.strategy.name for each in every if _missed(criterion, each)]
        if missed and not criterion.hard:
            first = first or criterion
            told.append(f"{criterion.name} ('{criterion.formula}') after {' and '.join(map(repr, missed))}")
    if first is not None:
        what = (
            f"missed for as long as the plant stands, with nothing wrong but the shutdown, and charged all the time: "
            f"{', '.join(told)}"
        )
        remedy = "nothing, where a shutdown shall cost that; else say where it counts ('... or TAG <= VALUE')"
        yield Finding(Severity.NOTE, "fallbacks", bench.places.row("criteria", id=first.name), what, remedy)


def _missed(criterion: Criterion, each: _Standing) -> bool:
    if criterion.formula.horizon_s > 0.0:  # judged from a release on, and not of what stands
        return False
    flags = _violated(criterion.formula, each.later.signals, each.later.dt_s)
    return float(flags[flags.size // 2 :].mean()) > MISSED
