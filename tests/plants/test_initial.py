"""What smoothing may get wrong of a state is compared with instruments of its kind, in its unit, and with no others."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from homeostat.domain.plant.tag import Range
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import INSTALLED, read_files
from homeostat.plants.plant import load_plant
from homeostat.plants.settings.check import refuse_misfit
from homeostat.plants.settings.defaults import completed
from homeostat.plants.settings.file import read_settings

EXAMPLES = Path(__file__).parents[2] / "examples"
GENERATED = shutil.ignore_patterns("plant.ttl", "__pycache__")


def load(name: str, folder: Path, before: str, after: str) -> None:
    made = Path(shutil.copytree(EXAMPLES / name, folder / name, ignore=GENERATED))
    text = (made / "case.toml").read_text("utf-8")
    assert before in text
    (made / "case.toml").write_text(text.replace(before, after), "utf-8")
    load_plant(str(made), learned=False, kept=False)


def test_a_state_that_no_instrument_shows_the_unit_of_is_only_more_than_nothing(tmp_path: Path) -> None:
    load("instrument_air", tmp_path, "B1_V = 5.0", "B1_V = 50000.0")


def test_the_widest_range_is_that_of_the_same_unit(tmp_path: Path) -> None:
    with pytest.raises(
        PlantError, match=r"twin, initial, B1_T: 200 K must be at most 100 K, the widest range of a tag"
    ):
        load("two_tanks", tmp_path, "B1_T = 0.1", "B1_T = 200.0")


@pytest.mark.parametrize(("cubic_metres", "fits"), [(6.0, True), (0.004, False)])
def test_a_range_is_converted(cubic_metres: float, fits: bool) -> None:
    plant = load_plant("cstr")
    settings = completed("cstr", read_settings(read_files(INSTALLED / "cstr")), plant.description)
    initial = settings.twin.initial | {"V": 5.0}  # litres
    settings = settings.model_copy(update={"twin": settings.twin.model_copy(update={"initial": initial})})
    signals = tuple(
        replace(s, tag=replace(s.tag, unit="m3", range=Range(0.0, cubic_metres))) if s.tag.name == "L1" else s
        for s in plant.description.signals
    )
    changed = replace(plant.description, signals=signals)
    if fits:
        refuse_misfit("cstr", settings, changed, plant.model)
        return
    with pytest.raises(PlantError, match=r"twin, initial, V: 5 L must be at most 4 L"):
        refuse_misfit("cstr", settings, changed, plant.model)
