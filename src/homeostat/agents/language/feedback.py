"""Feedback: what earlier attempts violated, and which command moves which margin how far."""

import math
from collections.abc import Mapping, Sequence

from homeostat.agents.language.prompt_files import fill
from homeostat.agents.language.situation import MOST_FINDINGS, margin_text, nearest, worst_first
from homeostat.domain.advice import COST, Advice, Attempt, Sensitivity
from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.limits import Criterion, Limit, LimitKind
from homeostat.domain.quotation import quote
from homeostat.domain.verdict import Approve, Finding
from homeostat.llm.model import APPROVED

LEAST_EFFECT = 1e-3
"""A change of margin per increment below this many scales is shown as none [1]."""
MOST_OWN = 3
"""Most approved proposals of its own that a model is told: the cheapest."""


def feedback_text(advice: Advice, plant: PlantDescription, currency: str = "") -> str:
    """A table of all that was refused, and the last one's violations with their sensitivities; empty before any.

    ``currency``: what costs are in.
    """
    refused = [a for a in advice.attempts if not isinstance(a.verdict, Approve)]
    if not refused:
        return ""
    scales = plant.scales
    shown = worst_first(advice.findings, scales)[:MOST_FINDINGS]
    judged = _last_judged(advice)
    violated = [_told(f, advice.sensitivities, plant, judged) for f in shown]
    near = _near(advice, plant)
    ranges = _ranges([*advice.findings, *judged.verdict.findings], advice.sensitivities) if violated or near else ""
    costs = (ranges, cost_slopes_text(advice.sensitivities, plant, currency), _automatic(judged))
    values = {
        "attempts": "\n".join(_attempt(attempt, scales) for attempt in refused),
        "number": str(judged.number),
        "violated": "\n".join((*violated, *near, *filter(None, costs))) or "nothing that was judged",
        "hint": f"Advice: {quote(advice.hint, 200)}" if advice.hint else "",
    }
    return fill("feedback", values)


def standing_text(best: Alternative | None, attempts: Sequence[Attempt], currency: str) -> str:
    """One line on what the best so far costs, and on what is approved of the model's own; empty for nothing.

    ``attempts``: its own.
    """
    if best is None:
        return ""
    own = [(a.cost.total, a) for a in attempts if isinstance(a.verdict, Approve) and a.cost is not None]
    cheapest = sorted(own, key=lambda pair: pair[0])[:MOST_OWN]
    lead = f"the best so far costs {best.cost.total:.3g} {currency}: {best.told}."
    if not own:
        return lead[0].upper() + lead[1:]
    told = "; ".join(f"{_path(a)}: {command_text(a)}, costs {total:.3g} {currency}" for total, a in cheapest)
    return f"{APPROVED}{told}; {lead} Only something else that costs less is released instead; say so if there is none."


def _near(advice: Advice, plant: PlantDescription) -> list[str]:
    """What the last attempt met only just, where a command moves it: curing one must not break the other."""
    told = []
    for f in nearest(_last_judged(advice).verdict.findings, plant.scales):
        if any(s.criterion == f.criterion and s.slope for s in advice.sensitivities):
            told.append(f"holds only just: {_told(f, advice.sensitivities, plant, _last_judged(advice))}")
    return told


def _last_judged(advice: Advice) -> Attempt:
    """The attempt that the findings of ``advice`` are about: the last refused one that was rolled out, or the last."""
    refused = [a for a in advice.attempts if not isinstance(a.verdict, Approve)]
    return next((a for a in reversed(refused) if a.members), refused[-1])


def _told(
    finding: Finding, slopes: Sequence[Sensitivity], plant: PlantDescription, judged: Attempt | None = None
) -> str:
    """One finding, the hypothesis that fails, its formula, and what one step of each command does to it."""
    under = None if judged is None else judged.under(finding.member)
    failing = "" if under is None else f" under {_named(under)}"
    formula, effects = _formula(finding.criterion, plant), _effects(finding, slopes, plant)
    rest = f": {formula}" if formula else ""
    return f"{margin_text(finding)}{failing}{rest}{effects}"


def _named(hypothesis: Hypothesis) -> str:
    """Its faults with their sizes: ``cool_stuck_closed 0.7``, ``T1_swings 3 every 300 s``."""
    told = (
        f"{f.fault} {f.severity:.3g}{f' every {f.period_s:.0f} s' if f.period_s else ''}" for f in hypothesis.faults
    )
    return " + ".join(told) or "nothing is wrong"


