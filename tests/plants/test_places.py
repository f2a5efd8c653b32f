"""Where plants are found: shipped, in folders that the user names, and in installed packages."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import pytest

from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import INSTALLED
from homeostat.plants.files.places import VARIABLE, plant_folder, plant_names, troubles
from homeostat.plants.plant import load_plant
from tests.plants.copies import Copy


def named(where: Path, name: str) -> Path:
    """A plant called ``name`` in ``where``: the reactor's tables and the reactor's model."""
    return Copy.of("cstr", where).folder.rename(where / name)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of plants that the user's variable names."""
    folder = tmp_path / "plants"
    named(folder, "boiler")
    monkeypatch.setenv(VARIABLE, str(folder))
    return folder


def test_a_plant_of_a_folder_that_is_named_once_has_a_name(here: Path) -> None:
    assert plant_names() == ("boiler", "cstr", "mixing_module", "tennessee_eastman")
    assert plant_folder("boiler") == here / "boiler"
    assert load_plant("boiler").name == "boiler"


def test_the_folder_may_be_that_of_one_plant(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, os.pathsep.join([str(here / "boiler"), "", str(here)]))
    assert plant_folder("boiler") == here / "boiler"


def test_which_of_two_is_meant_is_asked(here: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other = named(tmp_path / "more", "boiler")
    monkeypatch.setenv(VARIABLE, os.pathsep.join([str(here), str(other.parent)]))
    with pytest.raises(PlantError, match=r"several plants are called 'boiler': .* and .*; name one by its path"):
        plant_folder("boiler")
    assert "boiler" in plant_names()
    assert plant_folder(f"{other}") == other and plant_folder("cstr") == INSTALLED / "cstr"


def test_no_name_hides_a_shipped_plant(here: Path) -> None:
    named(here, "cstr")
    with pytest.raises(PlantError, match="several plants are called 'cstr'"):
        plant_folder("cstr")


def test_a_folder_that_is_none_is_said_where_a_plant_is_missed(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, str(here / "nowhere"))
    words = f"{VARIABLE} names '.*nowhere', which is no folder to read: No such file or directory; correct it"
    with pytest.raises(PlantError, match=words):
        plant_folder("boiler")
    (line,) = troubles()
    assert re.fullmatch(words, line) and plant_folder("cstr") == INSTALLED / "cstr"


def test_a_name_that_is_nearly_right(here: Path) -> None:
    with pytest.raises(PlantError, match="did you mean 'boiler'"):
        plant_folder("boilr")


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An installed package that offers a plant, and breaks if any of it is imported."""
    site = tmp_path / "site"
    named(site / "packing" / "lines", "line_3")
    for folder in (site / "packing", site / "packing" / "lines"):
        (folder / "__init__.py").write_text("raise SystemExit('imported')\n", "utf-8")
    about = site / "packing-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: packing\nVersion: 1.0\n", "utf-8")
    (about / "entry_points.txt").write_text("[homeostat.plants]\nline_3 = packing.lines.line_3\n", "utf-8")
    monkeypatch.setattr(sys, "path", [*sys.path, str(site)])
    return site


def test_a_plant_of_an_installed_package_has_a_name(package: Path) -> None:
    assert plant_folder("line_3") == package / "packing" / "lines" / "line_3"
    assert load_plant("line_3").name == "line_3" and "packing" not in sys.modules


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("line_4 = packing.lines.line_3", "packing offers the plant 'line_4' in 'packing.lines.line_3', a folder of"),
        ("line_3 = packing.line_3", "no such folder has a case.toml; install it again, or remove it"),
    ],
)
def test_a_package_that_offers_what_it_has_not(package: Path, line: str, words: str) -> None:
    (package / "packing-1.0.dist-info" / "entry_points.txt").write_text(f"[homeostat.plants]\n{line}\n", "utf-8")
    with pytest.raises(PlantError, match=words):
        plant_folder("line_3")
    assert len(troubles()) == 1 and plant_folder("cstr") == INSTALLED / "cstr"
