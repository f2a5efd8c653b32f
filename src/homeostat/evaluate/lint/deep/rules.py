"""Guards that cannot hold while the limits do, and permissives that forbid what no limit needs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from homeostat.domain.plant.description import Relation
from homeostat.domain.plant.limits import Limit, LimitKind
from homeostat.domain.plant.state_machine import State
from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.inverted import TURN, inverted, turned_round
from homeostat.evaluate.lint.finding import Finding, Severity
from homeostat.knowledge.checks.consistency_rules import ranges_of
from homeostat.knowledge.checks.intervals import can_fail, can_hold
from homeostat.stl import tree

FORBIDDEN: Final = 0.05
"""Share of the time in a state for which a permissive may forbid what the state is by design [1]."""


def rules(bench: Bench) -> Iterator[Finding]:
    """Rules that forbid more than the plant needs, or never hold."""
    bench.told("guards and permissives")
    yield from _guards(bench)
    yield from uncommanded(bench)
    yield from refused_fallbacks(bench)
    yield from _by_design(bench)
    yield from inverted(bench)
    yield from _admitted(bench)


def _guards(bench: Bench) -> Iterator[Finding]:
    """Decisions whose guard contradicts the hard limits of ordinary operation."""
    d = bench.plant.description
    ranges, limits = ranges_of(d), tuple(limit.formula.root for limit in d.limits.hard)
    for transition in d.machine.transitions:
        if transition.source in d.start_up.states or not transition.guard.tags:
            continue
        bounding = tuple(root for root in limits if isinstance(root, tree.Comparison))
        if not can_hold(tree.And((transition.guard.root, *bounding)), ranges):
            what = (
                f"'{transition.guard}' cannot hold in {transition.source!r} while every hard limit holds, so "
                f"{transition.name!r} is never taken before a trip"
            )
            place = bench.places.row("transitions", id=transition.name)
            yield Finding(Severity.ERROR, "rules", place, what, "correct the guard, or the limit")


def _permissives(bench: Bench) -> tuple[Limit, ...]:
    return bench.plant.description.limits.of_kind(LimitKind.PERMISSIVE)


def uncommanded(bench: Bench) -> Iterator[Finding]:
    """Permissives that no command meets, whatever is commanded: always, or while an actuator is stuck."""
    d = bench.plant.description
    commanded = {r.tag for state in d.machine.states for r in state.setpoints}
    moved = {signal.tag.name for signal in d.signals if signal.relation in (Relation.DRIVES, Relation.OVERRIDES)}
    for limit in _permissives(bench):
        place = bench.places.row("limits", id=limit.name)
        read = ", ".join(map(repr, sorted(limit.formula.tags)))
        if not limit.formula.tags & (commanded | moved):
            what = (
                f"'{limit.formula}' reads {read}, which nobody commands: while it does not hold, it forbids every "
                "step, also one that would help, and every fallback that does not set it aside"
            )
            remedy = "name what must not be commanded, such as 'HEATER.sp <= 25 or LEVEL >= 30'"
            yield Finding(Severity.WARNING, "rules", place, what, remedy)
            continue
        for fault, tag, stands in _stuck(bench):
            if tag in limit.formula.tags and not can_hold(limit.formula.root, ranges_of(d) | {tag: (stands, stands)}):
                what = (
                    f"'{limit.formula}' cannot hold with {tag!r} at {stands:.3g}, where {fault!r} leaves it: "
                    "whatever is commanded, every step is forbidden then"
                )
                remedy = "read the command in place of the position, or add 'or' and what may be commanded all the same"
                yield Finding(Severity.WARNING, "rules", place, what, remedy)
                break


def refused_fallbacks(bench: Bench) -> Iterator[Finding]:
    """Fallbacks that a permissive may refuse, by what the plant does at that moment, and that do not set it aside.

    It is only worth knowing where another fallback is refused by none.
    """
    strategies = bench.plant.description.fallback_strategies
    refused = {strategy.name: _refusing(bench, strategy) for strategy in strategies}
    sure = not all(refused.values())
    for strategy in strategies:
        for limit in refused[strategy.name]:
            what = (
                f"'{limit.formula}' ({limit.name}) may fail whatever the fallback {strategy.name!r} commands, which is "
                f"refused then{', and another one acts' if sure else '; so may be every other one'}"
            )
            place = bench.places.row("fallbacks", strategy=strategy.name)
            remedy = "command what the permissive asks for, or set it aside in fallback_waivers.csv"
            yield Finding(Severity.NOTE if sure else Severity.WARNING, "rules", place, what, remedy)


def _refusing(bench: Bench, strategy: FallbackStrategy) -> list[Limit]:
    """Permissives that may fail beside what ``strategy`` commands, whatever that is."""
    commanded = {c.tag: (c.value, c.value) for c in strategy.actions.commands if c.value is not None}
    ranges, own = ranges_of(bench.plant.description), [p for p in _permissives(bench) if p.name not in strategy.waived]
    return [p for p in own if can_fail(p.formula.root, ranges | p.following(commanded))]


def _stuck(bench: Bench) -> Iterator[tuple[str, str, float]]:
    """Every fault that takes an actuator away, the tag that shows where that stands, and where it comes to stand."""
    d = bench.plant.description
    for fault in d.faults:
        tag = d.positions.get(fault.disables or "")
        if tag is not None:
            yield fault.name, tag, float(bench.faulty(fault, fault.severity_nominal).true(tag)[-1])


def _by_design(bench: Bench) -> Iterator[Finding]:
    """Permissives that the fault-free plant violates while it does what its states are by design."""
    course, d = bench.quiet, bench.plant.description
    for limit in _permissives(bench):
        found = limit.formula.margins(course.truth.signals, course.truth.dt_s)
        fails = ~(np.broadcast_to(found, (1, course.truth.times_s.size))[0] >= 0.0)  # what is undecided forbids, too
        for state, from_s, to_s in course.stays:
            during = course.after(from_s) & (course.truth.times_s < to_s)
            if state in d.start_up.states or not during.any() or fails[during].mean() <= FORBIDDEN:
                continue
            what = (
                f"'{limit.formula}' forbids what {state!r} is by design: it does not hold for "
                f"{course.lasts_s(fails[during]):g} of {course.lasts_s(during):g} s of the fault-free plant "
                f"in that state"
            )
            place, remedy = (
                bench.places.row("limits", id=limit.name),
                "correct the permissive, or what the state admits",
            )
            forbidden = {tag: values[:, during & fails] for tag, values in course.truth.signals.items()}
            if turned := turned_round(d, limit, forbidden, course.truth.dt_s):
                what, remedy = f"{what}, {turned}", f"{TURN}, or what the state admits"
            yield Finding(Severity.ERROR, "rules", place, what, remedy)
            break


def _admitted(bench: Bench) -> Iterator[Finding]:
    """Permissives that forbid what a state admits, although no limit would be violated by it."""
    course = bench.quiet
    if course.broke or not math.isfinite(course.settled_s) or course.settled_s >= course.truth.times_s[-1]:
        return
    values = {tag: float(column[0, -1]) for tag, column in course.truth.signals.items()}
    found = set[str]()
    for state in bench.plant.description.machine.states:
        design = {r.tag: r.low if r.design is None and r.low == r.high else r.design for r in state.setpoints}
        own = values | {tag: value for tag, value in design.items() if value is not None}
        for tag, value in _choices(state):
            for limit in _permissives(bench):
                forbids = tag in limit.formula.tags and limit.formula.margin_at(own | {tag: value}) < 0.0
                if forbids and limit.name not in found and not _needed(bench, state, tag, value):
                    found.add(limit.name)
                    what = (
                        f"'{limit.formula}' forbids {tag!r} = {value:g}, which {state.name!r} admits, and no limit "
                        f"needs it: {bench.plant.twin.horizon_s:g} s after that command every limit is kept"
                    )
                    place = bench.places.row("limits", id=limit.name)
                    remedy = "correct the permissive, or let the state admit less (setpoints.csv)"
                    yield Finding(Severity.WARNING, "rules", place, what, remedy)


def _choices(state: State) -> Iterator[tuple[str, float]]:
    """Ends of what may be chosen in ``state``."""
    for row in state.setpoints:
        if row.low < row.high:
            yield row.tag, row.low
            yield row.tag, row.high


def _needed(bench: Bench, state: State, tag: str, value: float) -> bool:
    """Whether some limit would be violated in the twin's horizon after ``tag`` is set to ``value`` in ``state``."""
    plant = bench.plant
    commands = [Command(r.tag, r.design, None) for r in state.setpoints if r.tag != tag and r.design is not None]
    begin_s = plant.end_s - plant.twin.horizon_s - plant.description.timing.tick_s

    def act(seen: Snapshot) -> ActionSet | None:
        return ActionSet((*commands, Command(tag, value, None)), state.name) if seen.at_s >= begin_s else None

    course = bench.acted((), act=act)
    limits = [limit for limit in plant.description.limits.limits if limit.kind is not LimitKind.PERMISSIVE]
    late = course.after(begin_s)
    return course.broke != "" or any((course.outside(limit) & late).any() for limit in limits)
