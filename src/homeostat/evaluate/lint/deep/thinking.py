"""Per fault: does what is left when it is noticed suffice to decide, before the first hard limit is violated?

What is left, L, is the time from the look that can see the violation coming until the limit is violated while nobody
acts. A look comes when a symptom is confirmed, and again every ``review_s`` while nothing is done; it sees as far as
``horizon_s``. What a decision needs is

    evidence (``evidence_s``, or ``again_s`` where that is shorter) + shortest thinking + the fallback's response,

the last being the time that is kept for it, or that in which the plant has accepted its commands where that is longer.
Hand check: noticed after 4 s, violated after 35 s, 6 s of evidence, 1 s of thinking, 5 s kept: 31 s left, 12 needed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.safe_states import confirm_s
from homeostat.evaluate.lint.finding import Finding, Place, Severity
from homeostat.plants.files.folder import SETTINGS
from homeostat.plants.wired.assembly import fallbacks
from homeostat.recovery.bounds import Budget
from homeostat.recovery.deadline import SHORTEST_S

if TYPE_CHECKING:
    from homeostat.evaluate.lint.deep.faults import Outlook


class Needs(NamedTuple):
    """What a decision about one limit needs, in process seconds."""

    evidence_s: float
    """Until the explanation is sure enough, or evidence is no longer waited for."""
    thinking_s: float
    """Until the search has answered."""
    response_s: float
    """Until the fallback acts that is armed for the case that nothing is found."""

    @property
    def total_s(self) -> float:
        """All of it [s]."""
        return self.evidence_s + self.thinking_s + self.response_s


def needs(bench: Bench, limit: str) -> Needs:
    """What a decision needs where ``limit`` is going to be violated."""
    monitoring = bench.plant.monitoring
    accepted = [confirm_s(bench, strategy) for strategy in fallbacks(bench.plant) if limit in strategy.serves]
    response_s = max([_budget(bench).reserve_s, *accepted])
    return Needs(min(monitoring.evidence_s, monitoring.again_s), SHORTEST_S, response_s)


def _budget(bench: Bench) -> Budget:
    return Budget().for_ticks(bench.plant.description.timing.tick_s)


def left_s(noticed_s: float, violated_s: float, review_s: float, horizon_s: float) -> tuple[float, int]:
    """What is left at the first look that sees the violation, and the number of reviews until then [s].

    Times from the onset on; negative where the limit is violated before anybody looks.
    """
    beyond_s = violated_s - noticed_s - horizon_s
    reviews = max(math.ceil(beyond_s / review_s), 0)
    return violated_s - noticed_s - reviews * review_s, reviews


def too_little(bench: Bench, outlook: Outlook) -> Iterator[Finding]:
    """A finding where what is left does not suffice for a decision about the fault."""
    if outlook.noticed_s is None or outlook.violated_s is None:
        return
    monitoring, horizon_s = bench.plant.monitoring, float(bench.plant.twin.horizon_s)
    left, reviews = left_s(outlook.noticed_s, outlook.violated_s, monitoring.review_s, horizon_s)
    need = needs(bench, outlook.violates)
    if left + bench.plant.description.timing.tick_s >= need.total_s:  # what happens between samples is known to a tick
        return
    what = (
        f"{outlook.fault!r} is noticed after {outlook.noticed_s:g} s and violates {outlook.violates} after "
        f"{outlook.violated_s:g} s while nobody acts"
    )
    allowed_s = max(min(_budget(bench).latency_s, left - need.response_s), 0.0)
    needed = (
        f"thinking is allowed {allowed_s:g} s of it, while a decision needs {need.total_s:g} s ({need.evidence_s:g} s "
        f"of evidence, {need.thinking_s:g} s of thinking, {need.response_s:g} s until the fallback acts)"
    )
    where, why, remedy = _cause(bench, outlook, left, reviews, need)
    yield Finding(Severity.WARNING, "thinking", where, f"{what}: {why}, {needed}", remedy)


def _cause(bench: Bench, outlook: Outlook, left: float, reviews: int, need: Needs) -> tuple[Place, str, str]:
    """Where too little time comes from, what is left, and what to do."""
    monitoring, horizon_s = bench.plant.monitoring, bench.plant.twin.horizon_s
    if reviews:
        at_most = horizon_s - need.total_s
        place = Place(SETTINGS, None, "monitoring, review_s")
        why = (
            f"no look before review {reviews} sees {horizon_s:g} s ahead so far, and {max(left, 0.0):g} s are left then"
        )
        return place, why, f"review it sooner: review_s = {monitoring.review_s:g} must be at most {at_most:g} s"
    symptom = next((rule for rule in outlook.symptoms if _indicates(bench, rule, outlook.fault)), "")
    place, why = bench.places.row("symptoms", id=symptom), f"{left:g} s are left"
    if left < 0.0:
        why = f"that is {-left:g} s too late"
    without_s = need.total_s - need.evidence_s
    if left >= without_s:
        key = "again_s" if monitoring.again_s < monitoring.evidence_s else "evidence_s"
        place = Place(SETTINGS, None, f"monitoring, {key}")
        return place, why, f"wait less for evidence: {key} = {need.evidence_s:g} must be at most {left - without_s:g} s"
    sooner = f"notice it sooner (threshold, sigma or on_delay_s of {symptom!r})"
    limit = bench.places.row("limits", id=outlook.violates)
    return place, why, f"{sooner}, or give the limit more room ({limit}), or else the fallback acts alone"


def _indicates(bench: Bench, symptom: str, fault: str) -> bool:
    return any(rule.name == symptom and fault in rule.faults for rule in bench.plant.description.symptom_rules)
