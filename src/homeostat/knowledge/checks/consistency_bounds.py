"""Are the numbers of the guard's tables of a size that the ranges of the tags and the tick of the plant allow?

A number that is far too large or too small disarms what it belongs to as surely as a missing row. The schemas of the
tables bound times; what is in the unit of a tag or of a margin is bounded here, by what the instruments can show.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import Final

from homeostat.domain.diagnosis import Feature
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.tag import Tag
from homeostat.domain.plant.timing import Timing
from homeostat.knowledge.checks.consistency_rules import momentary, ranges_of
from homeostat.knowledge.checks.intervals import Interval, Intervals, span
from homeostat.knowledge.checks.reach import comparisons, deepest, ends
from homeostat.knowledge.store.error import Code, Found
from homeostat.stl.formula import Formula
from homeostat.stl.text import render
from homeostat.stl.tree import Not
from homeostat.stl.units import in_unit

WORST_TICKS: Final = 0.5
"""The worst violation that instruments can show trips in half a tick, and a tenth of it in 5 ticks."""
SCALE_TICKS: Final = 20.0
"""A violation by one scale of the limit's tags trips in so many ticks."""
LARGEST_LIFT: Final = 0.15
"""Share of what a limit's reading can vary by that a correction may take from it [1]."""
LARGEST_LEAD: Final = 0.5
"""Share of the largest margin of a limit that instruments can show at which it may trip before it is violated [1]."""
LARGEST_REST: Final = 0.5
"""Share of the worst violation that can be shown at which a fallback may leave a limit [1]."""
MOST_SCALES: Final = 20.0
"""Scales of the limit's tags at which a fallback may leave it [1]."""
NOISE: Final = (1e-6, 0.02)
"""Shares of a tag's range between which the noise of its reading lies [1]."""
SLOWEST_S: Final = 86_400.0
"""No process and no ramp takes longer than this through the range of a tag, by the reference [s]; what goes through
it in less than a tick is not limited at all."""
LARGEST_TOLERANCE: Final = 0.02
"""Share of a tag's range by which a target may differ from its command [1]."""
LARGEST_THRESHOLD: Final = 0.5
"""Share of what a feature can vary by that may count as nothing [1]."""
_SAME: Final = 1e-9
"""Share of a tag's range by which two values differ that are written differently and mean the same [1]."""

_DIGITS: Final = 1e-5
"""Share of a number by which it may be beyond its bound [1]: what follows from tables is written with six digits."""


def trips(plant: PlantDescription) -> Found:
    """What trips, and what may be lifted, is small beside what the instruments of a limit can show."""
    ranges = ranges_of(plant)
    for name, rule in sorted(plant.trips.items()):
        thing = f"trip of limit {name!r}"
        for formula in _watched(plant, name):
            unit, (most, why) = formula.unit, _slowest(plant, formula, ranges)
            if rule.cusum > most * (1.0 + _DIGITS):
                yield _too_much(thing, "trips.csv, cusum", rule.cusum, most, f"{unit} s", why)
        yield from _lift(plant, name, rule.lift)
    for limit in plant.limits.hard:
        most = LARGEST_LEAD * _largest_margin(limit.formula, ranges) if limit.lead else 0.0
        if limit.lead > most:
            thing, why = f"trip of limit {limit.name!r}", f"{LARGEST_LEAD:.0%} of the largest margin that can be shown"
            yield _too_much(thing, "trips.csv, lead", limit.lead, most, limit.formula.unit, why)


def _largest_margin(formula: Formula, ranges: Intervals) -> float:
    """By how much a rule about one moment can hold at most, in the unit of its margin; 0 for any other."""
    opposite = Not(formula.root)
    return deepest(Formula(render(opposite), opposite, formula.unit), ranges) if _judgeable(formula) else 0.0


def _lift(plant: PlantDescription, name: str, lift: float) -> Found:
    """A correction takes a small part of what a limit's reading can vary by; none is taken in start-up."""
    formula = next((limit.formula for limit in plant.limits.hard if limit.name == name), None)
    if formula is None or lift <= (most := LARGEST_LIFT * _variation(formula, ranges_of(plant))):
        return
    why = f"{LARGEST_LIFT:.0%} of what the reading can vary by"
    yield _too_much(f"trip of limit {name!r}", "trips.csv, lift", lift, most, formula.unit, why)


