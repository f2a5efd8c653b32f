"""The situation in words and numbers: what every prompt says about the plant now."""

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from homeostat.agents.hypotheses import plausible
from homeostat.agents.roles import Situation
from homeostat.domain.diagnosis import Diagnosis, Hypothesis
from homeostat.domain.plant.description import PlantDescription, Relation
from homeostat.domain.quotation import quote, quoted
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Finding

SHOWN: Final = (Relation.MEASURES, Relation.SETS, Relation.DRIVES)
"""Relations of the tags that are shown: readings, setpoints and commands."""
MEAN: Final = 15
"""Readings that a trend averages at either end."""
TREND: Final = 60
"""Readings that a trend looks back."""
MOST_FINDINGS: Final = 6
"""Most violated checks that are listed."""
MOST_NEAR: Final = 4
"""Most checks that hold only just that are listed."""
NOT_JUDGED: Final = " (not judged)"
"""Marks a hypothesis under which nothing is tried."""
NOTE_LIMIT: Final = 300
"""Longest operator note that is shown [characters]."""


def situation_text(situation: Situation, plant: PlantDescription, notes: Sequence[str] = (), idle: bool = True) -> str:
    """What is seen, the diagnosis, where the plant is going, and, with ``idle``, what happens without action."""
    state = plant.machine.state(situation.state)
    lines = [
        f"State {situation.state} ({quote(state.label)}) at {situation.snapshot.at_s:.0f} s; "
        f"{situation.deadline_s:.0f} s left to decide.",
        _symptoms(situation, plant),
        *_hypotheses(situation.diagnosis, plant),
        f"Now (change per minute): {_tags(situation, plant)}.",
        f"Without action: {_idle(situation.idle, plant.scales)}." if idle else "",
        _acts(situation),
        f"Decided before: {'; '.join(quoted(line, 120) for line in situation.earlier)}." if situation.earlier else "",
    ]
    lines += [f"Operator's note: {quote(note, NOTE_LIMIT)}" for note in notes[:3]]
    return "\n".join(line for line in lines if line)


def worst_first(findings: Sequence[Finding], scales: Mapping[str, float]) -> list[Finding]:
    """The violated findings, in scales of their units, worst first."""
    return sorted((f for f in findings if not f.satisfied), key=lambda f: (f.relative(scales), f.criterion))


def nearest(findings: Sequence[Finding], scales: Mapping[str, float]) -> list[Finding]:
    """The findings that hold by less than one scale of their unit, nearest to violation first."""
    close = [f for f in findings if f.satisfied and f.relative(scales) < 1.0]
    return sorted(close, key=lambda f: (f.relative(scales), f.criterion))[:MOST_NEAR]


def margin_text(finding: Finding) -> str:
    """Name, signed margin with unit, time of the worst point, and who violates it; else the message.

    That is told where some members hold: what all of them violate says so by its margin.
    """
    if math.isinf(finding.margin):
        return f"{finding.criterion} {quote(finding.message, 160)}"
    unit = "" if finding.unit == "1" else f" {finding.unit}"
    told = f"{finding.criterion} {finding.margin:+.3g}{unit} at {finding.at_s:.0f} s"
    who = finding.violating
    return told if who is None or who.members == who.of else f"{told} in {who}"


def ranked(hypotheses: Sequence[Hypothesis]) -> list[list[Hypothesis]]:
    """The hypotheses of all sizes by the combination of faults that they name, the most probable combination first."""
    by_name: dict[str, list[Hypothesis]] = {}
    for hypothesis in hypotheses:
        by_name.setdefault(hypothesis.name, []).append(hypothesis)
    return sorted(by_name.values(), key=lambda group: -sum(h.probability for h in group))


def _acts(situation: Situation) -> str:
    """When a fallback acts; empty where none need."""
    if situation.act_by_s is None:
        return ""
    left_s = max(situation.act_by_s - situation.snapshot.at_s, 0.0)
    return f"A fallback acts in {left_s:.0f} s unless something is released."


def _symptoms(situation: Situation, plant: PlantDescription) -> str:
    words = {rule.name: rule.description for rule in plant.symptom_rules}
    seen = sorted(situation.diagnosis.symptoms, key=lambda s: -s.severity)[:MOST_FINDINGS]
    told = [f"{s.rule} {quote(words.get(s.rule, ''), 60)} {s.severity:.1f}x threshold" for s in seen]
    return f"Symptoms: {'; '.join(told)}." if told else ""


