"""Outcomes: how a run ended, in one word."""

from enum import StrEnum
from typing import Final


class Outcome(StrEnum):
    """What truly happened, judged on the plant's true values over the whole run: the first that applies, as listed."""

    LIMIT_VIOLATED = "limit_violated"
    """A hard limit was violated after detection although a fallback, or what was released, would have kept it had it
    acted at detection; or the plant ended outside its hard limits."""
    FALLBACK = "fallback"
    """The fallback acted."""
    NOT_DETECTED = "not_detected"
    """A fault that violates a limit was never detected."""
    NEEDLESS_ACTION = "needless_action"
    """Something was released although leaving alone keeps every hard limit and costs no more, in the plant's currency:
    what was done gained nothing by the prices that decisions go by, soft criteria and releases included."""
    RECOVERED = "recovered"
    """Something was released, and the plant produces: its batch is complete, or at the end it is fed and delivers."""
    NO_ACTION = "no_action"
    """Nothing was released: no request was written, not even in part or in vain."""
    HELD = "held"
    """Something was released, and the plant is safe but produces nothing, or next to nothing, at the end."""

    @property
    def good(self) -> bool:
        """Whether it is what a run is made for: recovered, or rightly left alone."""
        return self in (Outcome.RECOVERED, Outcome.NO_ACTION)


FORMER: Final = "handed_over"
"""Outcome in older records: the fallback acted, or the plant ended outside its hard limits."""


def outcome_named(text: str, fell_back: bool) -> Outcome:
    """The outcome that a record names, also an older one; ``fell_back``: whether the fallback acted in it.

    ValueError where there is no such outcome.
    """
    if text == FORMER:
        return Outcome.FALLBACK if fell_back else Outcome.LIMIT_VIOLATED
    return Outcome(text)
