"""Margins: how near the twin comes to each limit, in a unit that an instrument shows, and what came of it."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from homeostat.console.card.card import PredictedMargin
from homeostat.console.opened import KnownPlant
from homeostat.console.readings import Readings, Values
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.limits import Criterion, Limit, LimitKind
from homeostat.domain.verdict import Finding
from homeostat.record.releases import Release
from homeostat.record.run_record import RunRecord
from homeostat.stl.deciding import Deciding, decided
from homeostat.stl.formula import Formula, FormulaError
from homeostat.stl.text import render
from homeostat.stl.tree import Always
from homeostat.stl.widest import Span, widest

_NEAR = 0.5
"""Less than this share of what counts as one unit of margin, and of what could be, is near [1]."""
_SAME = 1e-6
"""Margins that differ by less than this share are the same [1]."""


def predicted_margins(findings: Iterable[Finding], plant: PlantDescription) -> tuple[PredictedMargin, ...]:
    """Findings on limits and criteria, the nearest one first; permissives and targets are no margins to watch.

    What is as good as it can be comes last: it is not what may go wrong next.
    """
    known: dict[str, Limit | Criterion] = {c.name: c for c in plant.limits.criteria}
    known |= {x.name: x for x in plant.limits.limits if x.kind is not LimitKind.PERMISSIVE}
    ranges = {tag.name: (tag.range.low, tag.range.high) for tag in plant.tags}
    found = []
    for finding in findings:
        limit = known.get(finding.criterion)
        if limit is not None and math.isfinite(finding.margin):
            found.append(_margin(finding, limit, finding.relative(plant.scales), ranges))
    return tuple(sorted(found, key=lambda margin: (margin.full, margin.scaled)))


def _margin(finding: Finding, limit: Limit | Criterion, scaled: float, ranges: Mapping[str, Span]) -> PredictedMargin:
    most = [widest(limit.formula, ranges)]
    most += [widest(limit.watched, ranges)] if isinstance(limit, Limit) and limit.lead else []
    spare = _SAME * max(1e-3, abs(finding.margin))
    full = finding.margin >= most[0] - spare or any(abs(finding.margin - best) <= spare for best in most)
    near = not full and 0.0 <= finding.margin < _NEAR * max(most) and scaled < _NEAR
    told = finding.deciding or Deciding("", finding.margin, finding.unit)
    place = told.margin, told.unit, finding.at_s, finding.member, scaled
    return PredictedMargin(
        limit.name, limit.description, limit.formula.text, *place, limit.hard, told.comparison, full, near
    )


def with_actual(
    margins: Iterable[PredictedMargin],
    released: Release,
    record: RunRecord,
    plant: KnownPlant,
    seen: tuple[Readings, float],
) -> tuple[PredictedMargin, ...]:
    """Beside each prediction what the readings have come to since the release, as long as it was predicted for."""
    readings, at_s = seen
    later = [r.at_s for r in record.releases if r.at_s > released.at_s]
    later += [fell_s for fell_s, _ in record.fallbacks if fell_s > released.at_s]
    until_s = min([at_s, released.at_s + (plant.horizon_s or math.inf), *later])
    limits = plant.description.limits
    formulas = {c.name: c.formula for c in limits.criteria} | {x.name: x.formula for x in limits.limits}
    made = []
    for margin in margins:
        actual = _least(formulas[margin.name], readings, (released.at_s, until_s))
        made.append(margin if actual is None else _beside(margin, *actual))
    return tuple(made)


def _beside(margin: PredictedMargin, told: Deciding, at_s: float) -> PredictedMargin:
    """``margin`` with what was read; as the record has it where that does not say which comparison decides."""
    return replace(margin, actual=told.margin, actual_unit=told.unit, actual_term=told.comparison, actual_at_s=at_s)


def _least(formula: Formula, readings: Readings, span: tuple[float, float]) -> tuple[Deciding, float] | None:
    """Least margin of the readings in ``span`` [s], and when it was; None where there is none yet.

    Of a formula ``always[a,b] f`` it is that of ``f`` from ``a`` to ``b`` after the beginning.
    """
    from_s, to_s = span
    if isinstance(formula.root, Always):
        inner = formula.root
        from_s, to_s = from_s + inner.low_s, min(to_s, from_s + inner.high_s)
        formula = Formula(render(inner.operand), inner.operand, formula.unit)
    part = readings.between(from_s, to_s)
    times = readings.times_s[part]
    if not times.size or (math.isfinite(formula.horizon_s) and formula.horizon_s > 0.0):
        return None
    signals: dict[str, Values] = {tag: values[part] for tag, values in readings.signals.items() if tag in formula.tags}
    try:
        margins = formula.margins(signals, readings.dt_s)[0]
    except FormulaError:
        return None
    if not np.isfinite(margins).any():
        return None
    least = int(np.nanargmin(margins))
    told, values = float(margins[least]), {tag: float(column[least]) for tag, column in signals.items()}
    return decided(formula, values, told) or Deciding("", told, formula.unit), float(times[least])
