"""The card in sentences, from its facts and nothing else."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from homeostat.console.card.card import Card, Explanation, LetBe, Move, PredictedMargin, Proposal
from homeostat.console.card.foresight import Foresight
from homeostat.domain.certificate import Certificate


@dataclass(frozen=True, slots=True)
class Paragraph:
    """One part."""

    heading: str
    """What it is about."""
    text: str
    """Sentences."""


def explained(card: Card) -> tuple[Paragraph, ...]:
    """Everything that ``card`` says, in the order in which an operator asks."""
    parts = {
        "What is wrong": _wrong(card),
        "Why that is believed": _believed(card),
        "If nothing is done": _alone(card),
        "What is proposed": _proposed(card),
        "Why it is safe": _safe(card),
        "What it costs": _costs(card),
        "What does not stand any more, and why": _fallen(card),
        "What was refused": (f"At {r.at_s:.0f} s: {r.what}, because {r.why}" for r in card.refused),
        "What acted": _acted(card),
        "Notes": iter(card.notes),
    }
    told = ((heading, " ".join(_sentence(s) for s in sentences)) for heading, sentences in parts.items())
    return tuple(Paragraph(heading, text) for heading, text in told if text)


def _sentence(text: str) -> str:
    text = text.strip()
    return text if text.endswith((".", "!", "?")) else f"{text}."


def _wrong(card: Card) -> Iterator[str]:
    probable = "" if card.probability is None else f", {_percent(card.probability)} probable"
    size = f", size {card.explanations[0].size}" if card.explanations and card.explanations[0].size else ""
    yield f"{card.headline}{probable}{size}"
    yield f"Seen at {card.since_s:.0f} s" + ("" if card.over_s is None else f", over at {card.over_s:.0f} s")
    if card.diagnosed_s is None:
        yield "Nothing was diagnosed"


def _believed(card: Card) -> Iterator[str]:
    for seen in card.seen:
        times = "" if seen.times is None else f", {abs(seen.times):.2g} times its threshold"
        value = "" if seen.value is None else f" ({_deviation(seen.value, seen.unit)} from its reference)"
        yield f"{seen.text} ({seen.rule}){times}{value}"
    for explanation in card.explanations:
        yield _explanation(explanation)
    if card.apart:
        yield f"They are told apart by {card.apart}"


def _explanation(one: Explanation) -> str:
    where = f" at {one.component}" if one.component else ""
    size = f", size {one.size}" if one.size else ""
    parts = [f"{_percent(one.probability)} for {one.text!r}{where}{size}"]
    parts += [f"seen for it: {', '.join(one.supports)}"] if one.supports else []
    parts += [f"not seen, though it may show: {', '.join(one.lacks)}"] if one.lacks else []
    parts += [f"seen, and not linked to it: {', '.join(one.others)}"] if one.others else []
    return "; ".join(parts)


def _alone(card: Card) -> Iterator[str]:
    if card.foresight is not None:
        done = [acted.at_s for acted in card.acted]
        done += [] if card.released_s is None else [card.released_s]
        if done and max(done) >= card.foresight.told.from_s - 1.0:
            yield "The twin has not looked ahead since something was done; before that it foresaw this"
        if not card.explanations:
            yield "No cause is known, so the twin takes the plant for healthy"
        yield from _foreseen(card.foresight)
    if card.alone:
        yield card.alone
    if card.let_be is not None:
        let_be = card.let_be
        yield f"It was left as it is in {let_be.state!r} at {let_be.at_s:.0f} s"


def _foreseen(foresight: Foresight) -> Iterator[str]:
    told = foresight.told
    if not told.members:
        yield f"The twin cannot say what follows: {told.note}"
    elif told.first is None:
        within = f"within {told.length_s:.0f} s in any of {told.members} members"
        yield f"From {told.from_s:.0f} s on no hard limit is reached {within}"
    else:
        first = told.first
        yield (
            f"The first hard limit is reached from {told.from_s + first.earliest_s:.0f} s to "
            f"{told.from_s + first.latest_s:.0f} s, in half of the members that reach it by "
            f"{told.from_s + first.middle_s:.0f} s: {foresight.limit}; {first.members} of {told.members} members, "
            f"{_percent(first.probability)} probable"
        )


def _proposed(card: Card) -> Iterator[str]:
    if card.proposal is None:
        yield "Nothing is proposed" if card.fallen is None else "Nothing is proposed any more"
        return
    yield from _told(card.proposal)
    yield f"It is {card.proposal.status}"
    yield from (f"Its proposer says: {reason}" for reason in card.proposal.reasons)


def _told(proposal: Proposal) -> Iterator[str]:
    """What it is, and everything that it would write."""
    lasting = f" for {proposal.seconds:g} s" if proposal.seconds else ""
    way = f": {' to '.join(proposal.path)}" if proposal.path else ""
    yield f"A {proposal.what}{lasting} by {proposal.proposer}, judged at {proposal.at_s:.0f} s{way}"
    yield from map(_move, proposal.moves)
    for step in proposal.later:
        moves = "; ".join(map(_move, step.moves)) or "nothing more is commanded"
        yield f"Then, when {step.guard}, to {step.state}: {moves}"


def _fallen(card: Card) -> Iterator[str]:
    """What fell last; its margins say what was wrong with it, and make nothing safe."""
    fallen = card.fallen
    if fallen is None:
        return
    yield from _told(fallen)
    released = "" if fallen.released_s is None else f"; it was released at {fallen.released_s:.0f} s"
    yield f"Since {fallen.since_s:.0f} s it is {fallen.status}{released}"
    yield from (_margin(margin, fallen.members) for margin in fallen.margins)


def _move(move: Move) -> str:
    before = _target(move.before, move.unit) if move.known else "a value that is not known"
    ramp = "" if move.rate is None else f", by {_amount(move.rate, move.unit)} a second"
    after = _target(move.after, move.unit)
    for digits in range(4, 8):  # as many as it takes to tell them apart
        if before != after or not move.known:
            return f"{move.tag} ({move.text}) from {before} to {after}{ramp}"
        before, after = (_target(value, move.unit, digits + 1) for value in (move.before, move.after))
    return f"{move.tag} stays at {_target(move.after, move.unit)}"


def _safe(card: Card) -> Iterator[str]:
    proposal, let_be = card.proposal, card.let_be
    if proposal is None:
        if let_be is not None and not card.acted:
            yield from _without_action(let_be)
        return
    yield "Every check holds" if proposal.approved else "Not every check holds"
    yield from (_margin(margin, proposal.members) for margin in proposal.margins)
    if proposal.checks:
        what = "permissive or target was" if proposal.checks == 1 else "permissives and targets were"
        yield f"{proposal.checks} {what} judged beside them"
    if proposal.certificate is not None:
        yield _certified(proposal.certificate)
    if proposal.foresight is not None:
        yield from _foreseen(proposal.foresight)


def _certified(shown: Certificate) -> str:
    violated = f"{shown.violations} of {shown.draws} draws {shown.told}"
    return f"{violated}: at most {shown.percent} %, with {_percent(shown.level)} confidence"


def _without_action(let_be: LetBe) -> Iterator[str]:
    yield "Every check holds without action" if let_be.margin >= 0.0 else "Not every check holds without action"
    yield from (_margin(margin, let_be.members) for margin in let_be.margins)
    if not let_be.margins:
        yield f"The least margin is {let_be.margin:+.3g}; whose it is this record does not say"
    elif let_be.checks:
        what = "permissive or other condition was" if let_be.checks == 1 else "permissives and other conditions were"
        yield f"{let_be.checks} {what} judged beside them"


def _margin(margin: PredictedMargin, members: int) -> str:
    text = (
        f"{margin.text or margin.name} ({margin.name}): {_distance(margin.margin, margin.unit, margin.term)} at worst, "
        f"after {margin.at_s:.0f} s, in member {margin.member} of {members}"
    )
    text += ", as good as it can be" if margin.full else ""
    text += "" if margin.hard else ", which has a price and does not forbid"
    if margin.actual is None:
        return text
    return f"{text}; {_distance(margin.actual, margin.actual_unit, margin.actual_term)} in the readings since"


def _distance(value: float, unit: str, term: str) -> str:
    """A margin; where the formula has several units, beside the comparison whose it is."""
    if term:
        return f"{value:+.3g}{'' if unit in ('1', '') else f' {unit}'} to {term!r}"
    return f"{value:+.3g} times what counts in its units" if unit == "1" else f"{value:+.3g} {unit}"


def _costs(card: Card) -> Iterator[str]:
    for choice in card.choices:
        by = f" by {choice.by}" if choice.by else ""
        admitted = f", not admitted: {choice.refused}" if choice.refused else ", chosen" if choice.chosen else ""
        shown = f" ({_certified(choice.certificate)})" if choice.certificate is not None else ""
        cost = f"{choice.cost:.1f} {card.currency}" if math.isfinite(choice.cost) else "at a cost that is not known"
        yield f"{choice.what}{by} {cost}{shown}{admitted}"


def _acted(card: Card) -> Iterator[str]:
    for acted in card.acted:
        yield f"Fallback {acted.strategy!r} at {acted.at_s:.0f} s, because {acted.reason}"
        yield from map(_move, acted.moves)
        yield "The plant was read to hold it" if acted.stands else "The plant was not read to hold it yet"


def _target(value: float | None, unit: str, digits: int = 4) -> str:
    return "automatic" if value is None else _amount(value, unit, digits)


def _amount(value: float, unit: str, digits: int = 4) -> str:
    return f"{value:.{digits}g}" if unit == "1" else f"{value:.{digits}g} {unit}"


def _deviation(value: float, unit: str) -> str:
    return f"{value:+.3g}" if unit == "1" else f"{value:+.3g} {unit}"


def _percent(share: float) -> str:
    """A share in percent; only what is certain is 100 %."""
    if 0.995 <= share < 1.0:
        return f"{100 * share:.1f} %" if share < 0.9995 else "> 99.9 %"
    return f"{100 * share:.2g} %" if 0.0 < share < 0.01 else f"{100 * share:.0f} %"
