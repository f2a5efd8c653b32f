"""What is very sensitive to what was commanded is followed with the plant's own controllers, and the check says so."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.explained import explained
from homeostat.plants.scaffold import make_plant

STEEP = """x = (t1 - 50.0) * 10.0
tank.sensor("T1", 50.0 + number(7.0, "K") * log(x / number(1.0, "K") + sqrt(x * x / number(1.0, "K2") + 1.0)))
"""
"""As the pH of what is neutralised: near 50 degC, a tenth of a kelvin is seven."""


def steep(folder: Path, replayed: str) -> Bench:
    """A tank whose temperature is shown by what is very sensitive to it where it is held."""
    make_plant(folder, "tanks")
    equations, numbers = folder / "process.py", folder / "engineering" / "parameters.csv"
    text = equations.read_text("utf-8").replace("linear_valve, ", "linear_valve, log, number, sqrt, ")
    text = text.replace("Flowsheet()", f"Flowsheet(replayed={replayed!r})").replace('tank.sensor("T1", t1)\n', STEEP)
    equations.write_text(text, "utf-8")
    stated = numbers.read_text("utf-8")
    for gain, other in (("Kp_TIC1,0.05,", "Kp_TIC1,0.003,"), ("Ki_TIC1,0.0002,", "Ki_TIC1,0.00003,")):
        assert gain in stated
        stated = stated.replace(gain, other)
    numbers.write_text(stated, "utf-8")
    return Bench(folder)


def test_what_is_very_sensitive_is_not_explained_by_what_was_commanded(tmp_path: Path) -> None:
    (found,) = explained(steep(tmp_path / "steep", "commands"))
    assert "'T1'" in found.what and 'Flowsheet(replayed="setpoints")' in found.remedy


def test_what_was_to_be_held_explains_it(tmp_path: Path) -> None:
    assert list(explained(steep(tmp_path / "steep", "setpoints"))) == []


@pytest.mark.parametrize("kind", ["tanks", "reactor"])
def test_a_new_plant_is_explained(tmp_path: Path, kind: str) -> None:
    make_plant(tmp_path / "plant", kind)
    assert list(explained(Bench(tmp_path / "plant"))) == []
