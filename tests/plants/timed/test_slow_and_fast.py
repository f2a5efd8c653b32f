"""A plant of hours that is sampled once a minute, and one of seconds that is sampled ten times a second: from folder to
recovery, with nothing stated of time but the tick.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.writes import WriteIntended
from homeostat.domain.outcome import Outcome
from homeostat.evaluate.operation import declared
from homeostat.evaluate.simulation import run
from homeostat.plants.files.baselines import write_baselines
from homeostat.plants.files.folder import BASELINES
from homeostat.plants.files.generated import baseline_sources
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.teaching.learning import learn
from homeostat.record.figure.figure import compose
from tests.cli.command import homeostat
from tests.plants.timed.stretched import Stretched

TICKS_S = (60.0, 0.1)
RUNS = 6
"""Fault-free runs that are learned from here."""
ONSET, END = 2000, 5000
"""When a fault begins, and when the run ends, in ticks."""


@dataclass(frozen=True)
class Learned:
    """A plant with its reference values."""

    folder: Path
    plant: Plant


@pytest.fixture(scope="module", params=TICKS_S, ids=lambda tick_s: f"{tick_s:g}s")
def learned(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Learned:
    made = Stretched.of(request.param, tmp_path_factory.mktemp("plant"))
    plant = load_plant(str(made.folder), learned=False)
    values = write_baselines(learn(plant, RUNS), baseline_sources(plant))
    (made.folder / BASELINES).write_bytes(values)
    return Learned(made.folder, load_plant(str(made.folder)))


@pytest.mark.wide
def test_a_healthy_plant_is_left_alone(learned: Learned) -> None:
    done = run(learned.plant, seed=2, thinking=declared(1.0))
    tick_s = learned.plant.description.timing.tick_s
    assert done.truth.times_s[-1] == pytest.approx(END * tick_s)
    assert done.outcome is Outcome.NO_ACTION and not done.false_alarm
    assert not done.record.diagnosed and not done.record.released
    assert not done.record.of_kind(AlarmRaised), "not even a late heartbeat"
    assert {write.cause.value for write in done.record.of_kind(WriteIntended)} <= {"sequence"}


@pytest.mark.slow
def test_a_fault_is_found_by_name_and_recovered_from(learned: Learned, tmp_path: Path) -> None:
    tick_s, out = learned.plant.description.timing.tick_s, tmp_path / "run"
    given = ["run", str(learned.folder), "--fault", "H1_stuck_open", "--seed", "3", "--out", str(out)]
    given += ["--end", f"{(ONSET + 600) * tick_s:g}"]
    told = homeostat(*given, "--thinking-declared", "1", cwd=tmp_path)
    assert told.status == 0, told.err
    assert "Recovered: the plant produces inside its hard limits." in told.out
    result = json.loads((out / "result.json").read_text("utf-8"))
    assert result["onset_s"] == ONSET * tick_s
    assert 0.0 < (result["detected_s"] - result["onset_s"]) / tick_s < 100.0
    assert _likeliest(result) == "H1_stuck_open"
    checked = homeostat("trace", "verify", str(out), cwd=tmp_path)
    assert checked.status == 0, checked.out + checked.err


def _likeliest(result: Mapping[str, object]) -> str:
    hypotheses = result["hypotheses"]
    assert isinstance(hypotheses, list)
    best = max(hypotheses, key=lambda h: h["probability"])
    return str(best["fault"])


def test_a_picture_tells_hours_as_hours(learned: Learned) -> None:
    tick_s = learned.plant.description.timing.tick_s
    done = run(learned.plant, seed=2, end_s=1000 * tick_s, thinking=declared(1.0))
    axis = compose(done).axes[-1]
    labels = [float(label.get_text()) for label in axis.get_xticklabels()]
    places = [float(place) for place in axis.get_xticks()]
    if tick_s == 60.0:
        assert axis.get_xlabel() == "Process time [h]"
        assert np.allclose(places, [3600.0 * hours for hours in labels]) and max(labels) <= 1000 / 60
    else:
        assert axis.get_xlabel() == "Process time [s]"


@pytest.mark.wide
def test_a_deep_check_finds_nothing_that_is_due_to_time(learned: Learned, tmp_path: Path) -> None:
    told = homeostat("plant", "check", str(learned.folder), "--deep", cwd=tmp_path)
    assert told.status == 0 and ": clean" in told.out, told.out
