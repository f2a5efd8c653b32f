"""Vessels that a fault empties although no limit has a lower end for what they hold: nobody acts before that."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from homeostat.domain.lasting import lasting
from homeostat.domain.plant.limits import LimitKind
from homeostat.domain.plant.tag import Tag
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.finding import Finding, Severity, amount
from homeostat.knowledge.checks.intervals import bounds
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.term import Leaf, leaves

DRY: Final = 0.02
"""Share of what is in a vessel when a fault begins at which it counts as empty [1]."""


class _Emptied(NamedTuple):
    """A fault that empties a vessel."""

    fault: str
    was: float
    after_s: float


def emptied(bench: Bench) -> Iterator[Finding]:
    """Every reading of a vessel's content that comes to 0 under a fault, and that no limit keeps above something.

    A vessel that the plant empties by itself, as a batch does, is none of them.
    """
    for tag in _contents(bench):
        values = bench.quiet.true(tag.name)
        if _kept(bench, tag) or bench.quiet.broke or values.min() <= DRY * values.max():
            continue
        every = (_empties(bench, fault.name, tag) for fault in bench.plant.description.faults)
        found = [each for each in every if each]
        if not found:
            continue
        first = min(found, key=lambda each: each.after_s)
        more = f" ({len(found)} faults do)" if len(found) > 1 else ""
        what = (
            f"{first.fault!r} empties what {tag.name!r} shows, from {amount(first.was, tag.unit)} in "
            f"{lasting(first.after_s)}{more}, and no limit has a lower end for it: nobody acts before it is dry, "
            "and a recovery may leave it so"
        )
        remedy = (
            f"add a row such as '{tag.name} >= {0.2 * first.was:.2g}' to engineering/limits.csv with the fallback that "
            "serves it; where nothing keeps it filled, what must not go on then ('... or HEATER.pos <= 0.05'), or an "
            "envelope, which has a price"
        )
        place = bench.places.row("signals", tag=tag.name)
        yield Finding(Severity.WARNING, "faults", place, what, remedy)


def _contents(bench: Bench) -> tuple[Tag, ...]:
    """Tags that show what is in a vessel of the flowsheet, and nothing else of it."""
    model, d = bench.plant.model, bench.plant.description
    if not isinstance(model, ComposedModel):
        return ()
    sheet, tags = model.flowsheet, {signal.variable: signal.tag for signal in d.signals}
    moving = (Leaf.STATE, Leaf.HELD, Leaf.INPUT)
    shown = {name: {leaf for leaf in leaves(s.of) if leaf.op in moving} for name, s in sheet.sensors.items()}
    contents = [{sheet.states[name].term} for name in sheet.contents]
    return tuple(tags[name] for name, made_of in shown.items() if name in tags and made_of in contents)


def _kept(bench: Bench, tag: Tag) -> bool:
    """Whether some limit or criterion compares the tag with what it should be above."""
    limits = bench.plant.description.limits
    formulas = [x.formula for x in limits.limits if x.kind is not LimitKind.PERMISSIVE]
    formulas += [criterion.formula for criterion in limits.criteria]
    compared = (bound for formula in formulas for bound in bounds(formula.root))
    return any(bound.tag == tag.name and bound.operator in (">=", ">") for bound in compared)


def _empties(bench: Bench, name: str, tag: Tag) -> _Emptied | None:
    """How ``tag`` comes to 0 under the fault called ``name`` at its nominal severity; None where it does not."""
    fault = bench.plant.description.fault(name)
    course = bench.faulty(fault, fault.severity_nominal)
    late = course.after(bench.onset_s)
    if course.broke or not late.any():
        return None
    values, times_s = course.true(tag.name)[late], course.truth.times_s[late]
    was, dry = float(values[0]), values <= DRY * values[0]
    return _Emptied(name, was, float(times_s[int(np.argmax(dry))]) - bench.onset_s) if dry.any() else None
