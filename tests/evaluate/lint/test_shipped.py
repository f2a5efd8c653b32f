"""The plants that ship are clean, whatever is simulated; a note is no finding."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from homeostat.plants.files.folder import INSTALLED
from tests.cli.command import homeostat


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cstr", pytest.param("mixing_module", marks=pytest.mark.wide)])
def test_a_plant_that_ships_is_clean_as_it_is_loaded(name: str, tmp_path: Path) -> None:
    done = homeostat("plant", "check", name, cwd=tmp_path)
    assert (done.status, done.out) == (0, f"{name}: clean\n")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cstr", pytest.param("mixing_module", marks=pytest.mark.wide)])
def test_a_plant_that_ships_is_clean_and_says_what_comes_of_every_fault(name: str, tmp_path: Path) -> None:
    before = {path: path.read_bytes() for path in (INSTALLED / name).rglob("*.csv")}
    done = homeostat("plant", "check", "--deep", "--json", name, cwd=tmp_path)
    said = json.loads(done.out)
    assert done.status == 0 and said["clean"] is True
    assert {finding["severity"] for finding in said["findings"]} <= {"note"}
    assert len(said["faults"]) > 8
    for each in said["faults"]:
        assert each["noticed_s"] > 0.0 and each["symptoms"], each
    assert before == {path: path.read_bytes() for path in before}


def test_a_folder_that_is_no_plant_is_one_line(tmp_path: Path) -> None:
    done = homeostat("plant", "check", "./nowhere", cwd=tmp_path)
    assert done.status == 2 and done.out == "" and "there is no folder" in done.err and done.err.count("\n") == 1
