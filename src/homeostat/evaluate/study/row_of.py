"""From a run to its row."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from homeostat.domain.diagnosis import Hypothesis, by_fault_set
from homeostat.domain.events.recovery import Noticed
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.run import Run, finite, known_totals
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.evaluate.score.scoring import inside_at_end, missed_at_end
from homeostat.evaluate.study.plan.job import Job
from homeostat.evaluate.transcript import TranscriptEntry
from homeostat.journal.calls import ModelCalled
from homeostat.llm.replay import SUPPLIED
from homeostat.plants.plant import Plant
from homeostat.record.result import StepScores
from homeostat.record.row import AGENTS, REFERENCE_POLICIES, Row
from homeostat.record.run_record import NOBODY

STEPS = tuple(field.name for field in fields(StepScores))
"""Columns about single steps."""


def succeeded(run: Run) -> bool:
    """Whether a run ended inside its hard limits, a batch complete or start-up over, without the fallback."""
    ended = run.complete_s is not None or (run.nominal_s is None and not run.force.starting(run.truth)[-1])
    return ended and run.actor != "fallback" and inside_at_end(run.truth, run.force, run.plant.description.timing)


def notable(job: Job, run: Run) -> bool:
    """Whether somebody will want to see why a run ended as it did: no success, or a hard limit was violated.

    What nobody proposed is no matter for anybody: reference policies are there to fail.
    """
    if job.arm.who in REFERENCE_POLICIES:
        return False
    hard = {limit.name for limit in run.plant.description.limits.hard}
    return not succeeded(run) or any(e.total_s > 0.0 for e in run.exposures if e.limit in hard)


def row_of(job: Job, run: Run, trace: str) -> Row:
    """The row of ``job``; ``trace``: folder that its run is kept in, empty for none."""
    return Row(
        **_asked(job, run),
        **_ended(run),
        **_done(job, run),
        **_endured(run),
        **_believed(run.hypotheses, job.scenario.fault),
        **(dict.fromkeys(STEPS) if run.steps is None else asdict(run.steps)),
        **usage_of(run.record.of_kind(ModelCalled), run.transcript),
        wall_decision_s=None if run.actor == NOBODY else run.thinking_s,
        wall_thinking_s=run.thought_s,
        wall_s=run.wall_s,
        trace=trace,
    )


def _asked(job: Job, run: Run) -> dict[str, Any]:
    s = job.scenario
    return {
        "job": job.name,
        "case": s.case,
        "scenario": job.label,
        "kind": job.kind,
        "published": job.published,
        "proposer": job.arm.label,
        "ablation": job.ablation,
        "seed": s.seed,
        "fault": s.fault,
        "severity": tuple(f.severity for f in s.faults),
        "onset_s": tuple(f.onset_s for f in s.faults),
        "disturbances": "; ".join(map(str, s.disturbances)),
        "mismatch": s.mismatch,
        "batch": run.nominal_s is not None,
    }


def _ended(run: Run) -> dict[str, Any]:
    return {
        "outcome": run.outcome.value,
        "success": succeeded(run),
        "actor": run.actor,
        "state": run.state,
        "reason": run.reason,
        "false_alarm": run.false_alarm,
        "acted": run.actor != NOBODY,
        "approved_margin": finite(run.min_margin),
        "production_loss": finite(run.production_loss),
        "complete_s": run.complete_s,
        "nominal_s": run.nominal_s,
        "totals": known_totals({name: run.totals[name] for name in run.plant.reported}),
    }


def _done(job: Job, run: Run) -> dict[str, Any]:
    """What was reported and done, and how often."""
    onset_s, record = job.scenario.onset_s, run.record
    origin_s = run.started_s if onset_s is None else onset_s
    return {
        "detection_s": _after(run.detected_s, onset_s),
        "released_s": _after(run.released_s, origin_s),
        "releases": len(record.releases),
        "fallbacks": len(record.fallbacks),
        "attempts": run.attempts,
        "refused": sum(not attempt.approved for attempt in record.attempts),
        "decisions": len(record.of_kind(Noticed)),
    }


def _endured(run: Run) -> dict[str, Any]:
    """How long and how far the plant was outside its hard limits."""
    hard = {limit.name for limit in run.plant.description.limits.hard}
    exposed = [e for e in run.exposures if e.limit in hard]
    detected_s = max((e.from_detection_s for e in exposed), default=0.0)
    margin, limit = least_margin(run.plant, run.truth, run.force)
    return {
        "exposure_s": max((e.total_s for e in exposed), default=0.0),
        "exposure_detected_s": None if run.detected_s is None else detected_s,
        "least_margin": margin,
        "least_margin_limit": limit,
        "missed": "+".join(missed_at_end(run.truth, run.force, run.plant.description.timing)),
    }


def least_margin(plant: Plant, truth: Trajectory, force: LimitsInForce) -> tuple[float, str]:
    """Least true margin to a hard limit since start-up in scales of its unit, and the limit's name.

    A run that ends in start-up is judged by the limits of start-up. ValueError for one that ends with its beginning.
    """
    if truth.length < 2:
        raise ValueError(f"the run ends at {truth.times_s[-1]:g} s, before there is anything to judge; make it longer")
    starting, scales = force.starting(truth), plant.description.scales
    judged = np.ones_like(starting) if starting.all() else ~starting
    found: list[tuple[float, str]] = []
    for limit in force.limits.hard:
        margins = force.margins(limit, truth, scales)[judged]
        least = float(np.where(np.isnan(margins), -np.inf, margins).min())  # undecided is the worst
        found.append((least, limit.name))
    return min(found)


def _believed(hypotheses: Iterable[Hypothesis], truth: str) -> dict[str, Any]:
    """What was held most probable, and how good all of it was; fault sets count, sizes do not."""
    held = by_fault_set(hypotheses)
    if not held:
        return {"believed": "", "believed_p": None, "true_p": None, "brier": None}
    given = {"+".join(sorted(each.name.split("+"))): each.probability for each in held}
    true = "+".join(sorted(truth.split("+")))
    brier = sum((p - (name == true)) ** 2 for name, p in given.items()) + (true not in given)
    best = max(given, key=lambda name: given[name])
    return {"believed": best, "believed_p": given[best], "true_p": given.get(true, 0.0), "brier": brier}


def _after(at_s: float | None, origin_s: float | None) -> float | None:
    return None if at_s is None or origin_s is None else at_s - origin_s


SERVER, ESTIMATE = "server", "estimate"
"""Who counted tokens."""


def usage_of(every: Sequence[ModelCalled], transcript: Sequence[TranscriptEntry]) -> dict[str, Any]:
    """The columns of a row that are about language models; ``transcript`` holds our own counts of the calls, in order.

    Tokens are the server's count where it counted in every call, else our estimate in every call.
    """
    pairs = [(call, own) for call, own in zip(every, transcript, strict=True) if call.served != SUPPLIED]
    calls = [call for call, _ in pairs]
    counted = bool(calls) and all(c.input_tokens > 0 for c in calls if not c.failure)
    columns: dict[str, Any] = {f"{agent}_{what}": 0 for agent in AGENTS for what in ("calls", "in", "out")}
    for call, own in pairs:
        tokens = (call.input_tokens, call.output_tokens) if counted else (own.asked_tokens, own.answered_tokens)
        for what, count in zip(("calls", "in", "out"), (1, *tokens), strict=True):
            columns[f"{call.agent}_{what}"] += count
    costs = [c.cost_usd for c in calls]
    return {
        **columns,
        "tokens_by": (SERVER if counted else ESTIMATE) if calls else "",
        "cost_usd": sum(c for c in costs if c is not None) if calls and None not in costs else None,
        "failures": sum(bool(c.failure) for c in calls),
        "wall_call_s": sum(c.wall_latency_s for c in calls) / len(calls) if calls else None,
    }