def _hypotheses(diagnosis: Diagnosis, plant: PlantDescription) -> list[str]:
    """One line per combination of faults: all that a proposal is judged by, and the likeliest others, marked.

    Where what is judged is not among those, as where probably nothing is wrong, it is said besides.
    """
    judged, groups = {h.name: h for h in plausible(diagnosis)}, ranked(diagnosis.hypotheses)
    lines = []
    for k, group in enumerate(groups):
        if k < MOST_FINDINGS or group[0].name in judged:
            mark = "" if group[0].name in judged or group[0].something_else else NOT_JUDGED
            lines.append(f"Hypothesis p={sum(h.probability for h in group):.2f}{mark}: {_faults(group, plant)}.")
    besides = [[h] for name, h in judged.items() if all(name != group[0].name for group in groups)]
    return [*lines, *(f"Judged as if this were so: {_faults(group, plant)}." for group in besides)]


def _faults(group: Sequence[Hypothesis], plant: PlantDescription) -> str:
    """A combination of faults, with between what its true size lies, or the sizes that the twin has."""
    if group[0].something_else:
        return "something else, which the twin cannot show"
    told = []
    for k, first in enumerate(group[0].faults):
        fault = plant.fault_mode(first.fault)
        sizes = group[0].between or [h.faults[k].severity for h in group]
        unit = "" if fault.severity_unit == "1" else f" {fault.severity_unit}"
        size = f"{min(sizes):.3g}" if max(sizes) - min(sizes) < 1e-9 else f"{min(sizes):.3g} to {max(sizes):.3g}"
        since = f"{f' every {first.period_s:.0f} s' if first.period_s else ''}, since {first.onset_s:.0f} s"
        sized = "" if fault.sizeless else f", severity {size}{unit}"
        told.append(f"{first.fault} ({quote(fault.label, 60)}){sized}{since}")
    return " and ".join(told) or "nothing is wrong"


def _tags(situation: Situation, plant: PlantDescription) -> str:
    """Every reading, setpoint and command with its change, and what is the matter with those that are not good."""
    told, now = [], situation.snapshot
    for signal in plant.signals:
        name, value = signal.tag.name, now.values.get(signal.tag.name, math.nan)
        lacking = (
            name in now.bad or name in now.uncertain or (signal.relation is Relation.MEASURES and name in now.values)
        )
        if signal.relation not in SHOWN or not (math.isfinite(value) or lacking):
            continue  # a setpoint that is not in force has no value, and nothing is the matter with it
        unit = "" if signal.tag.unit == "1" else f" {signal.tag.unit}"
        known = math.isfinite(value) and name not in now.bad
        change = _trend(situation.recent, name, plant.timing.tick_s) if known else None
        moving = change is not None and abs(change) >= 0.05 * signal.tag.scale
        shown = f"{value:.4g}{unit}" if math.isfinite(value) else "no value"
        told.append(f"{name} {shown}{quality_text(name, now)}" + (f" ({change:+.2g})" if moving else ""))
    return ", ".join(told)


def quality_text(tag: str, now: Snapshot) -> str:
    """What is the matter with a reading: `` [bad: frozen since 1200 s]``; empty where it is good."""
    if tag not in now.bad and tag not in now.uncertain and tag not in now.frozen_s:
        return ""
    quality = "uncertain" if tag in now.uncertain and tag not in now.bad else "bad"
    if tag in now.frozen_s:
        return f" [{quality}: frozen since {now.frozen_s[tag]:.0f} s]"
    reason = now.reasons.get(tag, "")
    return f" [{quality}: {quote(reason, 60)}]" if reason else f" [{quality}]"


def _trend(recent: Sequence[Snapshot], tag: str, tick_s: float) -> float | None:
    """Change per minute between two averages; None where the past is too short."""
    if len(recent) < TREND + MEAN:
        return None
    values = [snapshot.values.get(tag, math.nan) for snapshot in recent[-TREND - MEAN :]]
    change = float(np.mean(values[-MEAN:]) - np.mean(values[:MEAN])) * 60.0 / (TREND * tick_s)
    return change if math.isfinite(change) else None


def _idle(findings: Sequence[Finding], scales: Mapping[str, float]) -> str:
    violated = worst_first(findings, scales)
    if not violated:
        return "every criterion holds"
    more = f"; and {len(violated) - MOST_FINDINGS} more" if len(violated) > MOST_FINDINGS else ""
    return "; ".join(margin_text(f) for f in violated[:MOST_FINDINGS]) + more
