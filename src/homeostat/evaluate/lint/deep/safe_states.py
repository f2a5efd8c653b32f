"""Fallbacks: each reaches its safe state, violates nothing on a healthy plant, and helps in time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from homeostat.domain.diagnosis import FaultMode, FaultState
from homeostat.domain.lasting import lasting
from homeostat.domain.plant.limits import Limit
from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.course import Course, told_margin
from homeostat.evaluate.lint.deep.standing import standing
from homeostat.evaluate.lint.deep.way_back import ways_back
from homeostat.evaluate.lint.finding import Finding, Severity, amount
from homeostat.guard.fallback.effect import EffectWatch
from homeostat.guard.watch.violations import Violation
from homeostat.knowledge.description.guarding import times_s
from homeostat.plants.wired.assembly import fallbacks

LATE: Final = 3.0
"""A limit trips so many ticks after its first violation."""
LEAST_S: Final = 200.0
"""For how long it is followed at least, by the reference [s]."""
PERIODS: Final = 4.0
"""Multiples of its time for which it is followed whether a strategy helps [1]."""
MINDS: Final = 0.05
"""Share of what a limit's margin comes through by which a quicker command has to raise it to be a remedy [1]."""
ROUND: Final = 1e-9
_REMEDY: Final = (
    "command more, faster (fallbacks.csv), or state another strategy for the limit, or that more may stay (rest in "
    "fallback_limits.csv)"
)

_ANOTHER: Final = (
    "let a strategy for the limit also command an actuator that stops it where the faulty one cannot (fallbacks.csv; "
    "add one to the plant if there is none), or state that more may stay (rest in fallback_limits.csv)"
)


class _Asked(NamedTuple):
    """A fault under which a hard limit is violated, and when."""

    fault: FaultMode
    severity: float
    limit: Limit
    from_s: float


class _Failure(NamedTuple):
    """A strategy that does not help in its time."""

    fault: str
    reason: str
    """As the guard would say it."""
    back_s: float | None
    """When the limit comes back all the same, after the strategy stands [s]; None where it does not."""
    idle: bool = False
    """Whether it gets worse after all that the strategy commands is done: nothing of that stops what the fault does."""


def safe_states(bench: Bench) -> Iterator[Finding]:
    """What is wrong with the ways to the safe states."""
    for strategy, course in zip(fallbacks(bench.plant), after_fallbacks(bench), strict=True):
        yield from _healthy(bench, strategy, course)
    yield from ways_back(bench, after_fallbacks(bench))
    yield from standing(bench, after_fallbacks(bench))
    yield from _helps(bench)


def after_fallbacks(bench: Bench) -> tuple[Course, ...]:
    """The fault-free plant after each of its fallback strategies, with noise; in their order."""
    return bench.kept("fallbacks", lambda: tuple(_after(bench, strategy) for strategy in fallbacks(bench.plant)))


def _after(bench: Bench, strategy: FallbackStrategy) -> Course:
    bench.told(f"fallback {strategy.name}")

    def act(seen: Snapshot) -> ActionSet | None:
        return strategy.actions if seen.at_s >= bench.onset_s else None

    return bench.acted((), noise=1.0, act=act)


def _healthy(bench: Bench, strategy: FallbackStrategy, course: Course) -> Iterator[Finding]:
    """On a plant without a fault the safe state is reached, and no hard limit is violated on the way."""
    place, machine = bench.places.row("fallbacks", strategy=strategy.name), bench.plant.description.machine
    if course.broke:
        what = f"the fault-free plant breaks after {strategy.name!r}: {course.broke}"
        yield Finding(Severity.ERROR, "fallbacks", place, what, "mend the equations, or the commands")
        return
    name = course.states[-1][0] if course.states else strategy.actions.target
    state = machine.state(name)
    late = course.after(course.states[-1][1] if course.states else course.acted_s)
    signals = {tag: values[:, late] for tag, values in course.truth.signals.items()}
    margins = state.settled_when.margins(signals, course.truth.dt_s)
    if not (margins >= 0.0).any():
        best = told_margin(state.settled_when, signals, margins[0], best=True)
        what = (
            f"{strategy.name!r} does not reach {name!r} in {lasting(course.lasts_s(late))} on the fault-free plant: "
            f"'{state.settled_when}' never holds, its margin is {best} at best"
        )
        remedy = f"command what the state needs, or correct its settled_when ({bench.places.row('states', id=name)})"
        yield Finding(Severity.ERROR, "fallbacks", place, what, remedy)
    elif not (margins[0, -1] >= 0.0):
        what = (
            f"{strategy.name!r} reaches {name!r} and leaves it again: '{state.settled_when}' does not hold at the end"
        )
        yield Finding(Severity.ERROR, "fallbacks", place, what, "command what keeps the state")
    for limit in bench.plant.description.limits.hard:
        outside = course.outside(limit) & course.after(course.acted_s)
        if outside.any():
            what = (
                f"{strategy.name!r} violates {limit.name} on the fault-free plant: '{limit.formula}' does not hold for "
                f"{lasting(course.lasts_s(outside))}, first "
                f"{lasting(float(course.truth.times_s[outside][0]) - course.acted_s)} after it"
            )
            yield Finding(Severity.ERROR, "fallbacks", place, what, "correct its commands, their order or their rates")


