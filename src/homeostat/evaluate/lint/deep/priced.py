"""Soft criteria and envelopes that nothing notices: every run pays for them, and nobody is told.

One is noticed where a symptom's feature reads what it is about and the symptom comes no later than the violation, or
where a fault violates it and shows a symptom. What only commands cost, as the wear of a valve, nobody has to notice.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from homeostat.domain.diagnosis import Feature, SymptomRule
from homeostat.domain.plant.description import ControlLoop, Relation
from homeostat.domain.plant.limits import Criterion, Limit
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.symptoms import Shown
from homeostat.evaluate.lint.finding import Finding, Severity, amount

STEPS: Final = 400
"""Values of a reading, over its range, of which each is tried whether a criterion is missed there."""
LATE: Final = 0.2
"""Share of the healthy course, at its end, that the plant's usual values are taken from [1]."""
SAME: Final = 1e-6
"""By how much a control error may differ from what its loop says, as a share of the tag's range [1]."""

Rule: TypeAlias = Criterion | Limit


class _Nearest(NamedTuple):
    """The symptom that comes first where one reading goes to where a criterion is missed."""

    symptom: str
    reach: float
    """Its deviation there, in thresholds."""
    tag: str
    value: float
    """Where the criterion begins to be missed."""


def unnoticed(bench: Bench, shown: Mapping[str, Mapping[str, Shown]]) -> Iterator[Finding]:
    """What is priced and not noticed; ``shown``: fault -> symptom -> what it made of its course."""
    course, d = bench.quiet, bench.plant.description
    if course.broke or not np.isfinite(course.settled_s):
        return
    for rule in d.limits.priced:
        price = bench.plant.prices.outside.get(rule.name, 0.0)
        about = _about(bench, rule)
        if price <= 0.0 or not about:
            continue
        nearest = [found for tag in sorted(about) for found in _reached(bench, rule, tag)]
        if any(each.reach >= 1.0 for each in nearest) or _balanced(bench, about):
            continue
        violating = [name for name in shown if _violates(bench, rule, name)]
        noticed = [name for name in violating if any(s.confirmed_s is not None for s in shown[name].values())]
        yield _finding(bench, rule, nearest, violating, noticed)


def _finding(bench: Bench, rule: Rule, nearest: list[_Nearest], violating: list[str], noticed: list[str]) -> Finding:
    currency = bench.plant.prices.currency
    costs = f"{bench.plant.prices.outside[rule.name]:g} {currency} an hour for each scale by which it is missed"
    if nearest:
        each = max(nearest, key=lambda found: found.reach)
        unit = bench.plant.description.tag(each.tag).unit
        seen = (
            f"it is missed from {each.tag!r} = {amount(each.value, unit)} on, where {each.symptom!r}, the nearest "
            f"symptom, is at {each.reach:.2g} of its threshold"
        )
        remedy = f"lower the threshold of {each.symptom!r}, or state a symptom that shows it"
    else:
        seen = "no feature of a symptom reads what it is about"
        remedy = "state a feature and a symptom of it (features.csv, symptoms.csv)"
    if noticed:
        by = f"it is noticed by other signs of {_told(noticed)}, and not where something else misses it"
        severity, remedy = Severity.NOTE, f"nothing, where these are all that can happen; else {remedy}"
    else:
        by = (
            f"and of {_told(violating)}, which misses it, there is no sign either" if violating
            else "and no fault of the tables misses it"
        )  # fmt: skip
        severity = Severity.WARNING
        remedy += ", or a price of 0 where nobody minds (prices.csv)"
    table = "criteria" if isinstance(rule, Criterion) else "limits"
    what = f"'{rule.formula}' has a price, {costs}, and nothing notices that it is missed: {seen}, {by}"
    if noticed:
        what = f"'{rule.formula}' has a price, {costs}: {seen}; {by}".replace("; ", ", ")
    return Finding(severity, "faults", bench.places.row(table, id=rule.name), what, remedy)


def _told(names: list[str]) -> str:
    return ", ".join(map(repr, names[:3])) + (" ..." if names[3:] else "")


def _about(bench: Bench, rule: Rule) -> frozenset[str]:
    """Measured tags that a rule is about: those that it reads, and those of loops whose error it reads.

    What stands at an actuator tells of commands: a position, a rate, a manual output.
    """
    d, errors = bench.plant.description, _errors(bench)
    moved = {s.component for s in d.signals if s.relation in (Relation.DRIVES, Relation.OVERRIDES)}
    own = {s.tag.name for s in d.signals if s.component in moved} | set(d.positions.values())
    read = {errors[tag].process_variable if tag in errors else tag for tag in rule.formula.tags}
    measured = {s.tag.name for s in d.signals if s.relation is Relation.MEASURES}
    return frozenset(read & measured - own)


