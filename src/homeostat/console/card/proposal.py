"""The proposal of an episode: what is to be written, how it was judged, and what came of it."""

from collections.abc import Iterable, Mapping, Sequence

from homeostat.console.card.card import LaterMoves, Move, Proposal
from homeostat.console.card.foresight import beside, with_actions
from homeostat.console.card.margins import predicted_margins, with_actual
from homeostat.console.card.standing import Standing
from homeostat.console.opened import KnownPlant
from homeostat.console.readings import Readings
from homeostat.console.situation import situation
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.events.recovery import Attempted, LaterStep, ReleasedActions, Remarked
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.recovery import Command
from homeostat.domain.remark import RemarkKind
from homeostat.journal.memory import Entry
from homeostat.record.certified import certified
from homeostat.record.run_record import RunRecord
from homeostat.record.story.wording import who


def proposal(
    standing: Standing | None,
    record: RunRecord,
    entries: Sequence[Entry],
    plant: KnownPlant,
    seen: tuple[Readings | None, float],
) -> Proposal | None:
    """What stands, or stood, in the episode of ``entries``, the last part of ``record``; None where nothing does.

    ``seen``: the readings, and the moment up to which they are looked at [s].
    """
    if standing is None or standing.judged is None or not isinstance(tried := standing.judged.event, Attempted):
        return None
    digest, judged_s = standing.digest, standing.judged.at_s
    before = record.entries[: next(n for n, e in enumerate(record.entries) if e is standing.judged)]
    releases = [r for r in record.releases if r.digest == digest and r.at_s >= judged_s]
    told = [e.event for e in entries if isinstance(e.event, ReleasedActions) and e.event.digest == digest]
    margins = predicted_margins(tried.findings, plant.description)
    readings, at_s = seen
    if standing.released_s is not None and releases and readings is not None:
        margins = with_actual(margins, releases[-1], record, plant, (readings, at_s))
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
        stands=standing.stands,
        status=standing.words,
        since_s=standing.since_s,
        released_s=standing.released_s,
        seconds=tried.seconds,
        path=tuple(state_label(name, known) for name in tried.path),
        moves=() if tried.what is AlternativeKind.WAIT else moves(tried.commands, before, known),
        later=() if tried.what is AlternativeKind.WAIT else later,
        reasons=tuple(dict.fromkeys(reasons))[-3:],
        approved=tried.approved,
        members=tried.members,
        margins=margins,
        checks=sum(f.criterion not in limits for f in tried.findings),
        certificate=certified(entries, digest, judged_s),
        foresight=with_actions(entries, digest, known),
        beside=beside(entries, digest, known),
    )


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
