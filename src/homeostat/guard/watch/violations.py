"""Violations: by how much a hard limit is kept or violated at one moment, and what is said of it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from homeostat.domain.plant.limits import Limit
from homeostat.domain.snapshot import Snapshot
from homeostat.stl.deciding import amount
from homeostat.stl.formula import Formula

Errors: TypeAlias = Mapping[str, float]
"""Tag -> reading minus truth, in the tag's unit."""
MOST_TOLD = 3
"""Most readings of one limit of which it is said why they have no value."""


@dataclass(frozen=True, slots=True)
class Violation:
    """One hard limit that is violated, or that cannot be judged any more."""

    limit: str
    """Name of the limit."""
    margin: float
    """Margin of the limit, in ``unit``, positive where it trips sooner; NaN where it cannot be judged."""
    unit: str
    """Unit of the margin."""
    reason: str
    """One sentence."""
    seen: bool = True
    """Whether anything has shown that it is violated; False where it only cannot be judged: then nobody knows."""
    jumped: bool = False
    """Whether it is violated only if a reading that has jumped was right before: no diagnosis knows of it."""


def margin_of(formula: Formula, values: Mapping[str, float]) -> float:
    """Margin at ``values``; NaN where it is undecided, or the formula is none for one point."""
    try:
        return formula.margin_at(values)
    except Exception:  # one broken rule must not keep the others from being watched
        return math.nan


def corrected_margin(formula: Formula, values: Mapping[str, float], errors: Errors) -> float:
    """Margin at ``values`` without ``errors``."""
    if errors.keys().isdisjoint(formula.tags):
        return margin_of(formula, values)
    return margin_of(formula, {tag: value - errors.get(tag, 0.0) for tag, value in values.items()})


def violation(limit: Limit, watched: float, values: Mapping[str, float]) -> Violation:
    """What ``watched``, the margin to where ``limit`` trips in its unit, says of it; the margin told is the limit's.

    ``values``: the readings, by tag, for the unit of what decides.
    """
    name, unit, margin = limit.name, limit.formula.unit, watched + limit.lead
    protects = f"{limit.description}: " if limit.description else ""
    text = f"{protects}{limit.formula.text!r}"
    if math.isnan(margin):
        return Violation(name, margin, unit, f"{text} cannot be judged now ({name})")
    size = _size(limit.formula, values, margin)
    if watched < 0.0 <= margin:
        lead = f"it trips {limit.lead:.4g} {unit} before it is violated"
        return Violation(name, margin, unit, f"{text} holds by no more than {size}; {lead} ({name})")
    if margin >= 0.0:
        return Violation(name, margin, unit, f"{text} was violated and holds by no more than {size} ({name})")
    return Violation(name, margin, unit, f"{text} is violated by {size} ({name})")


def unreadable(formula: Formula, readings: Snapshot | None) -> str:
    """Why ``formula`` cannot be judged on ``readings``: which tags have no value, and since when one stands still."""
    if readings is None:
        return "no sample has come"
    lacking = [t for t in sorted(formula.tags) if t in readings.bad or math.isnan(readings.values.get(t, math.nan))]
    found = []
    for tag in lacking[:MOST_TOLD]:
        why = readings.reasons.get(tag, f"{tag!r} has no value")
        found.append(f"{why} since {readings.frozen_s[tag]:g} s" if tag in readings.frozen_s else why)
    more = len(lacking) - len(found)
    return "; ".join((*found, f"and {more} more") if more else found) or "its formula gives no value"


def _size(formula: Formula, values: Mapping[str, float], margin: float) -> str:
    """How large ``margin`` is, in a unit that people know."""
    try:
        return amount(formula, values, margin)
    except Exception:  # a reading that is missing must not keep a violation from being told
        return f"{abs(margin):.4g} {formula.unit}"
