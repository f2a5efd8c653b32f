"""Can the rules of a plant do what they are for, given the ranges of its tags and the length of a rollout?"""

import math
from typing import Final

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.state_machine import State
from homeostat.knowledge.checks.intervals import Interval, Intervals, bounds, can_fail, can_hold
from homeostat.knowledge.checks.reach import comparisons, deepest, ends
from homeostat.knowledge.store.error import Code, Found
from homeostat.stl.formula import Formula
from homeostat.stl.text import render
from homeostat.stl.tree import Always, Comparison, Eventually, Node, Not, Until, children, tags_of, walk
from homeostat.stl.units import in_unit

ROOM: Final = 0.05
"""Share of what a comparison can vary by that lies beyond it: nearer to its end no instrument shows a violation [1]."""


def formulas(plant: PlantDescription) -> Found:
    """Formulas that cannot hold, protect nothing, compare with impossible values, or look ahead where they must not."""
    ranges = ranges_of(plant)
    for transition in plant.machine.transitions:
        yield from momentary(f"transition {transition.name!r}", "guard", transition.guard)
        yield from judged(plant, f"transition {transition.name!r}", transition.guard, ranges)
    for state in plant.machine.states:
        yield from momentary(f"state {state.name!r}", "settled_when", state.settled_when)
        yield from judged(plant, f"state {state.name!r}", state.settled_when, ranges)
        yield from settled(state, ranges)
    for limit in plant.limits.limits:
        yield from momentary(f"limit {limit.name!r}", "limit", limit.formula)
        yield from judged(plant, f"limit {limit.name!r}", limit.formula, ranges)
        yield from violable(plant, f"limit {limit.name!r}", limit.formula)
        yield from always_known(plant, f"limit {limit.name!r}", limit.formula)
    for criterion in plant.limits.criteria:
        yield from judged(plant, f"criterion {criterion.name!r}", criterion.formula, ranges)
        yield from breakable(f"criterion {criterion.name!r}", criterion.formula, ranges)
        if criterion.hard:
            yield from roomy(plant, f"criterion {criterion.name!r}", criterion.formula)


def settled(state: State, ranges: Intervals) -> Found:
    """A state that never settles, because what it commands keeps its own condition from holding."""
    formula = state.settled_when
    own = {s.tag: (s.low, s.high) for s in state.setpoints if s.tag in formula.tags}
    if own and can_hold(formula.root, ranges) and not can_hold(formula.root, {**ranges, **own}):
        admitted = ", ".join(f"{tag!r} from {low:g} to {high:g}" for tag, (low, high) in sorted(own.items()))
        message = f"'{formula}' cannot hold with the setpoints that it admits ({admitted}), so it never settles"
        yield Code.GUARD_NEVER_TRUE, f"state {state.name!r}", f"{message}; correct settled_when or setpoints.csv"


def ranges_of(plant: PlantDescription) -> dict[str, Interval]:
    """Tag -> the values that it may have."""
    return {tag.name: (tag.range.low, tag.range.high) for tag in plant.tags}


def momentary(thing: str, what: str, formula: Formula) -> Found:
    """A formula that is judged on one moment but looks ahead; ``what`` it is, for the message."""
    if any(isinstance(node, Always | Eventually | Until) for node, _ in walk(formula.root)):
        message = f"{what} '{formula}' is judged on one moment; remove always, eventually and until"
        yield Code.LIMIT_LOOKS_AHEAD, thing, message


def always_known(plant: PlantDescription, thing: str, formula: Formula) -> Found:
    """A limit that reads a manual output: it has no value while the plant's own control has the actuator."""
    for manual in sorted(formula.tags & plant.overridden.keys()):
        message = f"reads {manual!r}, which has no value on automatic; read {plant.overridden[manual]!r} or a position"
        yield Code.LIMIT_WITHOUT_VALUE, thing, message


