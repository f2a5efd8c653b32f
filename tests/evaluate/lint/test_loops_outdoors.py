"""A loop that makes up for what varies outside is not unstable; one that only passes its instrument's noise on is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.loops import SHAKES, loops
from homeostat.plants.scaffold import make_plant

DEMAND = 'b1.draw(tank.disturbance("demand", sd="sd_demand", tau="tau_demand"))\n'
NUMBERS = """demand,0.05,L/s,0.1,relative,B1,What consumers draw
sd_demand,1.5,L/s,0,,B1,Noise of what they draw
tau_demand,200,s,0,,B1,How long it lasts
"""


def tapped(folder: Path, times: float) -> Bench:
    """A tank from which consumers draw now more and now less, with so many ``times`` the gains of its level."""
    make_plant(folder, "tanks")
    equations, numbers = folder / "process.py", folder / "engineering" / "parameters.csv"
    equations.write_text(equations.read_text("utf-8").replace("b1.draw(overflow", f"{DEMAND}b1.draw(overflow"), "utf-8")
    stated = numbers.read_text("utf-8") + NUMBERS
    for cell, value in (("Kp_LIC1,0.02,", 0.02), ("Ki_LIC1,0.0002,", 0.0002)):
        assert cell in stated
        stated = stated.replace(cell, f"{cell.partition(',')[0]},{times * value:g},")
    numbers.write_text(stated, "utf-8")
    return Bench(folder)


@pytest.mark.slow
def test_a_level_that_is_kept_against_its_consumers_is_stable(tmp_path: Path) -> None:
    bench = tapped(tmp_path / "tapped", 1.0)
    late = bench.noisy[0].after(0.8 * bench.plant.end_s)
    assert np.std(bench.noisy[0].true("P1.cmd")[late]) > SHAKES, "its pump has a lot to do"
    assert list(loops(bench)) == []


def test_one_that_follows_the_noise_of_its_instrument_is_not(tmp_path: Path) -> None:
    (found,) = loops(tapped(tmp_path / "tapped", 50.0))
    assert "'P1.cmd' swings" in found.what and "Kp_LIC1" in found.remedy


def test_an_actuator_at_its_end_is_told_to_be_there_and_its_gains_are_no_remedy(tmp_path: Path) -> None:
    make_plant(tmp_path / "cold", "tanks")
    engineering = tmp_path / "cold" / "engineering"
    for file, old, new in (
        ("parameters.csv", "power_H1,60,", "power_H1,20,"),
        ("guards.csv", "T1 >= 48 and T1 <= 52", "T1 >= 35"),
    ):
        text = (engineering / file).read_text("utf-8")
        assert old in text
        (engineering / file).write_text(text.replace(old, new), "utf-8")
    (found,) = loops(Bench(tmp_path / "cold"))
    assert "'T1' is still " in found.what and " degC off its setpoint" in found.what
    assert "'H1.cmd' stands at its upper end, 1" in found.what
    assert found.remedy.startswith("state a setpoint that can be reached (engineering/setpoints.csv row ")
