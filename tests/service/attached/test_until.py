"""Which moment of a history a process time is: it stands while the plant is not attached."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from homeostat.cli.commands.report import until_us
from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.samples import NO_TIME, Batch, Series, Span
from tests.equipment.kept_run import kept


def test_a_process_time_is_found_from_the_end_on_over_gaps(tmp_path: Path) -> None:
    length = 500
    history = kept(tmp_path / "h", {"T": np.arange(length, dtype=float)}, 1000.0, range(200, 300))
    extent = history.extent()
    assert extent is not None
    assert until_us(history, extent, float("inf")) == extent.to_us == until_us(history, extent, 1e9)
    for until_s in (1010.0, 1190.0, 1350.0):
        kept_us = until_us(history, extent, until_s)
        read = history.read(["process time"], Span(extent.from_us, kept_us))["process time"].value
        assert read.max() == pytest.approx(until_s, abs=1.0) and (read <= until_s).all()
    assert until_us(history, extent, 0.0) == extent.from_us


@pytest.mark.parametrize("years", [-400, 4000])
def test_a_source_of_another_century_neither_hides_the_end_nor_is_waited_for(tmp_path: Path, years: int) -> None:
    kept(tmp_path / "h", {"T": np.arange(500.0)}, 1000.0, range(0))
    end_us = EmbeddedHistory(tmp_path / "h").last(["process time"])["process time"].time_us[0] + 1
    none, good = np.full(1, NO_TIME, dtype=np.int64), np.zeros(1, dtype=np.uint32)
    with EmbeddedStore(tmp_path / "h") as store:
        at_us = np.array([end_us + years * 365 * 86_400_000_000], dtype=np.int64)
        store.append(Batch(("RTC",), at_us, np.zeros(1), good, none, int(end_us)))
    history, reads = EmbeddedHistory(tmp_path / "h"), list[Span]()
    extent = history.extent()
    assert extent is not None
    counting = Counting(history, reads)
    assert until_us(counting, extent, float("inf")) == until_us(counting, extent, 1e9) == end_us
    assert end_us - 500_000_000 <= until_us(counting, extent, 1200.0) < end_us
    assert until_us(counting, extent, 0.0) == extent.from_us
    assert len(reads) < 50


class Counting:
    """A reader that notes every span that is asked for."""

    def __init__(self, history: EmbeddedHistory, reads: list[Span]) -> None:
        self._history, self._reads = history, reads
        self.tags, self.extent, self.minutes = history.tags, history.extent, history.minutes
        self.last, self.occurrences = history.last, history.occurrences

    def read(self, tags: Sequence[str], span: Span) -> Mapping[str, Series]:
        assert len(self._reads) < 50, "it is looked for day by day in centuries"
        self._reads.append(span)
        return self._history.read(tags, span)