def _helps(bench: Bench) -> Iterator[Finding]:
    """Whatever fault violates a limit, some strategy that is said to bring it back does; and each does under some."""
    own: dict[tuple[str, str], list[_Failure | None]] = {}
    said = set[tuple[str, str]]()
    for each in _asked(bench):
        serving = [s for s in fallbacks(bench.plant) if each.limit.name in s.serves]
        failures = [_fails(bench, each, strategy) for strategy in serving]
        for strategy, failure in zip(serving, failures, strict=True):
            if _fit(bench, each.fault, strategy):
                own.setdefault((strategy.name, each.limit.name), []).append(failure)
        told = [failure for failure in failures if failure]
        if serving and len(told) == len(serving):
            said |= {(strategy.name, each.limit.name) for strategy in serving}
            what = f"under {each.fault.name!r} ({amount(each.severity, each.fault.severity_unit, 6)}) no strategy helps"
            place, remedy = bench.places.row("limits", id=each.limit.name), _ANOTHER if told[0].idle else _REMEDY
            yield Finding(Severity.ERROR, "fallbacks", place, f"{what} {each.limit.name}: {told[0].reason}", remedy)
    for (name, limit), every in own.items():
        if (name, limit) in said and all(failure and failure.idle for failure in every):
            continue  # it was said, with what to do
        yield from _hindered(bench, name, limit, every)


def _hindered(bench: Bench, strategy: str, limit: str, every: list[_Failure | None]) -> Iterator[Finding]:
    """What keeps a strategy from bringing a limit back under faults that leave it what it commands."""
    failures = [failure for failure in every if failure]
    late = [(failure.back_s, failure.fault) for failure in failures if failure.back_s is not None]
    place = bench.places.row("fallback_limits", strategy=strategy, limit=limit)
    if len(failures) == len(every):
        what = f"it helps {limit} under none of the {len(every)} faults that violate it: {failures[0].reason}"
        remedy = "command more, faster (fallbacks.csv), give it the time that it needs (acts_within_s), or more rest"
        yield Finding(Severity.ERROR, "fallbacks", place, what, remedy)
    elif late:
        back_s, fault = max(late)
        what = f"{strategy!r} is given up before it helps: under {fault!r} {limit} comes back after {lasting(back_s)}"
        longest_s = times_s("acts_within_s", bench.plant.description.timing)[1]
        longer = "give it about twice as long (acts_within_s), or command"
        if 2.0 * back_s > longest_s:  # which the check of the tables refuses
            longer = (
                f"acts_within_s may be {longest_s:g} s at most, so state another strategy for the limit, or command"
            )
        remedy = f"{longer} more, faster (rate in fallbacks.csv, fastest in writables.csv) ({len(late)} faults)"
        yield Finding(Severity.ERROR, "fallbacks", place, what, remedy)


def _fit(bench: Bench, fault: FaultMode, strategy: FallbackStrategy) -> bool:
    """Whether what the strategy commands is sound under ``fault``: one that is not cannot be blamed on it."""
    commanded = {command.tag for command in strategy.actions.commands}
    return all(s.component != fault.component for s in bench.plant.description.signals if s.tag.name in commanded)


def _asked(bench: Bench) -> Iterator[_Asked]:
    """Each fault that violates a hard limit while nobody acts, at its nominal severity, else at its highest."""
    hard = [limit for limit in bench.plant.description.limits.hard if not bench.quiet.outside(limit).any()]
    for fault in bench.plant.description.faults:  # a limit that is violated without one was told of already
        for severity in (fault.severity_nominal, fault.severity_range.high):
            course = bench.faulty(fault, severity)
            late = course.after(bench.onset_s)
            outside = [(limit, course.outside(limit) & late) for limit in hard]
            hit = [(limit, float(course.truth.times_s[np.argmax(o)])) for limit, o in outside if o.any()]
            for limit, from_s in hit:
                yield _Asked(fault, severity, limit, from_s)
            if hit:
                break


