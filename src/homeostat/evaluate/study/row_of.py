"""From a run to its row."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypedDict

import numpy as np

from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.events.guard import FellBack
from homeostat.domain.events.recovery import Attempted, Noticed
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.run import RunResult
from homeostat.evaluate.score.belief import merge
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.evaluate.score.scoring import inside_at_end
from homeostat.evaluate.score.step_scores import StepScores
from homeostat.evaluate.study.plan.expansion import loaded
from homeostat.evaluate.study.plan.job import Job
from homeostat.evaluate.study.row import YARDSTICKS, Row
from homeostat.evaluate.study.usage import usage_of
from homeostat.journal.events import Event
from homeostat.plants.plant import Case
from homeostat.record.releases import Releases

SPILLED = "spilled_L"
"""Total of what leaked or overflowed, where a case adds it up [L]."""

NOBODY = "none"
"""Actor of a run in which nothing was released but the steps of a batch as usual."""


@dataclass(frozen=True, slots=True)
class Observed:
    """What is known of a run that has ended."""

    run: RunResult
    """Its score."""
    steps: StepScores | None
    """Scores of single steps; None where none were asked for."""
    events: tuple[Event, ...]
    """Its trace."""


def succeeded(run: RunResult) -> bool:
    """Whether a run ended inside its hard limits, a batch complete or start-up over, without the fallback."""
    ended = run.complete_s is not None or (run.nominal_s is None and not run.force.starting(run.truth)[-1])
    return ended and run.actor != "fallback" and inside_at_end(run.truth, run.force)


def notable(job: Job, run: RunResult) -> bool:
    """Whether somebody will want to see why a run ended as it did: no success, or a hard limit was broken.

    What nobody proposed is no matter for anybody: reference policies are there to fail.
    """
    if job.arm.who in YARDSTICKS:
        return False
    hard = {limit.name for limit in loaded(job.scenario.case).description.limits.hard}
    return not succeeded(run) or any(e.total_s > 0.0 for e in run.exposures if e.limit in hard)


def row_of(job: Job, seen: Observed, trace: str) -> Row:
    """The row of ``job``; ``trace``: folder that its run is kept in, empty for none."""
    case, run, s = loaded(job.scenario.case), seen.run, job.scenario
    hard = {limit.name for limit in case.description.limits.hard}
    exposed = [e for e in run.exposures if e.limit in hard]
    origin = s.onset_s if s.onset_s is not None else run.started_s
    margin, limit = least_margin(case, run.truth, run.force)
    usage = usage_of(seen.events, run.said)
    attempts = [e for e in seen.events if isinstance(e, Attempted)]
    releases, fallbacks = len(Releases.of(seen.events).made), _count(seen.events, FellBack)
    belief = _belief(run.hypotheses, s.fault)
    return Row(
        job=job.name, case=s.case, scenario=job.label, kind=job.kind, published=job.published,
        proposer=job.arm.label, ablation=job.ablation, seed=s.seed, fault=s.fault,
        severity=tuple(f.severity for f in s.faults), onset_s=tuple(f.onset_s for f in s.faults),
        batch=run.nominal_s is not None,
        outcome=run.outcome.value, success=succeeded(run), actor=run.actor, state=run.state, reason=run.reason,
        detection_s=_after(run.detected_s, s.onset_s), false_alarm=run.false_alarm,
        released_s=_after(run.released_s, origin), releases=releases, fallbacks=fallbacks, attempts=len(attempts),
        refused=sum(not a.approved for a in attempts), decisions=_count(seen.events, Noticed),
        acted=run.actor != NOBODY,
        exposure_s=max((e.total_s for e in exposed), default=0.0),
        exposure_detected_s=None if run.detected_s is None else max((e.from_detection_s for e in exposed), default=0.0),
        least_margin=margin, least_margin_limit=limit, approved_margin=_finite(run.min_margin),
        production_loss=_finite(run.production_loss), complete_s=run.complete_s, nominal_s=run.nominal_s,
        spilled_L=run.totals.get(SPILLED),
        believed=belief.name, believed_p=belief.probability, true_p=belief.true_p, brier=belief.brier,
        **_step_columns(seen.steps), **usage.columns,
        wall_decision_s=None if run.actor == NOBODY else run.thinking_s, wall_thinking_s=run.thought_s,
        wall_call_s=usage.wall_call_s, wall_s=run.wall_s, trace=trace,
    )  # fmt: skip


class StepColumns(TypedDict):
    """The columns of a row that are about single steps."""

    plans: int | None
    plans_right: int | None
    actions: int | None
    actions_right: int | None
    on_right: int | None
    on_wrong: int | None
    on_missed: int | None


def _step_columns(steps: StepScores | None) -> StepColumns:
    if steps is None:
        return StepColumns(plans=None, plans_right=None, actions=None, actions_right=None, on_right=None,
                           on_wrong=None, on_missed=None)  # fmt: skip
    return StepColumns(
        plans=steps.plans, plans_right=steps.plans_right, actions=steps.actions, actions_right=steps.actions_right,
        on_right=steps.on_right, on_wrong=steps.on_wrong, on_missed=steps.on_missed,
    )  # fmt: skip


def least_margin(case: Case, truth: Trajectory, force: LimitsInForce) -> tuple[float, str]:
    """Least true margin to a hard limit since start-up in scales of its unit, and the limit's name.

    A run that ends in start-up is judged by the limits of start-up. ValueError for one that ends with its beginning.
    """
    if truth.length < 2:
        raise ValueError(f"the run ends at {truth.times_s[-1]:g} s, before there is anything to judge; make it longer")
    starting, scales = force.starting(truth), case.description.scales
    judged = np.ones_like(starting) if starting.all() else ~starting
    found: list[tuple[float, str]] = []
    for limit in force.limits.hard:
        margins = force.margins(limit, truth, scales)[judged]
        least = float(np.where(np.isnan(margins), -np.inf, margins).min())  # undecided is the worst
        found.append((least, limit.name))
    return min(found)


@dataclass(frozen=True, slots=True)
class _Belief:
    name: str = ""
    probability: float | None = None
    true_p: float | None = None
    brier: float | None = None


def _belief(hypotheses: Iterable[Hypothesis], truth: str) -> _Belief:
    """What was held most probable, and how good all of it was; fault sets count, sizes do not."""
    beliefs = merge(hypotheses)
    if not beliefs:
        return _Belief()
    given = {"+".join(sorted(b.name.split("+"))): b.probability for b in beliefs}
    true = "+".join(sorted(truth.split("+")))
    brier = sum((p - (name == true)) ** 2 for name, p in given.items()) + (true not in given)
    best = max(given, key=lambda name: given[name])
    return _Belief(best, given[best], given.get(true, 0.0), brier)


def _count(events: Iterable[Event], kind: type[Event]) -> int:
    return sum(isinstance(e, kind) for e in events)


def _after(at_s: float | None, origin_s: float | None) -> float | None:
    return None if at_s is None or origin_s is None else at_s - origin_s


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
