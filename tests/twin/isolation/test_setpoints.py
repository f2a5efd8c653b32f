"""The inner controller of a cascade answers for its own law, and not for the setpoint that it is sent."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import departing, scenario
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.twin.history import History, Window
from homeostat.twin.isolation.prechecks import broken_laws
from homeostat.twin.isolation.setpoints import followed

AIR = Path(__file__).parents[3] / "examples" / "instrument_air"
SATURATED = "A1 reads + 5 from 1500"
"""The analyser says that there is oxygen everywhere: its controller asks for all the nitrogen there is."""


@pytest.fixture(scope="module")
def air(tmp_path_factory: pytest.TempPathFactory) -> Plant:
    """Instrument air, in which the controller of an analyser sets the flow of nitrogen."""
    folder = tmp_path_factory.mktemp("plants") / "instrument_air"
    shutil.copytree(AIR, folder, ignore=shutil.ignore_patterns("plant.ttl", "baseline.csv"))
    return load_plant(str(folder), learned=False, kept=False)


def seen(plant: Plant, disturbance: str, end_s: int, seed: int = 1) -> Window:
    """The last readings at ``end_s`` of a plant that nobody touches."""
    happens = departing(plant, scenario(plant, "none", seed, end_s=end_s + 1.0), (disturbance,), "none")
    history = History(plant.description.variables, plant.model.inputs)

    def until(snapshot: Snapshot) -> bool:
        history.append(snapshot)
        return snapshot.at_s >= end_s

    watch(open_process(plant, happens), new_sequencer(plant).sample, until)
    return history.window(400)


@pytest.mark.slow
@pytest.mark.parametrize("end_s", [1560, 1650])
def test_an_outer_controller_at_its_limit_accuses_no_inner_one(air: Plant, end_s: int) -> None:
    assert broken_laws(seen(air, SATURATED, end_s), air.description, air.model) == ()


def test_an_inner_controller_with_another_gain_is_named(air: Plant) -> None:
    found = broken_laws(seen(air, "Kp_FIC5 * 3 from 1500", 1560), air.description, air.model)
    assert [finding.tag for finding in found] == ["V5.cmd"]


def test_where_nobody_knows_what_it_followed_it_is_not_judged(air: Plant) -> None:
    window = seen(air, "Kp_FIC5 * 3 from 1500", 1560)
    (loop,) = (each for each in air.description.loops if each.controller == "FIC5")
    assert np.isfinite(followed(window, air.description, loop)[-60:]).all()
    readings = {name: column for name, column in window.readings.items() if name != "F5_err"}
    untold = replace(window, readings=readings)
    assert np.isnan(followed(untold, air.description, loop)).all()
    assert broken_laws(untold, air.description, air.model) == ()
