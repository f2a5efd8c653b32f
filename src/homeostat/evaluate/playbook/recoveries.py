"""From a run that is over to entries: what was released, and what came of it, as recovery and instruments know it.

The truth of a simulated run is not looked at: what a playbook holds is shown to proposers.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

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
from homeostat.domain.plant.limits import Criterion, Limit, LimitKind
from homeostat.domain.playbook import Aftermath, Answer, Ending, Entry, Margin, Occasion
from homeostat.domain.snapshot import Snapshot, Trajectory
from homeostat.evaluate.run import Run
from homeostat.journal.memory import Entry as Line
from homeostat.plants.plant import Plant
from homeostat.record.run_record import RunRecord

WATCHED_S: Final = 600.0
"""How long a release is watched: until recovery looks at it again [s]."""


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


def recoveries(record: RunRecord) -> list[Recovery]:
    """Every release of ``record`` that was to last: holds and test moves are none, whoever proposed them."""
    found: list[Recovery] = []
    mode, noticed_s, diagnosis = Mode.CLOSED_LOOP.value, 0.0, Diagnosis(0.0, (), ())
    approved: dict[str, Attempted] = {}
    tested = False
    for line in record.entries:
        match line.event:
            case ModeEntered() as entered:
                mode = entered.mode
            case Noticed():
                tested = False
                noticed_s, diagnosis = line.at_s, Diagnosis(line.at_s, (), ())
            case Diagnosed() as told:
                diagnosis = Diagnosis(line.at_s, told.symptoms, told.hypotheses)
            case Attempted(approved=True, what=AlternativeKind.RELEASE) as attempt:
                approved[attempt.digest] = attempt
            case Probed() as probed:
                tested = bool(probed.state)  # what is released next is the test, whatever else has its commands
            case GaveUp():
                tested = False
            case ReleasedActions() as released if tested or released.for_s:
                tested = False
            case ReleasedActions() as released if (one := approved.get(released.digest)) and one.cost and one.path:
                found.append(Recovery(line.at_s, noticed_s, mode, diagnosis, released, one))
    return found


def entries_of(done: Run) -> tuple[Entry, ...]:
    """The entries of a run that is over, in the order in which they were released."""
    found = []
    for one in recoveries(done.record):
        source = f"run of seed {done.scenario.seed}, {one.at_s:.0f} s"
        entry = entry_of(done.plant, one, _read(done.measured, one.noticed_s), source)
        found.append(replace(entry, aftermath=_aftermath(done, one, entry)))
    return tuple(found)


def entry_of(plant: Plant, one: Recovery, seen: Snapshot, source: str) -> Entry:
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


def _worst(plant: Plant, attempt: Attempted) -> Margin | None:
    """The margin of a limit or criterion that is nearest to its limit, in scales."""
    rules = _rules(plant)
    judged = [f for f in attempt.findings if f.criterion in rules and math.isfinite(f.margin)]
    if not judged:
        return None
    found = min(judged, key=lambda f: f.relative(plant.description.scales))
    return Margin(found.criterion, found.margin, found.unit)


def _rules(plant: Plant) -> dict[str, Criterion | Limit]:
    """Name -> what forbids at every moment, and not at that of a release only."""
    criteria, limits = plant.description.limits.watched.forbidding
    lasting = (limit for limit in limits if limit.kind is not LimitKind.PERMISSIVE)
    rules: list[Criterion | Limit] = [*criteria, *lasting]
    return {rule.name: rule for rule in rules}


def _aftermath(done: Run, one: Recovery, entry: Entry) -> Aftermath:
    watched_s = done.plant.description.timing.time_s(WATCHED_S)
    later = [line for line in done.record.entries if one.at_s < line.at_s < one.at_s + watched_s]
    end_s, ending = _ending(later, one.at_s, done.scenario.end_s, watched_s)
    return Aftermath(ending, end_s - one.at_s, _kept(done, one, entry, end_s))


def _ending(later: Sequence[Line], at_s: float, end_s: float, watched_s: float) -> tuple[float, Ending]:
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


def _kept(done: Run, one: Recovery, entry: Entry, end_s: float) -> float | None:
    """What the readings leave the worst criterion; None where it reads what the diagnosis does not trust."""
    worst = None if entry.answer is None else entry.answer.worst
    if worst is None:
        return None
    plant, formula = done.plant.description, _rules(done.plant)[worst.criterion].formula
    if formula.tags & unreliable_tags(plant, plausible_faults(one.diagnosis)):
        return None
    times = done.measured.times_s
    watched = (times > one.at_s) & (times <= end_s)
    if not watched.any():
        return None
    signals = {tag: values[:, watched] for tag, values in done.measured.signals.items()}
    if formula.horizon_s > 0.0:
        margin = float(formula.evaluate(signals, done.measured.dt_s).value[0])
    else:
        margin = float(np.min(np.atleast_2d(formula.margins(signals, done.measured.dt_s))))
    return margin if math.isfinite(margin) else None


def _read(measured: Trajectory, at_s: float) -> Snapshot:
    """What the instruments said at ``at_s`` [s], or at the first moment after it."""
    row = min(int(np.searchsorted(measured.times_s, at_s)), measured.length - 1)
    return Snapshot(at_s, {tag: float(values[0, row]) for tag, values in measured.signals.items()})
