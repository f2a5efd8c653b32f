"""The proposal of an episode: what is to be written, how it was judged, and what came of it."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from homeostat.console.card.card import LaterMoves, Move, Proposal
from homeostat.console.card.foresight import beside, with_actions
from homeostat.console.card.margins import predicted_margins, with_actual
from homeostat.console.opened import KnownPlant
from homeostat.console.readings import Readings
from homeostat.console.situation import situation
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.events.guard import GuardStarted, RequestAnswered
from homeostat.domain.events.recovery import Attempted, Compared, LaterStep, ReleasedActions, Remarked
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.recovery import Command
from homeostat.domain.remark import RemarkKind
from homeostat.domain.request import RequestStatus
from homeostat.journal.memory import Entry
from homeostat.record.releases import Release
from homeostat.record.run_record import RunRecord
from homeostat.record.story.wording import who

ADVISED: Final = "advised; in this mode nobody writes"
"""Status of what a person may do, and nobody else does."""
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
        margins = with_actual(margins, released, record, plant, (readings, at_s))
    known = plant.description
    steps = told[-1].then if told else tried.then
    later = _later(steps, tried.commands, before, known)
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
        RequestStatus.ADVISED.value: ADVISED,
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
    return _moves(commands, situation(before).targets, plant)


def _later(
    steps: Iterable[LaterStep], first: Iterable[Command], before: Sequence[Entry], plant: PlantDescription
) -> tuple[LaterMoves, ...]:
    """What follows the ``first`` commands, each beside what its tag is at by then."""
    targets = situation(before).targets | {order.tag: order.value for order in first}
    made = []
    for step in steps:
        made.append(LaterMoves(step.guard, state_label(step.target, plant), _moves(step.commands, targets, plant)))
        targets |= {order.tag: order.value for order in step.commands}
    return tuple(made)


def _moves(
    commands: Iterable[Command], targets: Mapping[str, float | None], plant: PlantDescription
) -> tuple[Move, ...]:
    tags = plant.tags_by_name
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
