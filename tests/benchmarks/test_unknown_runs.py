"""The study of unknown causes: runs are recorded once, looked at again and again, and told on a page."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.unknown import jobs as asked
from benchmarks.unknown import judging, store
from benchmarks.unknown.band import Band, Noticed
from benchmarks.unknown.bars import Study
from benchmarks.unknown.causes import Cause, harmless_causes, unknown_causes
from benchmarks.unknown.harmless import violated
from benchmarks.unknown.jobs import Job, jobs, scenario_of
from benchmarks.unknown.judge import Statement, Verdict
from benchmarks.unknown.judging import Judged, done, judge
from benchmarks.unknown.looks import at_looks, look
from benchmarks.unknown.operated import Operated
from benchmarks.unknown.page import page
from benchmarks.unknown.recorder import fault_free_band, load, path_of, record, recorded
from benchmarks.unknown.tally import Look
from homeostat.agents.monitoring.monitoring import TwinMonitoring
from homeostat.plants.plant import Plant, load_plant
from homeostat.twin.twin import Twin

MIXER = "mixing_module"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A place of one's own for recordings, and fewer runs for the band."""
    made = tmp_path_factory.mktemp("unknown")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(store, "FOLDER", made)
        patch.setitem(asked.BAND_SEEDS, MIXER, range(9_001, 9_007))
        yield made


def flat_level() -> Job:
    cause = next(c for c in unknown_causes(MIXER) if c.id == "LT201-flat")
    return Job(MIXER, "unknown", cause, 3, "plant")


@pytest.mark.wide
def test_a_recording_is_what_the_plant_showed_up_to_the_last_look(folder: Path) -> None:
    plant, job = load_plant(MIXER), flat_level()
    found = recorded(plant, job)
    assert path_of(job).is_relative_to(folder)
    assert 20.0 < found.first_s < 40.0 and found.rules == ("S-LT-B201",)
    assert found.looks_s == (found.first_s, found.first_s + 15.0, found.first_s + 60.0)
    assert found.readings.shape == (int(found.looks_s[-1]), len(found.tags))
    assert found.noticed == ("F-LT-B201",)
    again, kept = record(plant, job), load(path_of(job))
    assert np.array_equal(again.readings, kept.readings, equal_nan=True)
    assert replace(again, readings=kept.readings) == kept


def test_another_disturbance_under_the_same_name_is_another_recording(folder: Path) -> None:
    job = flat_level()
    other = replace(job, cause=replace(job.cause, spec="B201.level reads * 0.7 from 20"))
    assert path_of(job) != path_of(other)


@pytest.mark.slow
def test_monitoring_sees_at_a_look_what_it_saw_in_the_run(folder: Path) -> None:
    plant, recording = load_plant(MIXER), recorded(load_plant(MIXER), flat_level())
    seen = []

    def ask(plant: Plant, twin: Twin, monitoring: TwinMonitoring) -> list[Statement]:
        seen.append(tuple(s.rule for s in monitoring.symptoms))
        return [Statement("unknown LT201", "LT201", "", 0.95)]

    found = list(at_looks(plant, 3, recording, (0, 60), ask=ask))
    assert [(after, at_s) for after, at_s, _ in found] == [(0, recording.first_s), (60, recording.first_s + 60.0)]
    assert seen[0] == recording.rules
    said = next(iter(at_looks(plant, 3, recording, (0,), fresh=True, ask=look)))[2]
    assert said and math.isclose(sum(s.probability for s in said), 1.0, abs_tol=0.1)


