"""Can the guard watch the plant by these tables: every hard limit, every reading, and start-up?"""

from collections.abc import Iterator

from homeostat.domain.plant.description import PlantDescription, Relation
from homeostat.domain.plant.limits import Limit, LimitKind
from homeostat.domain.plant.rules import TripRule
from homeostat.domain.plant.tag import Role
from homeostat.knowledge.checks.consistency_rules import judged, momentary, ranges_of, violable
from homeostat.knowledge.checks.intervals import span
from homeostat.knowledge.store.error import Code, Found
from homeostat.stl.formula import Expression, Formula


def trips(plant: PlantDescription) -> Found:
    """Every hard limit is watched, nothing else is, and what carries one does not fail together with it."""
    hard = {limit.name: limit for limit in plant.limits.hard}
    for limit in plant.limits.of_kind(LimitKind.TRIP_LIMIT):
        if not limit.hard:
            message = "is a trip limit that is not hard, so nobody would trip; make it hard, or an envelope"
            yield Code.LIMIT_NOT_WATCHED, f"limit {limit.name!r}", message
    for name in sorted(hard.keys() - plant.trips.keys()):
        message = "is hard, but no row of the trip table says how it is watched; add one"
        yield Code.LIMIT_NOT_WATCHED, f"limit {name!r}", message
    for name, rule in sorted(plant.trips.items()):
        thing = f"trip of limit {name!r}"
        if name not in hard:
            yield Code.UNKNOWN_LIMIT, thing, "is not a hard limit, so it cannot trip; remove the row or make it hard"
        else:
            yield from _seen(plant, f"limit {name!r}", hard[name].formula)
            for carrier in filter(None, (rule.carrier, rule.fallen)):
                yield from _carrier(plant, thing, hard[name], carrier)
            if rule.fastest is not None:
                yield from _fastest(plant, thing, hard[name], rule.fastest)
        yield from _lift(thing, rule)


def _seen(plant: PlantDescription, thing: str, formula: Formula) -> Found:
    """A rule about what the plant does must read something that the plant shows, not only what it is told."""
    if formula.tags and not any(plant.tag(name).role in (Role.PV, Role.STATUS) for name in formula.tags):
        message = f"'{formula}' reads commands only, so nothing that the plant does violates it; read a measured tag"
        yield Code.LIMIT_NEVER_VIOLATED, thing, message


def _carrier(plant: PlantDescription, thing: str, limit: Limit, carrier: Formula) -> Found:
    ranges = ranges_of(plant)
    yield from momentary(thing, "carrier", carrier)
    yield from judged(plant, thing, carrier, ranges)
    yield from violable(plant, thing, carrier)
    yield from _seen(plant, thing, carrier)
    for tag in sorted(carrier.tags & _dependent(plant, limit)):
        message = f"its carrier reads {tag!r}, which is what it should stand in for; use another instrument"
        yield Code.CARRIER_READS_LIMIT, thing, message


def _fastest(plant: PlantDescription, thing: str, limit: Limit, fastest: Expression) -> Found:
    """A margin that may fall as fast as it likes is believed at once, and one that may not fall at all never is."""
    for tag in sorted(fastest.tags - plant.qualities.keys()):
        message = f"reads {tag!r}, but no row of the quality table says when its reading may be believed; add one"
        yield Code.READING_NOT_RATED, thing, message
    if not fastest.tags - plant.qualities.keys():
        _, most = span(fastest.root, ranges_of(plant))
        if not most > 0.0:
            message = f"fastest '{fastest}' is never more than {most:g} {limit.formula.unit}/s; no reading is believed"
            yield Code.BAD_NUMBER, thing, message


def _dependent(plant: PlantDescription, limit: Limit) -> frozenset[str]:
    """Tags that ``limit`` reads, and those that a controller works out from one of them."""
    controllers = {loop.controller for loop in plant.loops if loop.process_variable in limit.formula.tags}
    outputs = {loop.manipulated_variable for loop in plant.loops if loop.process_variable in limit.formula.tags}
    reported = {s.tag.name for s in plant.signals if s.relation is Relation.REPORTS and s.component in controllers}
    return limit.formula.tags | reported | outputs


def _lift(thing: str, rule: TripRule) -> Found:
    if (rule.lift > 0.0) != (rule.lift_s > 0.0):
        message = f"lift {rule.lift:g} for lift_s {rule.lift_s:g} s lifts nothing; give both a value > 0, or both 0"
        yield Code.LIFT_WITHOUT_CARRIER, thing, message
    if rule.lift > 0.0 and rule.carrier is None:
        message = f"may be lifted for {rule.lift_s:g} s although nothing carries the limit; state a carrier or lift 0"
        yield Code.LIFT_WITHOUT_CARRIER, thing, message


def readings(plant: PlantDescription) -> Found:
    """Every tag that a rule reads has a quality; and what may be called frozen is noisy."""
    for thing, formula in _rules(plant):
        for tag in sorted(formula.tags - plant.qualities.keys()):
            message = f"reads {tag!r}, but no row of the quality table says when its reading may be believed; add one"
            yield Code.READING_NOT_RATED, thing, message
    for name, rule in sorted(plant.qualities.items()):
        if rule.frozen_s is not None and rule.noise is None:
            message = f"is frozen after {rule.frozen_s:g} s, but has no noise: a constant reading may be true"
            yield Code.FROZEN_WITHOUT_NOISE, f"quality of tag {name!r}", message


def _rules(plant: PlantDescription) -> Iterator[tuple[str, Formula]]:
    """What the guard judges on readings, with its name for messages."""
    yield from ((f"limit {limit.name!r}", limit.formula) for limit in plant.limits.limits)
    yield from ((f"trip of limit {name!r}", r.carrier) for name, r in sorted(plant.trips.items()) if r.carrier)
    yield from ((f"trip of limit {name!r}", r.fallen) for name, r in sorted(plant.trips.items()) if r.fallen)
    yield from ((f"start-up limit {name!r}", r.formula) for name, r in sorted(plant.start_up.limits.items()))
    yield from ((f"transition {t.name!r}", t.guard) for t in plant.machine.transitions)


def start_up(plant: PlantDescription) -> Found:
    """What holds during start-up: instead of hard limits only, and such that it can hold and fail."""
    hard, ranges = {limit.name for limit in plant.limits.hard}, ranges_of(plant)
    for name, limit in sorted(plant.start_up.limits.items()):
        thing = f"start-up limit {name!r}"
        if name not in hard:
            yield Code.UNKNOWN_LIMIT, thing, "is not a hard limit; start-up replaces hard limits only"
        yield from momentary(thing, "start-up limit", limit.formula)
        yield from judged(plant, thing, limit.formula, ranges)
        yield from violable(plant, thing, limit.formula)
        yield from _seen(plant, thing, limit.formula)


def effects(plant: PlantDescription) -> Found:
    """Every hard limit is brought back by some fallback, and nothing else is."""
    hard = {limit.name for limit in plant.limits.hard}
    served = {name for strategy in plant.fallback_strategies for name in strategy.serves}
    for strategy in plant.fallback_strategies:
        for name in sorted(strategy.serves.keys() - hard):
            message = f"serves {name!r}, which is not a hard limit; remove the row or make the limit hard"
            yield Code.UNKNOWN_LIMIT, f"fallback {strategy.name!r}", message
    for name in sorted(hard - served) if plant.fallback_strategies else ():
        message = "is hard, but no row of the table of fallback limits says which fallback brings it back; add one"
        yield Code.LIMIT_NOT_SERVED, f"limit {name!r}", message