def _fails(bench: Bench, asked: _Asked, strategy: FallbackStrategy) -> _Failure | None:
    """Why ``strategy`` does not help, as the guard would say; None where it does."""
    bench.told(f"{strategy.name} under {asked.fault.name}")
    course = _course(bench, asked, strategy.actions, strategy.serves[asked.limit.name].acts_within_s)
    if course.broke:
        return _Failure(asked.fault.name, f"the plant breaks: {course.broke}", None)
    stands_s = course.acted_s + confirm_s(bench, strategy)
    effect = strategy.serves[asked.limit.name]
    watch = EffectWatch(fallbacks(bench.plant), bench.plant.description.timing)
    for snapshot in course.seen:
        if snapshot.at_s <= stands_s:
            continue
        margin = asked.limit.formula.margin_at(snapshot.values)
        violated = () if margin >= 0.0 else (Violation(asked.limit.name, margin, asked.limit.formula.unit, _SHORT),)
        if failure := watch.failed(snapshot.at_s, strategy, violated):
            still = course.outside(asked.limit) & course.after(stands_s)
            back_s = None if still[-1] else float(course.truth.times_s[still][-1]) - stands_s if still.any() else 0.0
            rest = f", and rest = {amount(effect.rest, asked.limit.formula.unit)} is what may stay"
            why = failure[1].removesuffix(f": {_SHORT}") + rest
            if goes_on := _goes_on(bench, asked, strategy, course):
                return _Failure(asked.fault.name, why + goes_on, back_s, idle=True)
            return _Failure(asked.fault.name, why + _ramps(bench, asked, strategy, course), back_s)
    return None


def _course(bench: Bench, asked: _Asked, actions: ActionSet, within_s: float) -> Course:
    """The plant under the fault that is ``asked`` about, with ``actions`` once the limit has tripped."""
    timing = bench.plant.description.timing

    def act(seen: Snapshot) -> ActionSet | None:
        return actions if seen.at_s >= asked.from_s + LATE * timing.tick_s else None

    fault = FaultState(asked.fault.name, asked.severity, bench.onset_s)
    end_s = min(bench.plant.end_s, asked.from_s + max(PERIODS * within_s, timing.time_s(LEAST_S)))
    return bench.acted((fault,), noise=1.0, act=act, end_s=end_s)


def _goes_on(bench: Bench, asked: _Asked, strategy: FallbackStrategy, course: Course) -> str:
    """That the limit is violated more and more once all that ``strategy`` commands is done; empty where it is not."""
    takes_s = [_takes_s(course, command) for command in strategy.actions.commands]
    done_s = course.acted_s + max(takes_s, default=0.0) + confirm_s(bench, strategy)
    margins, late = course.margins(asked.limit), course.after(done_s)
    if late.sum() < LATE or not margins[late][-1] < min(margins[late][0], 0.0):
        return ""
    by = amount(float(margins[late][0] - margins[late][-1]), asked.limit.formula.unit)
    lasts = f"in the {lasting(course.lasts_s(late))} after all that it commands is done it gets worse by {by}"
    return f"; {lasts}: nothing of that stops what {asked.fault.name!r} does"


def _takes_s(course: Course, command: Command) -> float:
    """How long a command is on its way at its rate [s]; 0 where it has none."""
    began = float(course.true(command.tag)[int(np.searchsorted(course.truth.times_s, course.acted_s))])
    if command.value is None or command.rate is None or not math.isfinite(began):
        return 0.0
    return abs(command.value - began) / command.rate


def _ramps(bench: Bench, asked: _Asked, strategy: FallbackStrategy, course: Course) -> str:
    """What of ``strategy`` is still on its way when it has to have helped, and how fast it goes; empty for nothing.

    What the limit does not mind is not told.
    """
    told, within_s = [], strategy.serves[asked.limit.name].acts_within_s
    for command in strategy.actions.commands:
        tag, takes_s = bench.plant.description.tag(command.tag), _takes_s(course, command)
        if command.rate is not None and takes_s > 0.5 * within_s and _matters(bench, asked, strategy, command, course):
            rate = amount(command.rate, f"{tag.unit}/s")
            told.append(f"{command.tag!r} takes {lasting(takes_s)} at its rate, {rate}")
    said = "; ".join(told)
    return f"; {said}: state a higher rate, and in writables.csv as fastest what the equipment permits" if told else ""


def _matters(bench: Bench, asked: _Asked, strategy: FallbackStrategy, command: Command, course: Course) -> bool:
    """Whether the limit is kept better where ``strategy`` does this at once: else its rate is no remedy."""
    at_once = tuple(replace(c, rate=None) if c == command else c for c in strategy.actions.commands)
    bench.told(f"{strategy.name} with {command.tag} at once")
    actions = replace(strategy.actions, commands=at_once)
    other = _course(bench, asked, actions, strategy.serves[asked.limit.name].acts_within_s)
    if other.broke:
        return True
    now, then = (each.margins(asked.limit)[each.after(course.acted_s)] for each in (course, other))
    length = min(now.size, then.size)
    better = float(np.nan_to_num(then[:length] - now[:length]).max(initial=0.0))
    return better > MINDS * max(float(np.ptp(now[:length])) if length else 0.0, ROUND)


_SHORT: Final = "violated"


def confirm_s(bench: Bench, strategy: FallbackStrategy) -> float:
    """Time in which the plant has accepted all its commands, and it stands [s]."""
    d = bench.plant.description
    return max((d.writables[c.tag].confirm_s for c in strategy.actions.commands if c.tag in d.writables), default=0.0)