def judged(plant: PlantDescription, thing: str, formula: Formula, ranges: Intervals) -> Found:
    """A formula that cannot hold inside ``ranges``, or compares with a value that an instrument cannot show."""
    if not can_hold(formula.root, ranges):
        yield Code.GUARD_NEVER_TRUE, thing, f"'{formula}' cannot hold for any values inside the ranges of its tags"
    for bound in bounds(formula.root):
        tag = plant.tag(bound.tag)
        if not tag.range.contains(bound.value):
            allowed = f"[{tag.range.low:g}, {tag.range.high:g}]{in_unit(tag.unit)}"
            message = f"compares {tag.name!r} with {bound.value:g}, outside its range {allowed}"
            yield Code.LIMIT_OUTSIDE_RANGE, thing, f"{message}; correct the value, or that range"


def breakable(thing: str, formula: Formula, ranges: Intervals) -> Found:
    """A formula that cannot fail inside ``ranges``."""
    if not can_fail(formula.root, ranges):
        message = f"'{formula}' holds for all values inside the ranges of its tags, so it protects nothing; correct it"
        yield Code.LIMIT_NEVER_VIOLATED, thing, message


def violable(plant: PlantDescription, thing: str, formula: Formula) -> Found:
    """A rule about one moment that values inside the ranges of its tags cannot violate, or not by enough to be seen."""
    ranges = ranges_of(plant)
    never = [*breakable(thing, formula, ranges), *roomy(plant, thing, formula)]
    yield from never
    if never or any(momentary(thing, "", formula)):
        return
    sizes = [(ends(node, holds, ranges), node.scale) for node, holds in comparisons(formula.root)]
    least = min((ROOM * (high - low) / scale for (low, high), scale in sizes), default=0.0)
    if (found := deepest(formula, ranges)) < least:
        shown = (
            f"no values inside the ranges of its tags violate '{formula}' by more than {found:g}{in_unit(formula.unit)}"
        )
        message = (
            f"{shown}, and {least:g}{in_unit(formula.unit)} are needed ({ROOM:.0%} of what it compares); correct it"
        )
        yield Code.LIMIT_NEVER_VIOLATED, thing, message


def roomy(plant: PlantDescription, thing: str, formula: Formula) -> Found:
    """A comparison so near to the end of what it compares that no instrument shows its violation."""
    for comparison, holds in comparisons(formula.root):
        low, high = ends(comparison, holds, ranges_of(plant))
        text = render(comparison if holds else Not(comparison))
        if not math.isfinite(high - low):
            message = f"'{text}' divides by what may be 0 inside the ranges of its tags; multiply it out"
            yield Code.BAD_FORMULA, thing, message
        elif -low < ROOM * (high - low) or high == low:
            unit = _unit(plant, comparison, formula)
            message = (
                f"'{text}' can be violated by at most {max(-low, 0.0):g}{in_unit(unit)} inside the ranges of its tags"
            )
            needed = f"less than {ROOM:.0%} of the {high - low:g}{in_unit(unit)} that it can vary by"
            yield Code.LIMIT_NEVER_VIOLATED, thing, f"{message}, {needed}, so it protects nothing; correct the value"


def _unit(plant: PlantDescription, comparison: Comparison, formula: Formula) -> str:
    """Unit of the margin of one comparison, without its scale."""
    units = {plant.tag(name).unit for name in tags_of(comparison)}
    return units.pop() if len(units) == 1 else formula.unit


def criteria(plant: PlantDescription, horizon_s: float) -> Found:
    """Criteria that look further ahead than a rollout of ``horizon_s`` seconds goes."""
    for criterion in plant.limits.criteria:
        needs = _bounded_s(criterion.formula.root)
        if needs > horizon_s:
            message = f"looks {needs:g} s ahead, but a rollout ends after {horizon_s:g} s"
            yield Code.CRITERION_WINDOW_BEYOND_HORIZON, f"criterion {criterion.name!r}", message


def _bounded_s(node: Node) -> float:
    """How many seconds ahead the bounded windows of a formula look; an unbounded one ends with the rollout."""
    below = max((_bounded_s(child) for child in children(node)), default=0.0)
    if isinstance(node, Always | Eventually | Until):
        return below + (node.high_s if node.high_s < math.inf else node.low_s)
    return below
