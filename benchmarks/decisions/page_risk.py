"""Sections of the page about risk, speed, and the three runs that a review found worst."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import median

import numpy as np
from scipy.stats import binomtest

from benchmarks.decisions.measure import Decision
from benchmarks.decisions.risk import NOMINAL, SPREADS, Released
from benchmarks.decisions.speed import HORIZON_S, ROLLOUTS, Thought
from benchmarks.decisions.worst import BEFORE, Before
from benchmarks.unknown.sections import table

ASKED = 300
"""Released runs that are asked for of each plant and each spread."""
RISK = f"""## Risk

Released runs, pooled over the faults of the tables, whose true plant has the model's own equations and parameters
that are off by 1, 2 and 3 times their stated uncertainty. *Violated*: outside a hard limit at any time after the
first release; exact intervals (Clopper and Pearson, 95 %). *{NOMINAL}*: the same runs judged by one rollout of the
likeliest fault with the likeliest parameters, without a certificate. Asked for: {ASKED} released runs each; at 1x the
upper end below 2 %; at 2x at most a third of what the nominal validator lets through."""
SPEED = """## Speed

By the wall clock, one run at a time. *Decision*: all thinking from what led to the first action to that action, with
isolation and judgement. *Each proposal*: thinking of the proposer alone. Asked for: 1,000 rollouts over 1,500 s in
2.5 s on 2 cores; a decision by search within 0.5 s in the median and 1.5 s at 95 % on the reactor, 1 s on the module;
an answer of the playbook within 50 ms before it is checked."""
WORST = """## The three worst of a review

Costs from detection to 2,500 s after the onset, in points, of the runs that a review had found to lose most. *Lost
before*: production lost then, on a true plant that was the twin's model, beside the best constant of that time."""


def risks(found: Mapping[tuple[str, str, str], Sequence[Released]]) -> str:
    """The section about risk; ``found``: (plant, mismatch, validator) -> runs."""
    header = ("plant", "spread", "validator", "runs", "released", "violated", "95 % interval")
    rows = []
    for (plant, mismatch, validator), every in found.items():
        released = [one for one in every if one.released_s is not None]
        count = sum(one.violated for one in released)
        rows.append((
            plant, f"{SPREADS[mismatch]}x", validator, len(every), f"{len(released)} of {ASKED}", count,
            _exact(count, len(released)),
        ))  # fmt: skip
    return f"{RISK}\n\n{table(header, rows)}"


def _exact(count: int, of: int) -> str:
    if not of:
        return "none"
    ends = binomtest(count, of).proportion_ci(confidence_level=0.95, method="exact")
    return f"{100.0 * ends.low:.1f} to {100.0 * ends.high:.1f} %"


def speeds(thoughts: Mapping[str, Sequence[Thought]], rollouts_s: float) -> str:
    """The section about speed; ``thoughts``: plant -> timed runs."""
    rows: list[tuple[object, ...]] = []
    for plant, every in thoughts.items():
        rows.append((plant, "decision", len(every), *_seconds([one.decision_s for one in every])))
        for proposer in dict.fromkeys(name for one in every for name in one.proposals_s):
            took = [one.proposals_s[proposer] for one in every if proposer in one.proposals_s]
            rows.append((plant, f"each proposal, {proposer}", len(took), *_seconds(took)))
    header = ("plant", "what", "runs", "median [s]", "95 % [s]", "longest [s]")
    text = f"{ROLLOUTS:,} rollouts of the reactor with noise over {HORIZON_S:,} s on two threads: {rollouts_s:.2f} s."
    return f"{SPEED}\n\n{text}\n\n{table(header, rows)}"


def _seconds(took: Sequence[float]) -> tuple[str, str, str]:
    if not took:
        return "none", "none", "none"
    return f"{median(took):.3f}", f"{float(np.quantile(took, 0.95)):.3f}", f"{max(took):.3f}"


def worst_runs(found: Sequence[Decision]) -> str:
    """The section about the worst runs."""
    header = ("fault", "seed", "lost before", "best constant then", "cost now", "best constant now", "outcome")
    rows = []
    for one in found:
        before = next((known for known in BEFORE if known.fault == one.fault), Before("", 0.0, 0, 0.0, 0.0, 0.0))
        rows.append((
            f"{one.fault} {one.severity:g}", one.seed, f"{before.lost:.1f}", f"{before.best:.1f}", _points(one.cost),
            _points(one.best), one.outcome,
        ))  # fmt: skip
    return f"{WORST}\n\n{len(found)} of {len(BEFORE)} runs are in.\n\n{table(header, rows)}"


def _points(value: float | None) -> str:
    return "none" if value is None else f"{value:.1f}"