def _errors(bench: Bench) -> Mapping[str, ControlLoop]:
    """Control error -> its loop: what is reported and always is the controlled variable less its setpoint."""

    def make() -> dict[str, ControlLoop]:
        d, course, found = bench.plant.description, bench.quiet, {}
        reported = [s.tag for s in d.signals if s.relation is Relation.REPORTS]
        for loop in d.loops:
            off = course.true(loop.process_variable) - course.true(loop.setpoint)
            for tag in reported:
                differs = np.abs(course.true(tag.name) - off)
                if np.isfinite(differs).any() and np.nanmax(differs) <= SAME * tag.range.span:
                    found[tag.name] = loop
        return found

    return bench.kept("control errors", make)


def _reached(bench: Bench, rule: Rule, tag: str) -> Iterator[_Nearest]:
    """For each symptom that reads ``tag`` as it is: how far it goes where that begins to miss the ``rule``."""
    usual, d = _usual(bench), bench.plant.description
    features = {f.name: f for f in d.features if f.accumulation is None and _read(bench, f) & {tag}}
    if not features:
        return
    ends = d.tag(tag).range
    for side in (ends.low, ends.high):
        values = _moved(bench, usual, tag, np.linspace(usual[tag], side, STEPS))
        missed = np.flatnonzero(rule.formula.margins(values, 1.0)[0] < 0.0)
        if not missed.size or missed[0] == 0:
            continue
        at = missed[0]
        reaches = [
            (_reach(bench, each, features[each.feature], values)[: at + 1].max(), each.name)
            for each in d.symptom_rules
            if each.feature in features
        ]
        if reaches:
            reach, symptom = max(reaches)
            yield _Nearest(symptom, float(reach), tag, float(values[tag][at]))


def _reach(bench: Bench, rule: SymptomRule, feature: Feature, values: Mapping[str, np.ndarray]) -> np.ndarray:
    """Deviation of a feature to the side of the symptom, in thresholds, shape (values,)."""
    baseline = bench.baselines[feature.name]
    off = feature.expression.evaluate(values)[0] - baseline.mean
    signed = {"high": off, "low": -off}.get(rule.direction.value, np.abs(off))
    least = max(rule.sigma * float(np.hypot(baseline.within_sd, baseline.between_sd)), rule.threshold)
    return np.asarray(np.nan_to_num(signed / least, nan=-np.inf))


def _usual(bench: Bench) -> Mapping[str, float]:
    """Tag -> its mean at the end of the healthy course; NaN where it has none."""
    course = bench.quiet
    late = course.after((1.0 - LATE) * float(course.truth.times_s[-1]))
    return {tag: float(values[0, late].mean()) for tag, values in course.truth.signals.items()}


def _moved(bench: Bench, usual: Mapping[str, float], tag: str, to: np.ndarray) -> dict[str, np.ndarray]:
    """Signals in which one tag moves, and with it what is reported of how far it is off; all else is as usual."""
    values = {name: np.full(to.size, value) for name, value in usual.items()} | {tag: to}
    for error, loop in _errors(bench).items():
        if loop.process_variable == tag:
            values[error] = to - usual[loop.setpoint]
    return values


def _read(bench: Bench, feature: Feature) -> Set[str]:
    """Tags that a feature reads; of a control error that of its loop."""
    tags = feature.tags
    errors = _errors(bench)
    return tags | {errors[tag].process_variable for tag in tags if tag in errors}


def _balanced(bench: Bench, about: frozenset[str]) -> bool:
    """Whether a balance of a symptom reads it: what it shows of a violation depends on how that comes."""
    d = bench.plant.description
    used = {rule.feature for rule in d.symptom_rules}
    return any(f.accumulation is not None and f.name in used and _read(bench, f) & about for f in d.features)


def _violates(bench: Bench, rule: Rule, name: str) -> bool:
    """Whether the fault at its nominal severity misses the rule after its onset."""
    fault = bench.plant.description.fault(name)
    course = bench.faulty(fault, fault.severity_nominal)
    margins = rule.formula.margins(course.truth.signals, course.truth.dt_s)[0]
    return bool((course.after(bench.onset_s) & (margins < 0.0)).any())
