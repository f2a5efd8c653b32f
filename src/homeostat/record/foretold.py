"""What was foretold: when a hard limit would trip if nothing were done, as a result has it."""

from collections.abc import Iterable
from dataclasses import dataclass

from homeostat.domain.events.foresight import Foreseen
from homeostat.domain.plant.description import PlantDescription


@dataclass(frozen=True, slots=True)
class Foretold:
    """The hard limit that trips first if nothing is done; times in process time."""

    limit: str
    """Name of the limit."""
    said_s: float
    """When the twin looked ahead [s]."""
    earliest_s: float
    """When it trips in the first member [s]."""
    middle_s: float
    """Median over the members in which it trips, each weighted as it is likely [s]."""
    latest_s: float
    """When it trips in the last of them [s]."""
    probability: float
    """What these members are worth together [0, 1]."""


def first_hard(told: Foreseen, plant: PlantDescription) -> str:
    """Name of the hard limit that trips first; empty where none does."""
    hard = {limit.name for limit in plant.limits.hard}
    return next((reached.limit for reached in told.reached if reached.limit in hard), "")


def foretold(
    every: Iterable[tuple[float, Foreseen]], acted_s: float | None, plant: PlantDescription
) -> Foretold | None:
    """What was foreseen last before anything was done at ``acted_s`` [s]; None where no hard limit was to trip.

    ``every``: after its time [s], what the twin has said. Where nothing was done, what was foreseen last counts.
    """
    found = None
    for at_s, told in every:
        if told.digest or told.first is None or (acted_s is not None and at_s > acted_s):
            continue
        first, limit = told.first, first_hard(told, plant)
        times = (told.from_s + first.earliest_s, told.from_s + first.middle_s, told.from_s + first.latest_s)
        found = Foretold(limit, told.from_s, *times, first.probability)
    return found
