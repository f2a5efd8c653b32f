"""Instruments that take samples, and those that limits rest on: does anybody notice one that freezes?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from homeostat.domain.plant.description import PlantDescription, Relation
from homeostat.domain.plant.rules import QualityRule
from homeostat.domain.plant.tag import Role
from homeostat.evaluate.lint.finding import Finding, Place, Severity
from homeostat.evaluate.lint.places import Places
from homeostat.knowledge.build.tables.reading import FOLDER
from homeostat.process.model import ProcessModel

_TABLE: Final = f"{FOLDER}/quality.csv"


def otherwise_sampled(plant: PlantDescription, model: ProcessModel, places: Places) -> Iterator[Finding]:
    """Instruments that show something new at other times than the tables say; a kernel of its own tells none."""
    shown: Mapping[str, float] | None = getattr(model, "sampled", None)
    if shown is None:
        return
    for signal in plant.signals:
        rule = plant.qualities.get(signal.tag.name)
        if rule is None or signal.relation is not Relation.MEASURES:
            continue
        own_s, stated_s = map(plant.timing.sampling_s, (shown.get(signal.variable), rule.every_s))
        if own_s != stated_s:
            yield _otherwise(rule, own_s, stated_s, places)


def _otherwise(rule: QualityRule, own_s: float, stated_s: float, places: Places) -> Finding:
    place = places.row("signals", tag=rule.tag)
    doubted = rule.frozen_s is not None and rule.frozen_s <= own_s
    what = (
        f"the instrument of {rule.tag!r} shows something new every {own_s:g} s in the model, {stated_s:g} s are stated"
    )
    what += f": frozen after {rule.frozen_s:g} s, it is bad most of the time" if doubted else ""
    quality = places.row("quality", tag=rule.tag)
    emptied = rule.frozen_s is None and quality.file == _TABLE
    also = f" and remove what {quality} leaves empty, so that one that freezes is noticed"
    remedy = f"state every_s {own_s:g} in its row of instruments.csv (or quality.csv){also if emptied else ''}"
    return Finding(Severity.ERROR if doubted else Severity.WARNING, "readings", place, what, remedy)


def unjudged(plant: PlantDescription, places: Places) -> Iterator[Finding]:
    """Hard limits whose instruments may all freeze without anybody noticing, and that nothing else carries."""
    for limit in plant.limits.hard:
        trip = plant.trips.get(limit.name)
        read = sorted(tag for tag in limit.formula.tags if plant.tag(tag).role is Role.PV)
        rules = [plant.qualities[tag] for tag in read if tag in plant.qualities]
        if not rules or trip is None or trip.carrier is not None or any(r.frozen_s is not None for r in rules):
            continue
        named = " and ".join(repr(rule.tag) for rule in rules)
        what = (
            f"'{limit.formula}' rests on {named} alone, and no frozen_s says when that is frozen: one that freezes "
            "holds the limit on paper, whatever the plant does"
        )
        remedy = _remedy(rules, places)
        yield Finding(Severity.WARNING, "readings", places.row("limits", id=limit.name), what, remedy)


def _remedy(rules: list[QualityRule], places: Places) -> str:
    where: Place = places.row("quality", tag=rules[0].tag)
    return (
        f"give it noise and frozen_s ({where}; they follow from noise and every_s in instruments.csv where no row "
        "leaves them empty), or name in trips.csv a carrier that reads another instrument"
    )
