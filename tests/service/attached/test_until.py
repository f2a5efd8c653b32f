"""Which moment of a history a process time is: it stands while the plant is not attached."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from homeostat.cli.commands.report import until_us
from homeostat.history.samples import Span
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