def cost_slopes_text(slopes: Sequence[Sensitivity], plant: PlantDescription, currency: str) -> str:
    """What one step of each command changes in cost, and between which values that was looked at; empty for none."""
    told = []
    for s in slopes:
        if s.criterion == COST and math.isfinite(s.slope):
            step = plant.tag(s.tag).increment or plant.tag(s.tag).scale
            told.append(f"{s.tag} {step:+g} -> {s.slope * step:+.2g} {currency} ({s.low:.4g} to {s.high:.4g})")
    return f"Cost per step, between the values in brackets: {', '.join(told)}" if told else ""


def _ranges(findings: Sequence[Finding], slopes: Sequence[Sensitivity]) -> str:
    """Between which values of each command the margins of ``findings`` were looked at; empty where no slope is told."""
    names = {f.criterion for f in findings}
    found = {s.tag: (s.low, s.high) for s in slopes if s.criterion in names and math.isfinite(s.high - s.low)}
    told = ", ".join(f"{tag} {low:.4g} to {high:.4g}" for tag, (low, high) in found.items())
    return f"Margins per step, looked at between: {told}" if told else ""


def _automatic(judged: Attempt) -> str:
    """The commands that an attempt left on automatic; empty for none."""
    if judged.actions is None or judged.path is None:
        return ""
    chosen = judged.actions.choices(judged.path.commanded_states)
    names = [tag for tag, value in chosen.items() if value is None]
    return f"On automatic, so without an effect per step: {', '.join(names)}" if names else ""


def idle_text(findings: Sequence[Finding], slopes: Sequence[Sensitivity], plant: PlantDescription) -> str:
    """What leaving the plant alone violates, and what one step of each command away from the present would change."""
    violated = worst_first(findings, plant.scales)[:MOST_FINDINGS]
    if not violated:
        return ""
    told = (_told(f, slopes, plant) for f in violated)
    return "\n".join(("# What leaving it alone violates", *told, *filter(None, (_ranges(violated, slopes),))))


def command_text(attempt: Attempt) -> str:
    """What was chosen in an attempt: ``T1.sp=310 F1.sp=0.0255``."""
    if attempt.kind is AlternativeKind.WAIT:
        return "nothing released"
    if attempt.actions is None or attempt.path is None:
        return "no usable commands"
    chosen = attempt.actions.choices(attempt.path.commanded_states)
    told = (f"{tag}={'auto' if value is None else format(value, '.6g')}" for tag, value in chosen.items())
    return " ".join(told) or "as by design"


def _attempt(attempt: Attempt, scales: Mapping[str, float]) -> str:
    worst = "; ".join(margin_text(f) for f in worst_first(attempt.verdict.findings, scales)[:3])
    return f"{attempt.number}. {_path(attempt)}: {command_text(attempt)}: {worst}"


def _path(attempt: Attempt) -> str:
    """What was proposed, without its commands: ``normal > reduced_load``, ``wait 30 s``."""
    path = " > ".join(attempt.path.states) if attempt.path else "no usable path"
    if attempt.kind is AlternativeKind.WAIT:
        return f"wait {attempt.seconds:g} s"
    if attempt.kind is not AlternativeKind.RELEASE:
        return f"{attempt.kind.value} {path} for {attempt.seconds:g} s"
    return path


def _formula(name: str, plant: PlantDescription) -> str:
    """What a finding is about as a formula, a permissive with its meaning; empty where it is no formula."""
    rules: tuple[Criterion | Limit, ...] = (*plant.limits.criteria, *plant.limits.watched.limits)
    for rule in rules:
        if rule.name == name:
            needed = isinstance(rule, Limit) and rule.kind is LimitKind.PERMISSIVE
            return f"{rule.formula.text} ({quote(rule.description, 80)})" if needed else rule.formula.text
    kind, _, about = name.partition("-")
    if kind == "TARGET":
        return next((s.settled_when.text for s in plant.machine.states if s.name == about), "")
    if kind == "GUARD":
        return next((t.guard.text for t in plant.machine.transitions if t.name == about), "")
    return ""


def _effects(finding: Finding, slopes: Sequence[Sensitivity], plant: PlantDescription) -> str:
    """How one increment of each command changes the margin: ``; margin per step: F1.sp +0.0005 -> -0.16 K``."""
    shown = "" if finding.unit == "1" else f" {finding.unit}"
    least = LEAST_EFFECT * plant.scales.get(finding.unit, 1.0)
    told = []
    for s in slopes:
        if s.criterion == finding.criterion:
            tag = plant.tag(s.tag)
            step = tag.increment or tag.scale
            change = s.slope * step
            effect = f"{change:+.3g}{shown}" if abs(change) >= least else "no change"
            told.append(f"{s.tag} {step:+g} -> {effect}")
    return f"; margin per step: {', '.join(told)}" if told else ""
