"""Per fault: what recovery would do about it, which criterion is nearest to its limit then, and what it costs.

Each fault begins on the simulated plant and its diagnosis is given, as when a playbook is built; what is released first
is the answer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from homeostat.domain.diagnosis import FaultMode
from homeostat.evaluate.lint.deep.bench import SEEDS, Bench
from homeostat.evaluate.lint.deep.faults import open_targets, state_at
from homeostat.evaluate.lint.finding import Finding, Severity
from homeostat.evaluate.playbook.answering import answered
from homeostat.evaluate.playbook.points import Question


@dataclass(frozen=True, slots=True)
class Answered:
    """What recovery makes of one fault at its nominal severity."""

    fault: str
    """Its name."""
    path: tuple[str, ...]
    """States that it leads through; empty where nothing is released."""
    proposer: str
    """Who proposed it; empty where nothing is released."""
    binds: str
    """Criterion or limit that is nearest to its limit; empty where it is not told."""
    margin: float | None
    """What is left of it, in ``unit``."""
    unit: str
    """Unit of the margin."""
    cost_share: float | None
    """What it is expected to cost, as a share of the design production [1]."""
    reason: str
    """Why nothing is released; empty where something is."""


def answers(bench: Bench) -> Iterator[Finding | Answered]:
    """An answer for each fault; a note where recovery has none although the state machine has a way."""
    plant = replace(bench.plant, baselines=dict(bench.baselines))
    state = state_at(bench, bench.onset_s)
    for fault in plant.description.faults:
        bench.told(f"answer to {fault.name}")
        question = Question(fault.name, fault.severity_nominal, state, bench.onset_s, SEEDS[0])
        entry = answered(plant, question)
        if entry.answer is None:
            yield Answered(fault.name, (), "", "", None, "", None, entry.reason)
            if entry.needed and open_targets(bench, fault):
                yield _none(bench, fault, entry.reason)
            continue
        answer, worst = entry.answer, entry.answer.worst
        yield Answered(
            fault=fault.name,
            path=answer.path,
            proposer=answer.proposer,
            binds="" if worst is None else worst.criterion,
            margin=None if worst is None else worst.amount,
            unit="" if worst is None else worst.unit,
            cost_share=answer.cost_share,
            reason="",
        )


def _none(bench: Bench, fault: FaultMode, reason: str) -> Finding:
    what = (
        f"recovery finds no answer to {fault.name!r} at its nominal severity {fault.severity_nominal:g} "
        f"{fault.severity_unit}, so the fallback acts: {reason.replace('; ', ', ')}"
    )
    place = bench.places.row("faults", id=fault.name)
    remedy = (
        "nothing, where the fallback is meant; else admit more (setpoints.csv), or look at the criterion that binds"
    )
    return Finding(Severity.NOTE, "answers", place, what, remedy)
