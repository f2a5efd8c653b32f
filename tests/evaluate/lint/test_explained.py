"""A healthy plant that runs away under what was commanded is followed with its own controllers only, and the check says so."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.explained import explained
from homeostat.plants.scaffold import make_plant

AWAY = 'b1.heat(limited(t1 - 50.0, -10.0, 10.0) * "away")\n'


def running_away(folder: Path, replayed: str) -> Bench:
    """A tank that heats itself the more the warmer it is, so that only its controller holds it."""
    make_plant(folder, "tanks")
    equations, numbers = folder / "process.py", folder / "engineering" / "parameters.csv"
    text = equations.read_text("utf-8").replace("heater, ", "heater, limited, ")
    text = text.replace("Flowsheet()", f"Flowsheet(replayed={replayed!r})").replace("b1.heat(power)\n", f"b1.heat(power)\n{AWAY}")
    equations.write_text(text, "utf-8")
    stated = numbers.read_text("utf-8").replace("Kp_TIC1,0.05", "Kp_TIC1,0.3").replace("Ki_TIC1,0.0002", "Ki_TIC1,0.0012")
    numbers.write_text(f"{stated}away,4,kW/K,0,,B1,Heat of what is in the tank\n", "utf-8")
    return Bench(folder)


def test_what_runs_away_is_not_explained_by_what_was_commanded(tmp_path: Path) -> None:
    (found,) = explained(running_away(tmp_path / "away", "commands"))
    assert "'T1'" in found.what and 'Flowsheet(replayed="setpoints")' in found.remedy


def test_what_was_to_be_held_explains_it(tmp_path: Path) -> None:
    assert list(explained(running_away(tmp_path / "away", "setpoints"))) == []


@pytest.mark.parametrize("kind", ["tanks", "reactor"])
def test_a_new_plant_is_explained(tmp_path: Path, kind: str) -> None:
    make_plant(tmp_path / "plant", kind)
    assert list(explained(Bench(tmp_path / "plant"))) == []
