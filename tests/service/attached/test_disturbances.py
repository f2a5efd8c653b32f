"""The link of an attached tank disturbed in every way of the study, once each, with the study's own bars."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")

from benchmarks.attached.disturbances import DISTURBANCES
from benchmarks.attached.disturbed import disturbed
from benchmarks.attached.rig import HEARTBEAT_S, Rig

pytestmark = [pytest.mark.wide, pytest.mark.timeout(600)]

BACK_S = 10.0
"""Data must be there again so soon after the plant's side is [s]."""


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    with Rig(tmp_path_factory.mktemp("rig")) as made:
        yield made


@pytest.mark.parametrize("kind", list(DISTURBANCES))
def test_data_are_back_nothing_is_written_twice_and_nobody_falls_back(rig: Rig, kind: str) -> None:
    row = disturbed(rig, kind, 1001)
    assert "never" not in row, row
    assert row["back_s"] < BACK_S, row
    assert row["repeated"] == row["late"] == row["early"] == row["fallbacks"] == 0, row
    assert row["mode"] == "observe", "a person raises it again"
    if row["dead_s"] >= HEARTBEAT_S + 2.0:
        assert row["shed_s"] is not None and row["shed_s"] <= HEARTBEAT_S + 2.0, row