def effects(plant: PlantDescription) -> Found:
    """What a fallback may leave of a violation is less than what the instruments can show."""
    ranges = ranges_of(plant)
    formulas = {limit.name: limit.formula for limit in plant.limits.hard}
    for strategy in plant.fallback_strategies:
        for name, effect in sorted(strategy.serves.items()):
            if name in formulas and _judgeable(formulas[name]):
                most, why = _resting(plant, formulas[name], ranges)
                if effect.rest > most:
                    thing, unit = f"fallback {strategy.name!r}, limit {name!r}", formulas[name].unit
                    yield _too_much(thing, "fallback_limits.csv, rest", effect.rest, most, unit, why)


def readings(plant: PlantDescription) -> Found:
    """Noise and speed of a reading fit the range of its tag; a step that is too fast is doubted for some time."""
    for name, rule in sorted(plant.qualities.items()):
        tag, thing = plant.tag(name), f"quality of tag {name!r}"
        if rule.noise is not None:
            least, most = (share * tag.range.span for share in NOISE)
            yield from _within(thing, "quality.csv, noise", rule.noise, (least, most), tag, tag.unit)
        if rule.fastest is not None:
            yield from _speed(thing, "quality.csv, fastest", rule.fastest, tag, plant.timing)
            if rule.grace_s == 0.0:
                message = "quality.csv, grace_s 0 s doubts no step that is faster than fastest; give it some seconds"
                yield Code.BAD_NUMBER, thing, message


def commands(plant: PlantDescription) -> Found:
    """Ramps end, and no tolerance takes one commanded value for another."""
    for tag in plant.tags:
        if tag.rate_limit is not None:
            yield from _speed(f"tag {tag.name!r}", "signals.csv, rate_limit", tag.rate_limit, tag, plant.timing)
    for strategy in plant.fallback_strategies:
        for command in strategy.actions.commands:
            tag = plant.tag(command.tag)
            if command.value is not None and command.rate is not None:
                yield from _speed(f"fallback {strategy.name!r}", "fallbacks.csv, rate", command.rate, tag, plant.timing)
    for name, rule in sorted(plant.writables.items()):
        tag, thing = plant.tag(name), f"writable tag {name!r}"
        if rule.fastest is not None:
            yield from _speed(thing, "writables.csv, fastest", rule.fastest, tag, plant.timing)
        if rule.tolerance > (most := LARGEST_TOLERANCE * tag.range.span):
            why = f"{LARGEST_TOLERANCE:.0%} of its range"
            yield _too_much(thing, "writables.csv, tolerance", rule.tolerance, most, tag.unit, why)
        values = sorted(_commanded(plant, name))
        gaps = [(b - a, a, b) for a, b in pairwise(values) if b - a > _SAME * tag.range.span]
        if gaps and rule.tolerance >= (least := min(gaps))[0] / 2.0:
            told = f"{least[1]:g} and {least[2]:g}{in_unit(tag.unit)} are both commanded"
            message = (
                f"writables.csv, tolerance {rule.tolerance:g}{in_unit(tag.unit)} is not less than {least[0] / 2.0:g}"
            )
            yield Code.BAD_NUMBER, thing, f"{message}{in_unit(tag.unit)}: {told}, and must be told apart; lower it"


def symptoms(plant: PlantDescription) -> Found:
    """A symptom can show itself: its threshold is less than what its feature can be."""
    ranges = ranges_of(plant)
    features = {feature.name: feature for feature in plant.features}
    for rule in plant.symptom_rules:
        feature = features[rule.feature]
        low, high = _shown(feature, ranges)
        if rule.threshold > (most := LARGEST_THRESHOLD * (high - low)):
            thing, why = f"symptom {rule.name!r}", f"{LARGEST_THRESHOLD:.0%} of what {rule.feature!r} can vary by"
            yield _too_much(thing, "symptoms.csv, threshold", rule.threshold, most, feature.unit, why)


def _shown(feature: Feature, ranges: Intervals) -> Interval:
    """Ends between which a feature lies; a balance is what was stored less what came in over its window."""
    low, high = span(feature.expression.root, ranges)
    if feature.accumulation is None:
        return (low, high)
    least, most = span(feature.accumulation.root, ranges)
    return (least - most - high * feature.window_s, most - least - low * feature.window_s)


