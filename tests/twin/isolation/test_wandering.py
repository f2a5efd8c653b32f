"""Wandering: what consumers draw and nobody measures moves a tank's level, and is neither a fault nor excuses one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import Fault, scenario_of
from homeostat.links.simulated import SimulatedLink
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.scaffold import make_plant
from homeostat.twin.carried import Carrier
from homeostat.twin.history import Window
from homeostat.twin.isolation.ended import fit_of_nothing
from homeostat.twin.isolation.evidence import Accuracy, Evidence, Fit
from homeostat.twin.isolation.wandering import PATHS, paths, wandering
from homeostat.twin.twin import Twin
from tests.twin.followed import disturbed, follow, reactor

ONSET_S, END_S = 1500.0, 1512
FAULT = "V1_stuck_closed"
DEMAND = 'b1.draw(tank.disturbance("demand", sd="sd_demand", tau="tau_demand"))\n'
NUMBERS = """demand,0.05,L/s,0.1,relative,B1,What consumers draw
sd_demand,0.6,L/s,0,,B1,Noise of what they draw
tau_demand,200,s,0,,B1,How long it lasts
"""


@pytest.fixture(scope="module")
def tapped(tmp_path_factory: pytest.TempPathFactory) -> Plant:
    """The tank of the scaffold, from which consumers draw besides what its pump does."""
    folder = tmp_path_factory.mktemp("plants") / "tapped"
    make_plant(folder, "tanks")
    equations, numbers = folder / "process.py", folder / "engineering" / "parameters.csv"
    equations.write_text(equations.read_text("utf-8").replace("b1.draw(overflow", f"{DEMAND}b1.draw(overflow"), "utf-8")
    numbers.write_text(numbers.read_text("utf-8") + NUMBERS, "utf-8")
    return load_plant(str(folder), learned=False)


def watched(plant: Plant, seed: int, *faults: str) -> Twin:
    """A twin that has followed the tank until a dozen seconds after ``faults`` began."""
    chosen = scenario_of(plant, [Fault(name, onset_s=ONSET_S) for name in faults], seed, float(END_S))
    link, twin = SimulatedLink(open_process(plant, chosen)), Twin(plant.model, plant.description, plant.twin, seed)
    for _ in range(END_S):
        snapshot = link.advance()
        twin.observe(snapshot)
        if snapshot.at_s == ONSET_S - 100.0:
            twin.calibrate(400.0)
    return twin


def seen(twin: Twin) -> Window:
    return twin._history.window(400)


def fit(plant: Plant, twin: Twin, seeds: tuple[int, ...]) -> Fit:
    """How well it fits that nothing is wrong."""
    carrier, accuracy = Carrier(plant.model, plant.description), Accuracy(plant.twin.errors, plant.twin.gain_error)
    window = seen(twin)
    evidence = Evidence(plant.model, carrier, window, twin._posterior, replace(accuracy, paths=seeds))
    return fit_of_nothing(evidence)[0]


@pytest.mark.parametrize("seed", [1, 2])
def test_what_wanders_is_no_sign_of_a_fault(tapped: Plant, seed: int) -> None:
    twin = watched(tapped, seed)
    assert not fit(tapped, twin, ()).good
    known = fit(tapped, twin, paths(seed))
    assert known.good and not known.strained


@pytest.mark.parametrize("seed", [1, 2])
def test_a_fault_is_named_although_something_wanders(tapped: Plant, seed: int) -> None:
    twin = watched(tapped, seed, FAULT)
    assert not fit(tapped, twin, paths(seed)).good, "what a fault does is not excused"
    said = twin.explain([FAULT], (), since_s=ONSET_S + 6.0, news=True)
    assert {f.fault for h in said if h.probability >= 0.02 for f in h.faults} == {FAULT}
    assert sum(h.probability for h in said if any(f.fault == FAULT for f in h.faults)) > 0.95


def test_as_far_as_the_paths_go_so_far_the_readings_may(tapped: Plant) -> None:
    """Of n paths, each by 1/sqrt(n), the squares add up to the variance of a path."""
    twin = watched(tapped, 3)
    carried = Carrier(tapped.model, tapped.description).carry([()], seen(twin))
    what = tapped.model, seen(twin), twin._posterior.mean[None], carried, ("L1", "V1_pos")
    few, other = wandering(*what, paths(1)), wandering(*what, paths(2))
    assert few.shape == (PATHS, seen(twin).length - 1, 2)
    spread, again = (np.sqrt(np.square(each[:, -1, 0]).sum()) for each in (few, other))
    assert 3.0 < spread < 60.0 and spread == pytest.approx(again, rel=0.6)
    assert np.abs(few[:, :, 1]).max() == 0.0, "no consumer moves a valve"


def test_where_nothing_wanders_nothing_is_allowed_for() -> None:
    plant, twin = reactor(), follow(disturbed(4, 1700), 4)
    still = (
        plant.model,
        seen(twin),
        twin._posterior.mean[None],
        Carrier(plant.model, plant.description).carry([()], seen(twin)),
    )
    assert len(wandering(*still, ("T1", "L1"), ())) == 0
    assert len(wandering(*still, ("V1_zt", "V2_zt"), paths(4))) == 0