def test_a_study_goes_on_where_it_stopped(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    job = flat_level()
    judge([job], (0,), fresh=True)
    assert set(done([job], fresh=True)) == {(job.name, 0)} and not done([job], fresh=False)
    told = capsys.readouterr().out
    assert told.startswith(f"{job.name} +0 s: ")
    monkeypatch.setattr(judging, "recorded", lambda plant, job: pytest.fail("it is judged already"))
    judge([job], (0,), fresh=True)
    with store.path_of(store.JUDGED).open("a", encoding="utf-8") as file:
        file.write('{"run": "torn')
    assert set(done([job], fresh=True)) == {(job.name, 0)}


def test_a_feature_is_noticed_where_it_stays_outside_for_long_enough() -> None:
    noticed = Noticed(Band(np.array([-1.0, -1.0]), np.array([1.0, 1.0]), np.array([3.0, 1.0])))
    for value in (2.0, 2.0, 0.0, 2.0, math.nan, 2.0):
        noticed.update(np.array([value, 0.0]))
        assert not noticed.found.any()
    noticed.update(np.array([-2.0, 0.0]))
    assert noticed.found.tolist() == [True, False]


def test_fault_free_features_stay_in_their_band(folder: Path) -> None:
    band = fault_free_band(load_plant(MIXER), "plant")
    assert (band.low <= band.high).all() and (band.outside_s >= 1.0).all()


def test_what_is_called_harmless_violates_nothing() -> None:
    plant = load_plant(MIXER)
    for cause in harmless_causes(MIXER):
        assert violated(plant, scenario_of(plant, Job(MIXER, "harmless", cause, 402, "plant"))) == (), cause.id
    harmful = Cause("harmful", "harmless", spec="VI204.cmd * 0 from 60")
    assert violated(plant, scenario_of(plant, Job(MIXER, "harmless", harmful, 402, "plant")))


@pytest.mark.slow
def test_what_is_called_harmless_of_the_reactor_violates_nothing() -> None:
    plant = load_plant("cstr")
    for cause in harmless_causes("cstr"):
        assert violated(plant, scenario_of(plant, Job("cstr", "harmless", cause, 402, "plant"))) == (), cause.id


@pytest.mark.slow
@pytest.mark.parametrize(("name", "missed"), [
    ("jacket-recovers", {"LIM-T-HIGH", "ACC-T-HIGH", "ACC-T"}),  # too hot: what is hard and what is soft
    ("jacket-swings", {"ACC-T"}),  # off its setpoint again and again, and never too hot
    ("jacket-weakens", {"ACC-DUTY-V2"}),  # no reserve for the next disturbance of the heat
])  # fmt: skip
def test_what_misses_something_of_the_reactor_is_not_called_harmless(name: str, missed: set[str]) -> None:
    """Of what is soft only that counts which the plant misses by more than it does without any cause."""
    plant = load_plant("cstr")
    cause = next(c for c in unknown_causes("cstr") if c.id == name)
    found = set(violated(plant, scenario_of(plant, Job("cstr", "unknown", cause, 402, "plant"))))
    assert missed <= found and not any(each.startswith("ACC-WEAR-") for each in found)


@pytest.mark.parametrize(("name", "count"), [("cstr", 1), (MIXER, 144)])
def test_a_day_without_a_fault_is_a_day(name: str, count: int) -> None:
    plant = load_plant(name)
    runs = [scenario_of(plant, job) for job in jobs(plant, ["day"], [], [], "plant")]
    assert len(runs) == count and sum(run.end_s for run in runs) == 86_400.0
    assert all(run.onset_s is None for run in runs)


def test_the_page_says_how_many_runs_are_in_and_what_is_missed() -> None:
    plant = load_plant("cstr")
    wanted = list(jobs(plant, ["unknown", "known", "harmless"], [], [401], "plant"))
    job = next(j for j in wanted if j.cause.id == "jacket-weaker")
    wrong = (Statement("temp_bias", "TT1", "", 0.99),)
    looks = [Look(job, Judged(job.name, after, 2000.0, wrong, 0.1, True)) for after in (0, 60)]
    assert looks[0].verdict is Verdict.WRONG
    harmed = Operated(job.name, 90.0, True, 0.3, 2, 0, 1, ("temp_bias",), "held", 1.0)
    text = page([Study(plant, wanted, looks, [harmed])], "plant")
    count = sum(j.part == "unknown" for j in wanted)
    assert f"wrong at 0.9 or more | Reactor | <= 5 % | 2 of 2 (100 %) | **no** | 1 of {count} |" in text
    assert "| longer outside a hard limit than left alone, by more than 10 s | Reactor | 0 | 1 | **no** | 1 of" in text
    assert (
        "| severity of known faults, median error | Reactor | <= 10 % of the range | none | not measured | 0 of" in text
    )
    assert f"- `{job.name}` +60 s: temp_bias 0.99" in text
