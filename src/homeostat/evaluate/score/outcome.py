"""Outcomes: what truly happened in a run, in one word; the only place that may say 'recovered'."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final


class OutcomeKind(StrEnum):
    """What truly happened, judged on the plant's true values over the whole run: the first that applies, as listed."""

    LIMIT_VIOLATED = "limit_violated"
    """A hard limit was violated after detection although a fallback, or what was released, would have kept it had it
    acted at detection; or the plant ended outside its hard limits."""
    FALLBACK = "fallback"
    """The fallback acted."""
    NOT_DETECTED = "not_detected"
    """A fault that violates a limit was never reported."""
    NEEDLESS_ACTION = "needless_action"
    """Something was released although leaving alone keeps every hard limit and loses no more production."""
    RECOVERED = "recovered"
    """Something was released, and the plant produces: its batch is complete, or it is fed at the end."""
    NO_ACTION = "no_action"
    """Nothing was released: no request was written, not even in part or in vain."""
    HELD = "held"
    """Something was released, and the plant is safe but does not produce."""

    @property
    def good(self) -> bool:
        """Whether it is what a run is made for: recovered, or rightly left alone."""
        return self in (OutcomeKind.RECOVERED, OutcomeKind.NO_ACTION)


FORMER: Final = "handed_over"
"""Outcome in older records: the fallback acted, or the plant ended outside its hard limits."""


def outcome_kind(text: str, fell_back: bool) -> OutcomeKind:
    """The outcome that a record names, also an older one; ``fell_back``: whether the fallback acted in it.

    ValueError where there is no such outcome.
    """
    if text == FORMER:
        return OutcomeKind.FALLBACK if fell_back else OutcomeKind.LIMIT_VIOLATED
    return OutcomeKind(text)


@dataclass(frozen=True, slots=True)
class Facts:
    """What an outcome follows from."""

    avoidable: bool
    """A hard limit was violated after detection that a fallback, or what was released, would have kept."""
    inside_at_end: bool
    """The plant kept its hard limits at the end."""
    fell_back: bool
    """The fallback acted."""
    missed: bool
    """There was a fault that violates a limit, and it was never reported."""
    released: bool
    """Something was released: the guard has begun to write a request, whatever became of it."""
    needless: bool
    """Leaving alone keeps every hard limit and loses no more production."""
    produces: bool
    """The batch is complete with its product; a plant that knows no end is fed at the end."""


def outcome(facts: Facts) -> OutcomeKind:
    """The first outcome that applies."""
    if facts.avoidable or not facts.inside_at_end:
        return OutcomeKind.LIMIT_VIOLATED
    if facts.fell_back:
        return OutcomeKind.FALLBACK
    if facts.missed:
        return OutcomeKind.NOT_DETECTED
    if not facts.released:
        return OutcomeKind.NO_ACTION
    if facts.needless:
        return OutcomeKind.NEEDLESS_ACTION
    return OutcomeKind.RECOVERED if facts.produces else OutcomeKind.HELD
