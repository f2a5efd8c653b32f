"""The proposal of an episode: what is to be written, how it was judged, and what came of it."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from homeostat.console.card.card import LaterMoves, Move, PredictedMargin, Proposal
from homeostat.console.card.foresight import beside, with_actions
from homeostat.console.opened import KnownPlant
from homeostat.console.readings import Readings, Values
from homeostat.console.situation import situation
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.events.guard import GuardStarted, RequestAnswered
from homeostat.domain.events.recovery import Attempted, Compared, ReleasedActions, Remarked
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.limits import Criterion, Limit, LimitKind
from homeostat.domain.recovery import Command
from homeostat.domain.remark import RemarkKind
from homeostat.domain.request import RequestStatus
from homeostat.domain.verdict import Finding
from homeostat.journal.memory import Entry
from homeostat.record.releases import Release
from homeostat.record.run_record import RunRecord
from homeostat.record.story.wording import who
from homeostat.stl.formula import Formula, FormulaError
from homeostat.stl.text import render
from homeostat.stl.tree import Always

_SHOWN = (RequestStatus.OFFERED, RequestStatus.ADVISED)


def proposal(
    record: RunRecord, entries: Sequence[Entry], plant: KnownPlant, readings: Readings | None, at_s: float
) -> Proposal | None:
    """What is proposed in the episode of ``entries``, the last part of ``record``, at ``at_s`` [s]; None for nothing.

    It is what was chosen, offered or released last; before anything was, what was approved last.
    """
    digest = _digest(entries)
    found = [e for e in entries if isinstance(e.event, Attempted) and e.event.digest == digest and digest]
    if not found:
        return None
    judged_s, tried = found[-1].at_s, found[-1].event
    assert isinstance(tried, Attempted)
    before = record.entries[: record.entries.index(found[-1])]
    releases = [r for r in record.releases if r.digest == digest and r.at_s >= judged_s]
    released = releases[-1] if releases else None
    told = [e.event for e in entries if isinstance(e.event, ReleasedActions) and e.event.digest == digest]
    margins = predicted_margins(tried.findings, plant.description)
    if released is not None and readings is not None:
        margins = _with_actual(margins, released, record, plant, (readings, at_s))
    known = plant.description
    steps = told[-1].then if told else ()
    later = tuple(LaterMoves(s.guard, state_label(s.target, known), moves(s.commands, before, known)) for s in steps)
    limits = {m.name for m in margins}
    said = [e.event for e in entries if isinstance(e.event, Remarked) and e.at_s <= judged_s]
    reasons = [r.text for r in said if r.proposer == tried.proposer and r.remark is RemarkKind.REASONING]
    return Proposal(
        what=tried.what.value,
        digest=digest,
        proposer=who(tried.proposer, tried.polished),
        at_s=judged_s,
        status=_status(digest, entries, released, tried),
        released_s=None if released is None else released.at_s,
        seconds=tried.seconds,
        path=tuple(state_label(name, known) for name in tried.path),
        moves=() if tried.what is AlternativeKind.WAIT else moves(tried.commands, before, known),
        later=later,
        reasons=tuple(dict.fromkeys(reasons))[-3:],
        approved=tried.approved,
        members=tried.members,
        margins=margins,
        checks=sum(f.criterion not in limits for f in tried.findings),
        certificate=told[-1].certificate if told else None,
        foresight=with_actions(entries, digest, known),
        beside=beside(entries, digest, known),
    )


def _digest(entries: Iterable[Entry]) -> str:
    """Digest of what the episode is about now; empty for nothing."""
    found = approved = ""
    for entry in entries:
        match entry.event:
            case Attempted(approved=True, digest=digest):
                approved = digest
            case Compared(chosen=chosen) if chosen:
                found = chosen
            case RequestAnswered(status=status, digest=digest) if status in _SHOWN:
                found = digest
            case ReleasedActions(digest=digest):
                found = digest
    return found or approved


def _status(digest: str, entries: Iterable[Entry], released: Release | None, tried: Attempted) -> str:
    """How far a proposal came, in words, by the guard's last answer."""
    said = ""
    for entry in entries:
        match entry.event:
            case RequestAnswered(digest=answered, status=status) if answered == digest:
                said = status
            case GuardStarted() if said == RequestStatus.OFFERED:  # one that begins again knows of no request
                said = RequestStatus.WITHDRAWN.value
    words = {
        RequestStatus.OFFERED.value: "waits for a person's yes",
        RequestStatus.ADVISED.value: "advised; in this mode nobody writes",
        RequestStatus.REFUSED.value: "refused by the guard",
        RequestStatus.FAILED.value: "written, and the plant does not hold it",
        RequestStatus.WITHDRAWN.value: "withdrawn",
        RequestStatus.CONFIRMED.value: "released, and the plant holds it",
        RequestStatus.ACCEPTED.value: "is being written",
    }
    if said in words:
        return words[said]
    if released is not None:
        return "released"
    return "approved by every check, not released" if tried.approved else "refused"


