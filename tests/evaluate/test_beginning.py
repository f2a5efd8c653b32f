"""Runs that begin elsewhere than by design: in another state of the machine, and with what an operator has set."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace
from pathlib import Path

import pytest

from homeostat.evaluate.beginning import beginning, begun
from homeostat.evaluate.reference.unsupervised import fault_free, unsupervised
from homeostat.evaluate.scenario import ScenarioError, scenario
from homeostat.evaluate.study.plan.expansion import jobs_of
from homeostat.evaluate.study.plan.plan import read_plan
from homeostat.plants.plant import Plant, load_plant

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
