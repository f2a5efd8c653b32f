"""A plant's run and its history are tables for detectors, with the features beside the tags."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from homeostat.detectors.error import DetectionError
from homeostat.evaluate.recorded.signals import signals_of_history, signals_of_run
from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.plants.plant import Plant, load_plant
from tests.cli.command import homeostat

pytestmark = pytest.mark.slow

END_S, ONSET_S = 1200, 800


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a run whose coolant valve closes, and its history."""
    folder = tmp_path_factory.mktemp("recorded")
    options = ("--fault", "cool_stuck_closed", "--onset", str(ONSET_S), "--end", str(END_S), "--mode", "observe")
    homeostat("run", "cstr", *options, "--thinking-declared", "1", "--out", "run", "--history", "kept", cwd=folder)
    return folder


@pytest.fixture(scope="module")
def plant() -> Plant:
    return load_plant("cstr", learned=False)


def test_features_stand_beside_the_tags(recorded: Path, plant: Plant) -> None:
    table = signals_of_run(recorded / "run", plant.description)
    features = {feature.name for feature in plant.description.features}
    assert features <= set(table.signals) and {"T1", "L1"} <= set(table.signals)
    assert np.isfinite(table.of(sorted(features)).values).all()
    assert table.times[-1] == pytest.approx(END_S, abs=1.0) and table.step == plant.description.timing.tick_s


def test_history_and_run_say_the_same(recorded: Path, plant: Plant) -> None:
    history = EmbeddedHistory(recorded / "kept")
    extent = history.extent()
    assert extent is not None
    kept = signals_of_history(history, "kept", extent, plant.description)
    run = signals_of_run(recorded / "run", plant.description)
    rows = min(len(kept), len(run)) - 5
    assert set(run.signals) <= set(kept.signals)
    for name in ("T1", "L1", "F-V1-POS"):
        assert np.allclose(kept.of([name]).values[-rows:-5], run.of([name]).values[-rows:-5], atol=1e-6, equal_nan=True)


def test_a_history_without_a_plant_has_its_tags(recorded: Path, plant: Plant) -> None:
    history = EmbeddedHistory(recorded / "kept")
    extent = history.extent()
    assert extent is not None
    signals = set(signals_of_history(history, "kept", extent, None).signals)
    assert "T1" in signals and not signals & {feature.name for feature in plant.description.features}


def test_the_fault_of_a_run_is_found_beside_its_balances(recorded: Path) -> None:
    done = homeostat("monitor", "run", "--healthy", "400", "--json", cwd=recorded)
    (table,) = json.loads(done.out)["tables"]
    assert done.status == 1
    lasting = [alarm for alarm in table["alarms"] if alarm["last_row"] - alarm["first_row"] > 100]
    assert lasting and float(lasting[0]["from"].split()[0]) == pytest.approx(ONSET_S, abs=60.0)


def test_the_fault_of_a_history_is_found_with_and_without_its_plant(recorded: Path) -> None:
    for options in (("--case", "cstr"), ("--last", "14m")):  # features are known after six minutes
        done = homeostat("monitor", "kept", "--healthy", "400", *options, cwd=recorded)
        assert done.status == 1, done.err


def test_a_run_without_a_trajectory_is_refused(tmp_path: Path, plant: Plant) -> None:
    with pytest.raises(DetectionError, match=r"has no trajectory.parquet: the run goes on"):
        signals_of_run(tmp_path, plant.description)
    (tmp_path / "trajectory.parquet").write_bytes(b"torn")
    with pytest.raises(DetectionError, match="is no trajectory"):
        signals_of_run(tmp_path, plant.description)
