"""Limits that are judged by the one instrument that a loop controls by: where it drifts, nobody sees it.

The loop then moves what is true, and the reading stays where it should be. What would show it is another instrument in
the limit, or a feature of a symptom that reads it beside what others measure. It is a remark: many plants are so.
"""

from __future__ import annotations

from collections.abc import Iterator

from homeostat.domain.diagnosis import Feature
from homeostat.domain.plant.description import ControlLoop, Relation
from homeostat.domain.plant.limits import Limit, LimitKind
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.finding import Finding, Severity


def alone(bench: Bench) -> Iterator[Finding]:
    """One note of all loops whose instrument alone judges hard limits or envelopes, and that nothing else checks."""
    d, found = bench.plant.description, list[tuple[ControlLoop, list[str]]]()
    for loop in d.loops:
        judged = [limit.name for limit in d.limits.limits if _rests_on(bench, limit, loop.process_variable)]
        if judged and not any(_checks(bench, feature, loop) for feature in d.features):
            found.append((loop, judged))
    if found:
        yield _finding(bench, found)


def _finding(bench: Bench, found: list[tuple[ControlLoop, list[str]]]) -> Finding:
    d = bench.plant.description
    sensors = {s.tag.name: s.component for s in d.signals if s.relation is Relation.MEASURES}
    told = [
        f"{loop.name!r} controls by {sensors.get(loop.process_variable, loop.process_variable)!r} alone, which judges "
        f"{' and '.join(limits)} as well"
        for loop, limits in found
    ]
    what = (
        f"{', '.join(told)}: where such an instrument drifts, its loop takes the plant along while it reads as it "
        "should, and neither the limit nor a feature shows it"
    )
    remedy = (
        "nothing, where that is accepted; else a second instrument in the limit (joined by 'or') with a feature of how "
        "far they are apart, or a feature that reads it beside what others measure, as a balance"
    )
    return Finding(Severity.NOTE, "faults", bench.places.row("loops", id=found[0][0].name), what, remedy)


def _rests_on(bench: Bench, limit: Limit, tag: str) -> bool:
    """Whether ``limit`` compares ``tag``, and nothing else that is measured: what actuators do apart."""
    if limit.kind is LimitKind.PERMISSIVE or tag not in limit.formula.tags:
        return False
    return not (limit.formula.tags & _measured(bench)) - {tag}


def _measured(bench: Bench) -> set[str]:
    """Tags of instruments but those that show where an actuator stands."""
    d = bench.plant.description
    return {s.tag.name for s in d.signals if s.relation is Relation.MEASURES} - set(d.positions.values())


def _checks(bench: Bench, feature: Feature, loop: ControlLoop) -> bool:
    """Whether a symptom's feature reads what the loop holds beside what another instrument measures."""
    d = bench.plant.description
    if not any(rule.feature == feature.name for rule in d.symptom_rules):
        return False
    read = feature.tags
    return loop.process_variable in read and bool((read & _measured(bench)) - {loop.process_variable})
