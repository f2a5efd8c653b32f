"""A pH that runs away under what was dosed is followed with the plant's own controllers, and the check says so."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.explained import explained

PLANT = Path(__file__).parent / "neutralisation"
"""Acid water that is neutralised with caustic and acid, whose pH is very sensitive to both."""
pytestmark = pytest.mark.slow


def neutralisation(folder: Path, replayed: str) -> Bench:
    """The plant whose replays are given ``replayed``."""
    shutil.copytree(PLANT, folder)
    equations = folder / "process.py"
    text = equations.read_text("utf-8")
    assert "Flowsheet()" in text
    equations.write_text(text.replace("Flowsheet()", f"Flowsheet(replayed={replayed!r})"), "utf-8")
    return Bench(folder)


def test_what_was_commanded_explains_no_healthy_plant(tmp_path: Path) -> None:
    (found,) = explained(neutralisation(tmp_path / "plant", "commands"))
    assert "'PH1'" in found.what and 'Flowsheet(replayed="setpoints")' in found.remedy


def test_what_was_to_be_held_explains_it(tmp_path: Path) -> None:
    assert list(explained(neutralisation(tmp_path / "plant", "setpoints"))) == []
