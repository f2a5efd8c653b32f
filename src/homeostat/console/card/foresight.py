"""What the twin foresees, on the card: if nothing is done, and with the proposal."""

from collections.abc import Sequence
from dataclasses import dataclass

from homeostat.domain.events.foresight import Foreseen
from homeostat.domain.plant.description import PlantDescription
from homeostat.journal.memory import Entry


@dataclass(frozen=True, slots=True)
class Foresight:
    """One rollout of the twin, in bands and in times until limits are violated."""

    told: Foreseen
    """The same as the journal has it; times in it are seconds after it begins."""
    limit: str
    """The hard limit that trips first, in the engineer's words; empty where none does."""


def alone(entries: Sequence[Entry], plant: PlantDescription) -> Foresight | None:
    """What follows if nothing is done, as it was foreseen last in ``entries``; None where the record does not say."""
    return _last(entries, "", plant)


def with_actions(entries: Sequence[Entry], digest: str, plant: PlantDescription) -> Foresight | None:
    """What follows from the actions with that ``digest``, as it was foreseen last; None where nobody has looked."""
    return _last(entries, digest, plant)


def beside(entries: Sequence[Entry], digest: str, plant: PlantDescription) -> Foresight | None:
    """What would have followed without the actions with that ``digest``, foreseen at the same time or before."""
    told = [n for n, e in enumerate(entries) if isinstance(e.event, Foreseen) and e.event.digest == digest]
    return _last(entries[: told[-1]] if told else entries, "", plant)


def _last(entries: Sequence[Entry], digest: str, plant: PlantDescription) -> Foresight | None:
    for entry in reversed(entries):
        event = entry.event
        if isinstance(event, Foreseen) and event.digest == digest:
            return Foresight(event, first_limit(event, plant))
    return None


def first_limit(told: Foreseen, plant: PlantDescription) -> str:
    """What the hard limit protects that is the first one to trip."""
    hard = {limit.name: limit.description for limit in plant.limits.hard}
    return next((hard[r.limit] or r.limit for r in told.reached if r.limit in hard), "") if told.first else ""
