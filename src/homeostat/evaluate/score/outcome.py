"""What truly happened in a run, in one word; the only place that may say 'recovered'."""

from __future__ import annotations

from dataclasses import dataclass

from homeostat.domain.outcome import Outcome


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
    """There was a fault that violates a limit, and it was never detected."""
    released: bool
    """Something was released: the guard has begun to write a request, whatever became of it."""
    needless: bool
    """Leaving alone keeps every hard limit and loses no more production."""
    produces: bool
    """The batch is complete with its product; a plant that knows no end is fed at the end."""


def outcome(facts: Facts) -> Outcome:
    """The first outcome that applies."""
    if facts.avoidable or not facts.inside_at_end:
        return Outcome.LIMIT_VIOLATED
    if facts.fell_back:
        return Outcome.FALLBACK
    if facts.missed:
        return Outcome.NOT_DETECTED
    if not facts.released:
        return Outcome.NO_ACTION
    if facts.needless:
        return Outcome.NEEDLESS_ACTION
    return Outcome.RECOVERED if facts.produces else Outcome.HELD
