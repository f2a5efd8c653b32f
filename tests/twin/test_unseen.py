"""States that no instrument shows: they are followed from one replay to the next, as what is known moves them.

Hand check of the scale: s' = (severity - s) / 4,000 s; 2,000 s after the onset of 0.4 it is 0.4 (1 - e^-0.5) = 0.157.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import Fault, departing, scenario, scenario_of
from homeostat.links.simulated import SimulatedLink
from homeostat.plants.plant import Plant, load_plant
from homeostat.process.types import Table
from homeostat.twin.carried import Carried, Carrier
from homeostat.twin.history import Window
from homeostat.twin.replay import replay
from homeostat.twin.twin import Twin
from tests.evaluate.two_tanks import change, tanks

ONSET_S, SIZE = 1500.0, 0.4
SCALING = FaultState("scaling", SIZE, ONSET_S)
SCALED = """scale = tanks.state("scale", "1", 0.0, least=0.0)
tanks.rate(scale, (tanks.fault("scaling") - scale) / "tau_scale")
b2.heat(heater("power_H1", tanks.loop("TIC2", measured="T2", drives="H1", acts=-1).opening) * (1.0 - scale))
tanks.quantity("scaled", scale)
"""
FAULTS = """id,label,component,disables,severity_unit,low,nominal,high,prior,description
scaling,Scale on the heater,H1,,1,0.1,0.4,0.6,0.1,Scale grows to severity
"""


@pytest.fixture(scope="module")
def scaled(tmp_path_factory: pytest.TempPathFactory) -> Plant:
    """Two tanks whose heater gets scale that no instrument shows."""
    folder = tanks(tmp_path_factory.mktemp("plants"))
    heats = 'b2.heat(heater("power_H1", tanks.loop("TIC2", measured="T2", drives="H1", acts=-1).opening))\n'
    change(folder, "process.py", heats, SCALED)
    change(
        folder, "engineering/parameters.csv", "tau_H1,", "tau_scale,4000,s,0,,H1,Time constant of the scale\ntau_H1,"
    )
    (folder / "engineering" / "faults.csv").write_text(FAULTS, "utf-8")
    return load_plant(str(folder), learned=False)


def seen(plant: Plant, end_s: float, seed: int = 1, *faults: Fault) -> tuple[Snapshot, ...]:
    link = SimulatedLink(open_process(plant, scenario_of(plant, list(faults), seed, end_s)))
    return tuple(link.advance() for _ in range(int(end_s)))


def following(plant: Plant, snapshots: tuple[Snapshot, ...]) -> Twin:
    twin = Twin(plant.model, plant.description, plant.twin, 1)
    for snapshot in snapshots:
        twin.observe(snapshot)
        if snapshot.at_s == ONSET_S - 10.0:
            twin.calibrate(400.0)
    return twin


def misses(plant: Plant, twin: Twin, window: Window, variable: str, *faults: FaultState) -> Table:
    """What a replay of ``window`` with ``faults`` misses of ``variable``."""
    carried: Carried = Carrier(plant.model, plant.description).carry([faults], window)
    predicted = replay(plant.model, window, twin._posterior.mean[None], carried, (variable,)).predicted[0, :, 0]
    return np.asarray(np.abs(predicted - window.readings[variable][1:]))


@pytest.fixture(scope="module")
def scaling(scaled: Plant) -> tuple[Snapshot, ...]:
    return seen(scaled, 3500.0, 1, Fault("scaling", SIZE, ONSET_S))


def test_only_what_no_instrument_shows_and_others_depend_on_is_followed(scaled: Plant) -> None:
    assert scaled.model.unseen == ("scale",), "a total that nothing depends on is not among them"


@pytest.mark.slow
def test_it_is_where_what_is_known_has_moved_it(scaled: Plant, scaling: tuple[Snapshot, ...]) -> None:
    twin = following(scaled, scaling)
    assert twin._history.window(600).unseen["scale"] == 0.0, "nobody knew of anything"
    twin.believe((SCALING,))
    for back_s, began in ((600, 0.4 * (1 - np.exp(-1401 / 4000))), (1, 0.4 * (1 - np.exp(-2000 / 4000)))):
        assert twin._history.window(back_s).unseen["scale"] == pytest.approx(began, abs=0.004)


def test_a_replay_that_begins_after_the_onset_goes_on_with_it(scaled: Plant, scaling: tuple[Snapshot, ...]) -> None:
    twin = following(scaled, scaling)
    twin.believe((SCALING,))
    window = twin._history.window(600)
    anew = replace(window, unseen={})
    assert misses(scaled, twin, window, "T2", SCALING)[-60:].mean() < 0.5
    assert misses(scaled, twin, anew, "T2", SCALING)[-60:].mean() > 2.0, (
        "beginning anew, it would be called something else"
    )


def test_what_was_known_is_still_named_when_its_beginning_is_no_longer_replayed(
    scaled: Plant, scaling: tuple[Snapshot, ...]
) -> None:
    twin = following(scaled, scaling)
    twin.believe((SCALING,))
    said = twin.explain(["scaling"], (SCALING,), since_s=2000.0, news=True)
    assert {f.fault for h in said for f in h.faults} == {"scaling"}
    assert said[0].faults[0].severity == pytest.approx(SIZE, rel=0.3)


def test_what_is_over_has_moved_it_as_long_as_it_was_there(scaled: Plant, scaling: tuple[Snapshot, ...]) -> None:
    twin = following(scaled, scaling)
    twin.believe((SCALING,))
    stood = twin._history.window(1).unseen["scale"]
    twin.believe(())
    assert twin._history.window(1).unseen["scale"] == stood
    for later, snapshot in enumerate(scaling[-1000:]):
        twin.observe(replace(snapshot, at_s=3500.0 + later + 1))
    assert twin._history.window(1).unseen["scale"] == pytest.approx(stood * np.exp(-1000 / 4000), abs=0.004)


def test_another_size_moves_it_from_the_onset_on(scaled: Plant, scaling: tuple[Snapshot, ...]) -> None:
    twin = following(scaled, scaling)
    for size in (0.2, 0.6):
        twin.believe((replace(SCALING, severity=size),))
        expected = size * (1 - np.exp(-2000 / 4000))
        assert twin._history.window(1).unseen["scale"] == pytest.approx(expected, abs=0.006)


def test_what_a_frozen_twin_works_on_does_not_move(scaled: Plant, scaling: tuple[Snapshot, ...]) -> None:
    twin = following(scaled, scaling)
    still = twin.frozen()
    twin.believe((SCALING,))
    assert still._history.window(600).unseen["scale"] == 0.0


def test_readings_that_are_missing_for_minutes_move_it_on(scaled: Plant, scaling: tuple[Snapshot, ...]) -> None:
    twin = following(scaled, scaling[:3000])
    twin.believe((SCALING,))
    twin.observe(scaling[-1])
    assert twin._history.window(1).unseen["scale"] == pytest.approx(0.4 * (1 - np.exp(-2000 / 4000)), abs=0.006)


def test_a_fault_that_takes_the_model_out_of_the_physical_world_leaves_it_where_it_was(
    scaled: Plant, scaling: tuple[Snapshot, ...]
) -> None:
    twin = following(scaled, scaling)
    twin.believe((replace(SCALING, severity=float("inf")),))
    assert twin._history.window(1).unseen["scale"] == 0.0


@pytest.fixture(scope="module")
def at_its_end(tmp_path_factory: pytest.TempPathFactory) -> Plant:
    """Two tanks that are replayed by their setpoints; a level controller acts at once and resets in hours."""
    folder = tanks(tmp_path_factory.mktemp("plants"))
    change(folder, "process.py", "Flowsheet()", 'Flowsheet(replayed="setpoints")')
    change(folder, "engineering/parameters.csv", "Ki_LIC2,0.0002", "Ki_LIC2,0.00001")
    return load_plant(str(folder), learned=False)


@pytest.mark.slow
def test_an_integral_term_is_followed_while_its_output_is_at_its_end(at_its_end: Plant) -> None:
    """A command at its end says nothing of it, and the loop leaves that end sooner or later by it."""
    plant, command = at_its_end, at_its_end.description.variables["P2.cmd"]
    fuller = departing(plant, scenario(plant, "none", 1, end_s=3000.0), ["L2.sp + 60 from 2000"], "none")
    link = SimulatedLink(open_process(plant, fuller))
    twin = following(plant, tuple(link.advance() for _ in range(2500)))
    window = twin._history.window(450)
    output = window.readings[command]
    assert output[:100].max() == 0.0 < output[-1], "it leaves its end meanwhile"
    followed, anew = (misses(plant, twin, each, command) for each in (window, replace(window, unseen={})))
    assert followed.max() < 0.3 * anew.max()


def test_its_folder_is_of_no_matter(tmp_path: Path, scaled: Plant) -> None:
    assert load_plant("cstr").model.unseen == ("CA", "CD"), "what reacts, and not what comes of it"
    assert load_plant("mixing_module").model.unseen == ()