def moves(commands: Iterable[Command], before: Sequence[Entry], plant: PlantDescription) -> tuple[Move, ...]:
    """``commands`` beside what their tags were at after the events ``before``."""
    targets, tags = situation(before).targets, plant.tags_by_name
    made = []
    for order in commands:
        tag = tags.get(order.tag)
        text, unit = (tag.description, tag.unit) if tag else ("", "")
        known = order.tag in targets
        made.append(Move(order.tag, text, unit, targets.get(order.tag), known, order.value, order.rate))
    return tuple(made)


def state_label(name: str, plant: PlantDescription) -> str:
    """A state in the operator's words; its name where the plant does not know it."""
    return next((state.label for state in plant.machine.states if state.name == name), name)


def predicted_margins(findings: Iterable[Finding], plant: PlantDescription) -> tuple[PredictedMargin, ...]:
    """Findings on limits and criteria, the nearest one first; permissives and targets are no margins to watch."""
    known: dict[str, Limit | Criterion] = {c.name: c for c in plant.limits.criteria}
    known |= {x.name: x for x in plant.limits.limits if x.kind is not LimitKind.PERMISSIVE}
    found = []
    for finding in findings:
        limit = known.get(finding.criterion)
        if limit is not None and math.isfinite(finding.margin):
            scaled = finding.relative(plant.scales)
            place = finding.margin, finding.unit, finding.at_s, finding.member, scaled
            found.append(PredictedMargin(limit.name, limit.description, limit.formula.text, *place, limit.hard))
    return tuple(sorted(found, key=lambda margin: margin.scaled))


def _with_actual(
    margins: Iterable[PredictedMargin],
    released: Release,
    record: RunRecord,
    plant: KnownPlant,
    seen: tuple[Readings, float],
) -> tuple[PredictedMargin, ...]:
    """Beside each prediction what the readings have come to since the release, as long as it was predicted for."""
    readings, at_s = seen
    later = [r.at_s for r in record.releases if r.at_s > released.at_s]
    later += [fell_s for fell_s, _ in record.fallbacks if fell_s > released.at_s]
    until_s = min([at_s, released.at_s + (plant.horizon_s or math.inf), *later])
    limits = plant.description.limits
    formulas = {c.name: c.formula for c in limits.criteria} | {x.name: x.formula for x in limits.limits}
    made = []
    for margin in margins:
        actual = _least(formulas[margin.name], readings, (released.at_s, until_s))
        made.append(margin if actual is None else replace(margin, actual=actual[0], actual_at_s=actual[1]))
    return tuple(made)


def _least(formula: Formula, readings: Readings, span: tuple[float, float]) -> tuple[float, float] | None:
    """Least margin of the readings in ``span`` [s], and when it was; None where there is none yet.

    Of a formula ``always[a,b] f`` it is that of ``f`` from ``a`` to ``b`` after the beginning.
    """
    from_s, to_s = span
    if isinstance(formula.root, Always):
        inner = formula.root
        from_s, to_s = from_s + inner.low_s, min(to_s, from_s + inner.high_s)
        formula = Formula(render(inner.operand), inner.operand, formula.unit)
    part = readings.between(from_s, to_s)
    times = readings.times_s[part]
    if not times.size or (math.isfinite(formula.horizon_s) and formula.horizon_s > 0.0):
        return None
    signals: dict[str, Values] = {tag: values[part] for tag, values in readings.signals.items() if tag in formula.tags}
    try:
        margins = formula.margins(signals, readings.dt_s)[0]
    except FormulaError:
        return None
    if not np.isfinite(margins).any():
        return None
    least = int(np.nanargmin(margins))
    return float(margins[least]), float(times[least])
