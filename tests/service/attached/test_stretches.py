"""The stretches of a long history are read one at a time, and say what they said when all of it was read at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")

from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.samples import ALWAYS, NO_TIME, Batch, Series, Span
from homeostat.plants.plant import load_plant
from homeostat.service.historian.observed import PROCESS_TIME
from homeostat.service.report import residuals
from homeostat.service.report.residuals import BEFORE_TICKS, STRETCH_TICKS

T0, S = 1_764_000_000_000_000, 1_000_000
HOURS = 3
N = HOURS * 3600


class Watched:
    """A reader that notes how much of how many tags is read at once."""

    def __init__(self, history: EmbeddedHistory) -> None:
        self._history, self.samples = history, list[int]()
        self.tags, self.extent, self.minutes = history.tags, history.extent, history.minutes
        self.last, self.occurrences = history.last, history.occurrences

    def read(self, tags: Sequence[str], span: Span) -> Mapping[str, Series]:
        found = self._history.read(tags, span)
        self.samples.append(sum(series.length for series in found.values() if list(tags) != [PROCESS_TIME]))
        return found


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three hours in which each reading is its tag's number and the second."""
    tags = (*sorted(load_plant("cstr").description.variables), PROCESS_TIME)
    second = np.repeat(np.arange(N), len(tags))
    value = second + np.tile(np.arange(len(tags)) * 1e6, N)
    value[len(tags) - 1 :: len(tags)] = np.arange(N)
    none, good = np.full(len(value), NO_TIME, dtype=np.int64), np.zeros(len(value), dtype=np.uint32)
    times = T0 + second * S - np.tile([100_000] * (len(tags) - 1) + [0], N)  # each is a little older than its pulse
    with EmbeddedStore(tmp_path / "h") as store:
        store.append(Batch(tags * N, times, value.astype(float), good, none, T0 + N * S))
    return tmp_path / "h"


def test_no_more_than_a_stretch_is_in_memory_and_each_begins_with_what_was_there(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(residuals, "MOST", 5)
    plant, watched = load_plant("cstr"), Watched(EmbeddedHistory(folder))
    windows = list(residuals._windows(plant, watched, ALWAYS))
    assert len(windows) == 5
    assert [w.end_s for w in windows] == [STRETCH_TICKS * (k + 1) - 1.0 for k in (0, 4, 8, 12, 17)]
    tags = sorted(plant.description.variables)
    assert max(watched.samples) <= len(tags) * (STRETCH_TICKS + BEFORE_TICKS + 1)
    for window in windows:
        for number, tag in enumerate(tags):
            variable = plant.description.variables[tag]
            read = window.readings[variable]
            assert read[-1] == number * 1e6 + window.end_s
            assert not np.any(window.held.get(variable, False))