def _slowest(plant: PlantDescription, formula: Formula, ranges: Intervals) -> tuple[float, str]:
    """The largest cusum of a limit, in the unit of its margin times s, and why."""
    worst, scale, unit = deepest(formula, ranges), _scale(plant, formula), formula.unit
    scale_s, worst_s = SCALE_TICKS * plant.timing.tick_s, WORST_TICKS * plant.timing.tick_s
    if scale_s * scale < worst_s * worst:
        return (
            scale_s * scale,
            f"at which a violation by {scale:g}{in_unit(unit)}, the scale of its tags, lasts {scale_s:g} s",
        )
    return (
        worst_s * worst,
        f"at which the worst violation that can be shown, {worst:g}{in_unit(unit)}, lasts {worst_s:g} s",
    )


def _resting(plant: PlantDescription, formula: Formula, ranges: Intervals) -> tuple[float, str]:
    """The largest violation at which a fallback may leave a limit, in the unit of its margin, and why."""
    worst, scale = LARGEST_REST * deepest(formula, ranges), MOST_SCALES * _scale(plant, formula)
    if scale < worst:
        return scale, f"{MOST_SCALES:g} times the scale of its tags"
    return worst, f"{LARGEST_REST:.0%} of the worst violation that can be shown"


def _scale(plant: PlantDescription, formula: Formula) -> float:
    """What counts as one in the margin of a rule; where it mixes units, its margin is divided by that already."""
    tags = [plant.tag(name) for name in formula.tags]
    return max((tag.scale for tag in tags), default=1.0) if len({tag.unit for tag in tags}) == 1 else 1.0


def _watched(plant: PlantDescription, name: str) -> Iterator[Formula]:
    """What is watched under the name of a hard limit: in operation, and in start-up."""
    yield from (limit.formula for limit in plant.limits.hard if limit.name == name and _judgeable(limit.formula))
    if name in plant.start_up.limits and _judgeable(plant.start_up.limits[name].formula):
        yield plant.start_up.limits[name].formula


def _judgeable(formula: Formula) -> bool:
    """Whether it is about one moment; one that looks ahead is refused as such."""
    return not any(momentary("", "", formula))


def _variation(formula: Formula, ranges: Intervals) -> float:
    """By how much the least of the comparisons of a rule can vary, in the unit of its margin."""
    found = [(ends(c, holds, ranges), c.scale) for c, holds in comparisons(formula.root)]
    return min(((high - low) / scale for (low, high), scale in found), default=0.0)


def _commanded(plant: PlantDescription, name: str) -> set[float]:
    """Values of a tag that states or fallbacks command; the one of a row that admits automatic alone is none."""
    rows = [row for state in plant.machine.states for row in state.setpoints if row.tag == name]
    rows = [row for row in rows if row.design is not None or row.low < row.high]
    steps = [c for f in plant.fallback_strategies for c in f.actions.commands if c.tag == name]
    values = {value for row in rows for value in (row.low, row.high, row.design)} | {step.value for step in steps}
    return {value for value in values if value is not None}


def _too_much(thing: str, column: str, value: float, most: float, unit: str, why: str) -> tuple[Code, str, str]:
    message = f"{column} {value:g}{in_unit(unit)} is more than {most:g}{in_unit(unit)}, {why}; lower it"
    return Code.BAD_NUMBER, thing, message


def _speed(thing: str, column: str, value: float, tag: Tag, timing: Timing) -> Found:
    """A speed that takes from a tick to a day, or what is one for a slow plant, through the range of its tag."""
    allowed = (tag.range.span / (SLOWEST_S * max(timing.stretch, 1.0)), tag.range.span / timing.tick_s)
    yield from _within(thing, column, value, allowed, tag, f"{tag.unit}/s")


def _within(thing: str, column: str, value: float, allowed: tuple[float, float], tag: Tag, unit: str) -> Found:
    if not allowed[0] * (1.0 - _DIGITS) <= value <= allowed[1] * (1.0 + _DIGITS):
        message = f"{column} {value:g}{in_unit(unit)} is outside {allowed[0]:g} to {allowed[1]:g}{in_unit(unit)}"
        about = f"what the range of {tag.name!r}, {tag.range.low:g} to {tag.range.high:g}{in_unit(tag.unit)}, allows"
        yield Code.BAD_NUMBER, thing, f"{message}, {about}; correct the cell"
