"""Runs that begin elsewhere than by design: in another state of the machine, and with what an operator has set."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.unknown.recorder import monitoring_without_twin
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate import beginning as beginnings
from homeostat.evaluate.beginning import beginning, begun, watched
from homeostat.evaluate.reference.unsupervised import fault_free, open_process, unsupervised, watch
from homeostat.evaluate.scenario import Scenario, ScenarioError, scenario
from homeostat.evaluate.study.plan.expansion import jobs_of
from homeostat.evaluate.study.plan.plan import read_plan
from homeostat.plants.error import PlantError
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import new_sequencer

STUDY = """
title = "Beginnings"
[[scenarios]]
case = "tennessee_eastman"
name = "elsewhere"
begins_in = "regulatory"
setpoints = { "X11G.sp" = 60.0 }
"""


@pytest.fixture(scope="module")
def plant() -> Plant:
    return load_plant("tennessee_eastman", learned=False)


def test_a_run_stands_in_its_state_from_the_first_tick_and_nobody_leads_it_away(plant: Plant) -> None:
    case = beginning(plant, scenario(plant, "none", 1, end_s=7200.0), "regulatory", {"X11G.sp": 60.0})
    found = unsupervised(begun(plant, case), case)
    assert found.states == ()
    for tag, value in {"AC2.on": 0.0, "PY7.on": 0.0, "X11G.sp": 60.0, "Q11.sp": 22.949}.items():
        assert (found.truth.signals[tag] == value).all(), tag


def test_everybody_sees_that_state_as_the_ordinary_one_and_the_plant_itself_is_as_it_was(plant: Plant) -> None:
    case = beginning(plant, scenario(plant, "none", 1, end_s=7200.0), "regulatory")
    made = begun(plant, case)
    assert made.description.machine.initial.name == "regulatory" and "regulatory" in made.description.machine.ordinary
    assert plant.description.machine.initial.name == "starting"
    assert begun(plant, replace(case, seed=2)) is made, "fault-free runs are remembered by their plant"
    assert fault_free(made, case).truth.signals["AC1.on"].max() == 0.0
    assert begun(plant, scenario(plant, "none", 1)) is plant


def test_a_plant_that_begins_elsewhere_is_recovered_by_the_same_decisions(plant: Plant) -> None:
    """A start anew leads to its ordinary states by design, and is no recovery from where it begins now either."""
    case = beginning(plant, scenario(plant, "none", 1, end_s=7200.0), "regulatory")
    was, now = plant.description.machine, begun(plant, case).description.machine
    assert now.recovery_event == was.recovery_event == "fault_diagnosed"
    assert not now.is_end("regulatory", now.recovery_event)
    ways = now.paths("regulatory", {}, now.recovery_event, blocked=())
    assert {way[-1].target for way in ways} == {"normal", "adjusted", "trims_held", "by_separator", "by_stripper"}


def test_what_is_known_of_a_plant_is_forgotten_with_it_and_never_another_one_s(plant: Plant) -> None:
    case = beginning(plant, scenario(plant, "none", 1), "regulatory")
    another = replace(plant, name="another")
    made = begun(another, case)
    assert made.name == "another" and begun(another, case) is made and begun(plant, case) is not made
    gone = [weakref.ref(another), weakref.ref(made)]
    del another, made
    gc.collect()
    assert [ref() for ref in gone] == [None, None]


@pytest.mark.parametrize(
    ("state", "setpoints", "told"),
    [
        ("regulated", {}, "did you mean 'regulatory'"),
        ("", {"X11G.ps": 60.0}, "'X11G.ps' is none that can be commanded"),
        ("", {"X11G": 60.0}, "'X11G' is none that can be commanded"),
        ("", {"X11G.sp": 600.0}, "must lie in -5 to 105 %"),
    ],
)
def test_what_there_is_not_is_refused(plant: Plant, state: str, setpoints: dict[str, float], told: str) -> None:
    with pytest.raises(ScenarioError, match=told):
        beginning(plant, scenario(plant, "none", 1), state, setpoints)


def test_a_study_says_where_its_runs_begin(tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    file.write_text(STUDY)
    (job,) = jobs_of(read_plan(file), tmp_path)
    assert (job.scenario.begins_in, job.scenario.setpoints) == ("regulatory", (("X11G.sp", 60.0),))


def symptoms(plant: Plant, case: Scenario) -> list[tuple[float, str]]:
    """Every symptom that is raised where nobody acts, with its process time [s]."""
    monitoring, raised = monitoring_without_twin(plant), list[tuple[float, str]]()

    def look(snapshot: Snapshot) -> bool:
        before = {s.rule for s in monitoring.symptoms}
        monitoring.notices(snapshot)
        raised.extend((snapshot.at_s, s.rule) for s in monitoring.symptoms if s.rule not in before)
        return False

    watch(open_process(plant, case), new_sequencer(plant).sample, look)
    return raised


ELSEWHERE = [("regulatory", {"X11G.sp": 60.0}), ("regulatory", {"Q11.sp": 25.244})]


@pytest.mark.slow
@pytest.mark.parametrize(("state", "setpoints"), ELSEWHERE, ids=lambda each: str(each))
def test_what_is_ordered_elsewhere_is_no_symptom_and_a_fault_there_is_one(
    state: str, setpoints: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(beginnings, "RUNS", 10)
    whole = load_plant("tennessee_eastman")
    for seed in (1, 2):
        case = beginning(whole, scenario(whole, "none", seed, end_s=36000.0), state, setpoints)
        assert symptoms(begun(whole, case), case), "by the reference values of the plant as it stands by design"
        own = watched(whole, case)
        assert symptoms(own, case) == [], seed
        assert watched(whole, case) is own is begun(whole, case), "learned once"
        faulty = beginning(whole, scenario(whole, "A_poor", seed, onset_s=18000.0, end_s=32000.0), state, setpoints)
        (first_s, _), *_ = symptoms(own, faulty)
        assert 18000.0 < first_s < 18000.0 + 3.0 * 3600.0
        beginnings._beginnings(whole).clear()


def test_a_plant_as_it_stands_by_design_has_its_own_reference_values_and_one_that_is_not_well_those(
    plant: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = replace(plant, baselines=dict(load_plant("tennessee_eastman").baselines))
    asked = list[Plant]()

    def sick(made: Plant, runs: int) -> None:
        asked.append(made)
        raise PlantError("a fault-free run is not well")

    monkeypatch.setattr(beginnings, "learn", sick)
    assert watched(whole, scenario(whole, "none", 1)) is whole and asked == []
    case = beginning(whole, scenario(whole, "none", 1), "regulatory")
    first = watched(whole, case)
    assert first.baselines == whole.baselines and watched(whole, case) is first and len(asked) == 1
    assert first.description.machine.initial.name == "regulatory"
    assert watched(plant, case) is begun(plant, case) and len(asked) == 1, "nothing was learned of any"
