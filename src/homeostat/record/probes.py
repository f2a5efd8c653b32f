"""Probes of a run: each test move and wait with what came of it."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from homeostat.domain.events.recovery import Probed, ProbeEnded
from homeostat.journal.memory import Entry


@dataclass(frozen=True, slots=True)
class ProbeMade:
    """One test move or wait, as ``result.json`` has it."""

    at_s: float
    """When it began, in process time [s]."""
    seconds: float
    """How long it was to last [s]."""
    state: str
    """State that the plant was brought to; empty for a wait."""
    apart: tuple[str, ...]
    """The two explanations that it was to tell apart."""
    nats: float
    """Predicted evidence between them [nats]."""
    value: float
    """Production that knowing more was expected to win [1]."""
    cost: float
    """Production that it was expected to cost [1]."""
    likeliest: str | None = None
    """What explained the readings best when it was over; None where nobody looked."""
    probability: float | None = None
    """Its probability [0, 1]."""
    told: bool = False
    """Whether that was enough to act on it alone."""


def probes_made(entries: Iterable[Entry]) -> tuple[ProbeMade, ...]:
    """The probes in the ``entries`` of a trace, in order."""
    found: list[ProbeMade] = []
    for entry in entries:
        match entry.event:
            case Probed() as e:
                found.append(ProbeMade(entry.at_s, e.seconds, e.state, e.apart, e.nats, e.value, e.cost))
            case ProbeEnded() as e if found:
                ended = replace(found[-1], likeliest=e.likeliest, probability=e.probability, told=e.told)
                found[-1] = ended
    return tuple(found)
