"""A simulated run as a plant's history: its samples, and its events, from a moment of the calendar on."""

from typing import final

import numpy as np

from homeostat.domain.observation import Observation
from homeostat.domain.snapshot import Quality, Snapshot
from homeostat.history.occurrences import occurrence
from homeostat.history.quality import CODES
from homeostat.history.samples import Batch
from homeostat.history.store import HistoryStore
from homeostat.journal import Event


@final
class RunHistory:
    """Appends what a run's instruments say, as it comes, with the quality that the guard sees in it."""

    def __init__(self, store: HistoryStore, plant: str, start_us: int) -> None:
        """``start_us``: the time for which process time 0 stands [us]; ``plant``: its name."""
        self._store, self._plant, self._start_us = store, plant, start_us

    def see(self, seen: Observation) -> None:
        """Append one tick; nothing where no sample came. OSError where there is no room."""
        sample = seen.sample or seen.snapshot
        if sample is not None:
            self._store.append(self._batch(sample, seen.snapshot or sample, seen.now_s))

    def hear(self, event: Event, at_s: float, text: str) -> None:
        """Record one event of the run, which ``text`` tells; OSError where there is no room."""
        at_us = self._at_us(at_s)
        self._store.record(occurrence(event, self._plant, at_us, at_us, text))

    def _batch(self, sample: Snapshot, judged: Snapshot, now_s: float) -> Batch:
        tags = tuple(sample.values)
        taken = [self._at_us(sample.taken_s.get(tag, sample.at_s)) for tag in tags]
        server = np.full(len(tags), self._at_us(sample.at_s), dtype=np.int64)
        codes = [CODES[_quality(tag, judged)] for tag in tags]
        return Batch(
            tags,
            np.array(taken, dtype=np.int64),
            np.array([sample.values[tag] for tag in tags], dtype=np.float64),
            np.array(codes, dtype=np.uint32),
            server,
            self._at_us(now_s),
        )

    def _at_us(self, at_s: float) -> int:
        return self._start_us + round(at_s * 1e6)


def _quality(tag: str, judged: Snapshot) -> Quality:
    if tag in judged.bad:
        return Quality.BAD
    return Quality.UNCERTAIN if tag in judged.uncertain else Quality.GOOD
