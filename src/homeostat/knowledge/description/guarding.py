"""What the guard needs: when readings are good or bad, how limits are watched and tags written, and start-up."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from pyoxigraph import NamedNode

from homeostat.domain.mode import Side
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.rules import QualityRule, StartUp, TripRule, WriteRule
from homeostat.domain.plant.tag import Tag
from homeostat.domain.plant.timing import REFERENCE, Timing
from homeostat.knowledge.description.entry import Entry, entries, unique
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.store.store import GraphStore

TIMES_S: Final[Mapping[str, tuple[float, float]]] = {
    "stale_s": (1.0, 60.0),
    "frozen_s": (3.0, 60.0),
    "every_s": (1.0, 86_400.0),
    "grace_s": (0.0, 60.0),
    "confirm_s": (1.0, 60.0),
    "lift_s": (0.0, 1800.0),
    "start_up_s": (1.0, 86_400.0),
    "acts_within_s": (3.0, 600.0),
    "asks_after_s": (60.0, 14_400.0),
}
"""Column -> shortest and longest time that can be meant, of the reference plant, sampled once per second [s]."""
_OF_THE_PLANT: Final = frozenset({"lift_s", "start_up_s", "acts_within_s", "asks_after_s"})
"""Those that go by how fast the plant is; the others go by its samples."""
_OF_ITS_SAMPLES: Final[Mapping[str, tuple[bool, bool]]] = {"frozen_s": (True, True), "stale_s": (False, True)}
"""Those of an instrument that go by its own samples, and whether the shortest and the longest time do: whether one is
there may be known each tick."""
_MAY_BE_ZERO: Final = frozenset({"grace_s", "cusum", "lead", "lift", "lift_s", "tolerance", "rest"})


def times_s(column: str, timing: Timing, every_s: float | None = None) -> tuple[float, float]:
    """The shortest and the longest time that can be meant in ``column`` for a plant of this ``timing`` [s].

    ``every_s``: time between two samples of the instrument that it is about [s]; None for one of each tick.
    """
    low, high = TIMES_S[column]
    if column in _OF_THE_PLANT:
        return low * timing.stretch, high * timing.stretch
    own = _OF_ITS_SAMPLES.get(column, (False, False))
    shortest_s, longest_s = (timing.sampling_s(every_s) if by_samples else timing.tick_s for by_samples in own)
    return low * shortest_s, high * longest_s


def qualities(store: GraphStore, system: NamedNode, timing: Timing) -> Mapping[str, QualityRule]:
    """Tag -> when its reading is good, uncertain or bad."""
    rules = (_quality(entry, timing) for entry in unique(entries(store, "plant_qualities", "quality of tag", system)))
    return {rule.tag: rule for rule in rules}


def _quality(entry: Entry, timing: Timing) -> QualityRule:
    every_s, stale_s = optional_bounded(entry, "every_s", timing), entry.number("stale_s")
    frozen_s = entry.optional_number("frozen_s")
    return QualityRule(
        tag=entry.reference("tag", Code.UNKNOWN_TAG),
        stale_s=_within(entry, "stale_s", stale_s, times_s("stale_s", timing, every_s)),
        noise=optional_bounded(entry, "noise"),
        frozen_s=None
        if frozen_s is None
        else _within(entry, "frozen_s", frozen_s, times_s("frozen_s", timing, every_s)),
        fastest=optional_bounded(entry, "fastest"),
        grace_s=bounded_number(entry, "grace_s", timing),
        every_s=every_s,
    )


def trips(store: GraphStore, system: NamedNode, tags: Mapping[str, Tag], timing: Timing) -> Mapping[str, TripRule]:
    """Name of a hard limit -> how it is watched; carriers are read over ``tags``."""
    return {
        (limit := entry.reference("limit", Code.UNKNOWN_LIMIT)): TripRule(
            limit=limit,
            cusum=bounded_number(entry, "cusum"),
            grace_s=bounded_number(entry, "grace_s", timing),
            carrier=entry.optional_formula("carrier", tags),
            lift=bounded_number(entry, "lift"),
            lift_s=bounded_number(entry, "lift_s", timing),
            fastest=entry.optional_expression("fastest", tags),
            fallen=entry.optional_formula("fallen", tags),
        )
        for entry in unique(entries(store, "plant_trips", "trip of limit", system))
    }


def writables(store: GraphStore, system: NamedNode, timing: Timing) -> Mapping[str, WriteRule]:
    """Tag -> how it is commanded."""
    return {
        (tag := entry.reference("tag", Code.UNKNOWN_TAG)): WriteRule(
            tag=tag,
            tolerance=bounded_number(entry, "tolerance"),
            confirm_s=bounded_number(entry, "confirm_s", timing),
            fastest=optional_bounded(entry, "fastest"),
            ramped_by=entry.word("ramped_by", Side),
            automatic=entry.flag("automatic"),
        )
        for entry in unique(entries(store, "plant_writables", "writable tag", system))
    }


def start_up(store: GraphStore, system: NamedNode, tags: Mapping[str, Tag], limits: Limits, timing: Timing) -> StartUp:
    """The states of start-up, what holds in them instead of some of ``limits``, and for how long."""
    stated = {limit.name: limit for limit in limits.limits}
    states = entries(store, "plant_start_up_states", "state", system)
    replaced = {}
    for entry in unique(entries(store, "plant_start_up_limits", "start-up limit", system)):
        name = entry.reference("limit", Code.UNKNOWN_LIMIT)
        if name not in stated:
            raise GraphError(Code.UNKNOWN_LIMIT, entry.thing, "is a criterion; start-up replaces limits only")
        formula, source = entry.formula("formula", tags), entry.text("source")
        words = entry.words("description")
        # What leads a limit in operation says nothing of another one, which may be in another unit.
        replaced[name] = replace(stated[name], formula=formula, source=source, description=words, lead=0.0)
    longest_s = {entry.name: bounded_number(entry, "start_up_s", timing) for entry in states if entry.flag("start_up")}
    return StartUp(frozenset(longest_s), replaced, longest_s)


def bounded_number(entry: Entry, column: str, timing: Timing = REFERENCE) -> float:
    """A number that must be there, inside the bounds of its column."""
    return _bounded(entry, column, entry.number(column), timing)


def optional_bounded(entry: Entry, column: str, timing: Timing = REFERENCE) -> float | None:
    """A number inside its bounds, or None."""
    value = entry.optional_number(column)
    return None if value is None else _bounded(entry, column, value, timing)


def _bounded(entry: Entry, column: str, value: float, timing: Timing) -> float:
    return _within(entry, column, value, times_s(column, timing) if column in TIMES_S else (0.0, math.inf))


def _within(entry: Entry, column: str, value: float, ends: tuple[float, float]) -> float:
    least, most = ends
    if not least <= value <= most or (value == 0.0 and column not in _MAY_BE_ZERO):
        low = f">= {least:g}" if least or column in _MAY_BE_ZERO else "> 0"
        high = "" if math.isinf(most) else f" and <= {most:g} s"
        raise GraphError(Code.BAD_NUMBER, entry.thing, f"{column} {value:g} must be {low}{high}; correct the cell")
    return value
