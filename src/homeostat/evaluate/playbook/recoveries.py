"""From a run that is over to entries of a playbook: every release that was to last, with what came of it."""

from dataclasses import replace

import numpy as np

from homeostat.domain.playbook import Aftermath, Entry
from homeostat.domain.snapshot import Snapshot, Trajectory
from homeostat.evaluate.run import Run
from homeostat.plants.wired.recoveries import WATCHED_S, Recovery, ending_of, entry_of, kept_margin, recoveries


def entries_of(done: Run) -> tuple[Entry, ...]:
    """The entries of a run that is over, in the order in which they were released."""
    found = []
    for one in recoveries(done.record.entries):
        source = f"run of seed {done.scenario.seed}, {one.at_s:.0f} s"
        entry = entry_of(done.plant, one, _read(done.measured, one.noticed_s), source)
        found.append(replace(entry, aftermath=_aftermath(done, one, entry)))
    return tuple(found)


def _aftermath(done: Run, one: Recovery, entry: Entry) -> Aftermath:
    watched_s = done.plant.description.timing.time_s(WATCHED_S)
    later = [line for line in done.record.entries if one.at_s < line.at_s < one.at_s + watched_s]
    end_s, ending = ending_of(later, one.at_s, done.scenario.end_s, watched_s)
    times, measured = done.measured.times_s, done.measured
    watched = (times > one.at_s) & (times <= end_s)
    signals = {tag: values[:, watched] for tag, values in measured.signals.items()}
    return Aftermath(ending, end_s - one.at_s, kept_margin(done.plant.description, entry, signals, measured.dt_s))


def _read(measured: Trajectory, at_s: float) -> Snapshot:
    """What the instruments said at ``at_s`` [s], or at the first moment after it."""
    row = min(int(np.searchsorted(measured.times_s, at_s)), measured.length - 1)
    return Snapshot(at_s, {tag: float(values[0, row]) for tag, values in measured.signals.items()})
