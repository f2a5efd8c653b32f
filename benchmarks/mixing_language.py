"""Batches with a language model: whole routes, and the published protocol step by step; rows for the results page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from benchmarks.cstr_results import table
from benchmarks.mixing_batches import drawn, module, on_true_plant
from benchmarks.mixing_calls import FAULTS
from homeostat.agents.language.scripts import reasonable
from homeostat.agents.roles import AskingProtocol
from homeostat.domain.events.recovery import Attempted, ReleasedActions
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import Scenario, scenario
from homeostat.evaluate.score.step_scores import score_steps
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.llm.model import Question
from homeostat.llm.scripted import ScriptedModel
from homeostat.llm.tokens import estimate, exact
from homeostat.plants.wired.assembly import Language, model_alone


@dataclass(frozen=True)
class LanguageRow:
    """One batch in which a language model proposes first."""

    family: str
    fault: str
    seed: int
    state: str
    actor: str
    complete: bool
    safe: bool
    by_model: int
    """Releases of what the model proposed."""
    refused: int
    """Proposals of the model that were refused, answers that were none included."""
    calls: int
    tokens: int


@dataclass(frozen=True)
class StepRow:
    """One batch in which every step is asked for."""

    fault: str
    seed: int
    label_given: bool
    success: bool
    plans: int
    plans_right: int
    actions: int
    actions_right: int
    on_right: int
    on_wrong: int
    on_missed: int
    calls: int
    tokens: int


def tokens_of(question: Question) -> int:
    """Tokens of a question with its schema, by the o200k tokenizer where it is installed."""
    texts = (question.system, question.prompt, json.dumps(question.schema))
    counted = [(exact(text), estimate(text)) for text in texts]
    return sum(about if count is None else count for count, about in counted)


def whole_routes(job: tuple[str, int]) -> LanguageRow:
    """One batch whose fault is drawn as for the search."""
    family, seed = job
    chosen, trace, model = drawn(family, seed), MemoryTrace(), ScriptedModel("reasonable", reasonable)
    result = run(module(), chosen, trace, DeclaredClock(1.0), Proposing(Language(model), propose=model_alone))
    mine = [a for a in trace.of(Attempted) if a.proposer == "language"]
    broken = max(result.totals[n] for n in ("overflowed_L", "dry_run_s", "dead_head_s"))
    hard = {limit.name for limit in module().description.limits.hard}
    outside = max(e.total_s for e in result.exposures if e.limit in hard)
    return LanguageRow(
        family, chosen.fault, seed, result.state, result.actor, result.complete_s is not None,
        broken <= 0.0 and outside == 0.0, sum(r.proposer == "language" for r in trace.of(ReleasedActions)),
        sum(not a.approved for a in mine), len(model.asked), sum(map(tokens_of, model.asked)),
    )  # fmt: skip


def published_scenario(fault: str, seed: int) -> Scenario:
    """A published fault, there from the start of the batch."""
    name, severity = FAULTS[fault]
    return on_true_plant(scenario(module(), name, seed, None if name == "none" else 0.0, severity, 400.0))


def step_by_step(job: tuple[str, int, bool]) -> StepRow:
    """One batch under the published protocol."""
    fault, seed, label_given = job
    chosen, model, trace = published_scenario(fault, seed), ScriptedModel("reasonable", reasonable), MemoryTrace()
    conditions = Conditions(AskingProtocol.PER_STEP, label_given)
    result = run(module(), chosen, trace, DeclaredClock(1.0), Proposing(Language(model), conditions, model_alone))
    alone = all(released.proposer == "language" for released in trace.of(ReleasedActions))
    scores = score_steps(module(), chosen, result.transcript)
    assert scores is not None, "every published fault leaves a way"
    return StepRow(
        fault, seed, label_given, result.complete_s is not None and alone, scores.plans,
        scores.plans_right, scores.actions, scores.actions_right, scores.on_right, scores.on_wrong, scores.on_missed,
        len(model.asked), sum(map(tokens_of, model.asked)),
    )  # fmt: skip


def routes_table(rows: Sequence[LanguageRow]) -> str:
    """One line per family."""
    lines = []
    for family in dict.fromkeys(r.family for r in rows):
        mine = [r for r in rows if r.family == family]
        asked = [r for r in mine if r.calls]
        smooth = [r for r in asked if not r.refused]
        lines.append([
            family, f"{sum(r.complete for r in mine)}/{len(mine)}", f"{sum(r.safe for r in mine)}/{len(mine)}",
            str(len(asked)), str(sum(r.by_model > 0 for r in mine)), str(len(smooth)),
            str(max((r.calls for r in smooth), default=0)), str(max((r.tokens for r in smooth), default=0)),
            str(max((r.calls for r in asked), default=0)), str(max((r.tokens for r in asked), default=0)),
        ])  # fmt: skip
    head = ["fault", "complete", "safe", "asked", "released", "nothing refused", "calls then, most",
            "tokens then, most", "calls, most", "tokens, most"]  # fmt: skip
    return table(head, lines)


def steps_table(rows: Sequence[StepRow]) -> str:
    """One line per fault and kind of diagnosis."""
    lines = []
    for fault, given in dict.fromkeys((r.fault, r.label_given) for r in rows):
        mine = [r for r in rows if (r.fault, r.label_given) == (fault, given)]
        on = sum(r.on_right for r in mine)
        lines.append([
            fault, "given" if given else "monitoring", f"{sum(r.success for r in mine)}/{len(mine)}",
            _percent(sum(r.plans_right for r in mine), sum(r.plans for r in mine)),
            _percent(sum(r.actions_right for r in mine), sum(r.actions for r in mine)),
            _percent(on, on + sum(r.on_wrong for r in mine)), _percent(on, on + sum(r.on_missed for r in mine)),
            f"{median(r.calls for r in mine):.0f}", f"{median(r.tokens for r in mine) / 1000:.1f}",
        ])  # fmt: skip
    head = ["fault", "label", "success", "plan correctness [%]", "action correctness [%]", "precision [%]",
            "recall [%]", "calls, median", "tokens in, median [k]"]  # fmt: skip
    return table(head, lines)


def _percent(part: int, whole: int) -> str:
    return f"{100 * part / whole:.1f}" if whole else ""
