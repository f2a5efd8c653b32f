"""From a journal to entries of a playbook: what was released, and what came of it, as recovery and instruments know it.

The truth of a simulated run is not looked at: what a playbook holds is shown to proposers.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol, final

import numpy as np
from numpy.typing import NDArray

from homeostat import __version__
from homeostat.agents.hypotheses import plausible, plausible_faults
from homeostat.agents.playbook.distance import Measure
from homeostat.agents.search.planning import unreliable_tags
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.people import ModeEntered
from homeostat.domain.events.recovery import Attempted, Diagnosed, GaveUp, Noticed, Probed, ReleasedActions
from homeostat.domain.events.trips import FallbackActivated, Tripped
from homeostat.domain.mode import Mode
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.limits import Criterion, Limit, LimitKind
from homeostat.domain.playbook import Answer, Ending, Entry, Margin, Occasion
from homeostat.domain.snapshot import Snapshot
from homeostat.journal import Event

WATCHED_S: Final = 600.0
"""How long a release is watched: until recovery looks at it again [s]."""

MOST_APPROVED: Final = 1000
"""Approved proposals that are remembered, one of which a release is: a plant may be attached for months."""


class Told(Protocol):
    """An event, and when it happened."""

    @property
    def event(self) -> Event:
        """What happened."""
        ...

    @property
    def at_s(self) -> float:
        """Process time [s]."""
        ...


class Configured(Protocol):
    """A plant as far as an entry needs it."""

    @property
    def description(self) -> PlantDescription:
        """What the graph says."""
        ...

    @property
    def configuration(self) -> str:
        """Digest of everything that configures the plant."""
        ...


@dataclass(frozen=True, slots=True)
class Recovery:
    """One release that the guard confirmed, as the journal tells it."""

    at_s: float
    """When [s]."""
    noticed_s: float
    """When thinking about it began [s]."""
    mode: str
    """Mode of the guard."""
    diagnosis: Diagnosis
    """What was held to be wrong; no hypothesis where nothing was."""
    released: ReleasedActions
    """What was released."""
    approved: Attempted
    """The proposal as it was approved, with its cost."""


@final
class Recoveries:
    """Finds, event by event, every release that was to last: holds and test moves are none, whoever proposed them."""

    def __init__(self) -> None:
        self.mode = Mode.CLOSED_LOOP.value
        """Mode of the guard, for whoever hears of it in another way than by events."""
        self._noticed_s, self._diagnosis = 0.0, Diagnosis(0.0, (), ())
        self._approved: dict[str, Attempted] = {}
        self._tested = False

    def after(self, event: Event, at_s: float) -> Recovery | None:
        """The release that ``event`` is, at process time ``at_s`` [s]; None where it is none that was to last."""
        match event:
            case ModeEntered():
                self.mode = event.mode
            case Noticed():
                self._tested, self._noticed_s, self._diagnosis = False, at_s, Diagnosis(at_s, (), ())
            case Diagnosed():
                self._diagnosis = Diagnosis(at_s, event.symptoms, event.hypotheses)
            case Attempted(approved=True, what=AlternativeKind.RELEASE):
                self._approved.pop(event.digest, None)
                self._approved[event.digest] = event
                if len(self._approved) > MOST_APPROVED:
                    del self._approved[next(iter(self._approved))]
            case Probed():
                self._tested = bool(event.state)  # what is released next is the test, whatever else has its commands
            case GaveUp():
                self._tested = False
            case ReleasedActions() if self._tested or event.for_s:
                self._tested = False
            case ReleasedActions() if (one := self._approved.get(event.digest)) and one.cost and one.path:
                return Recovery(at_s, self._noticed_s, self.mode, self._diagnosis, event, one)
        return None


def recoveries(lines: Iterable[Told]) -> list[Recovery]:
    """Every release in ``lines``, in order, that was to last."""
    found = Recoveries()
    return [one for line in lines if (one := found.after(line.event, line.at_s)) is not None]


def entry_of(plant: Configured, one: Recovery, seen: Snapshot, source: str) -> Entry:
    """The entry of ``one`` release on ``plant``, whose readings were as ``seen`` when it was noticed."""
    attempt, released = one.approved, one.released
    assert attempt.cost is not None  # a recovery has one
    setpoints = Measure(plant.description).setpoints(seen)
    answer = Answer(
        attempt.path,
        released.commands,
        released.state,
        released.then,
        released.proposer,
        _worst(plant, attempt),
        attempt.cost.share,
        released.certificate,
    )
    occasion = Occasion(attempt.path[0], one.mode, plausible(one.diagnosis), setpoints)
    return Entry(plant.configuration, __version__, source, occasion, answer)


def _worst(plant: Configured, attempt: Attempted) -> Margin | None:
    """The margin of a limit or criterion that is nearest to its limit, in scales."""
    rules = _rules(plant.description)
    judged = [f for f in attempt.findings if f.criterion in rules and math.isfinite(f.margin)]
    if not judged:
        return None
    found = min(judged, key=lambda f: f.relative(plant.description.scales))
    return Margin(found.criterion, found.margin, found.unit)


def _rules(plant: PlantDescription) -> dict[str, Criterion | Limit]:
    """Name -> what forbids at every moment, and not at that of a release only."""
    criteria, limits = plant.limits.watched.forbidding
    lasting = (limit for limit in limits if limit.kind is not LimitKind.PERMISSIVE)
    rules: list[Criterion | Limit] = [*criteria, *lasting]
    return {rule.name: rule for rule in rules}


def ending_of(later: Sequence[Told], at_s: float, end_s: float, watched_s: float) -> tuple[float, Ending]:
    """When something ended the time for which a release is watched [s], and what it was."""
    for line in later:
        match line.event:
            case FallbackActivated() | Tripped():
                return line.at_s, Ending.FELL_BACK
            case ReleasedActions():
                return line.at_s, Ending.REPLACED
    if end_s < at_s + watched_s:
        return end_s, Ending.CUT_SHORT
    return at_s + watched_s, Ending.HELD


def kept_margin(
    plant: PlantDescription, entry: Entry, signals: Mapping[str, NDArray[np.float64]], dt_s: float
) -> float | None:
    """What the readings of the time of watching leave the worst criterion; None where they cannot tell.

    ``signals``: tag -> readings of shape (1, n), every ``dt_s`` [s]. They cannot tell where the criterion reads what
    the diagnosis does not trust, or one of them is missing or not finite.
    """
    worst = None if entry.answer is None else entry.answer.worst
    if worst is None:
        return None
    formula = _rules(plant)[worst.criterion].formula
    diagnosis = Diagnosis(0.0, (), entry.occasion.hypotheses)
    if formula.tags & unreliable_tags(plant, plausible_faults(diagnosis)) or not formula.tags <= signals.keys():
        return None
    if any(not values.size for values in signals.values()):
        return None
    given: dict[str, NDArray[Any]] = dict(signals)
    if formula.horizon_s > 0.0:
        margin = float(formula.evaluate(given, dt_s).value[0])
    else:
        margin = float(np.min(np.atleast_2d(formula.margins(given, dt_s))))
    return margin if math.isfinite(margin) else None


def formula_tags(plant: PlantDescription, entry: Entry) -> frozenset[str]:
    """Tags that the worst criterion of ``entry`` reads; none where it has none."""
    worst = None if entry.answer is None else entry.answer.worst
    return frozenset() if worst is None else frozenset(_rules(plant)[worst.criterion].formula.tags)
