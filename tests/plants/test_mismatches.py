"""The file of mismatches of a plant that somebody else made: what is wrong with it is said in one line."""

import importlib
import itertools
from pathlib import Path

import pytest

from homeostat.plants.error import PlantError
from homeostat.plants.truth import find_mismatch, mismatches, true_model
from homeostat.process.model import ProcessModel

GOOD = '[other]\ndescription = "Half as much again"\nspread = 1.5\n'
TRUE = "from homeostat.plants.cstr.true.plant import TRUE\n"
numbers = itertools.count()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package of its own with a model and a true plant; no file of mismatches yet."""
    package = tmp_path / f"own_plant_{next(numbers)}"
    (package / "true").mkdir(parents=True)
    own = (
        "from homeostat.plants.cstr.process import REACTOR\n"
        "from homeostat.process.blocks.composed import ComposedModel\n"
        "def Own(): return ComposedModel(REACTOR, {}, (), home=__name__)\n"
    )
    (package / "process.py").write_text(own, "utf-8")
    (package / "true" / "plant.py").write_text(TRUE, "utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    return package


def model(folder: Path) -> ProcessModel:
    importlib.invalidate_caches()
    found: ProcessModel = importlib.import_module(f"{folder.name}.process").Own()
    return found


def test_a_mismatch_is_read_from_beside_the_true_plant(folder: Path) -> None:
    (folder / "true" / "mismatches.toml").write_text(GOOD, "utf-8")
    found = find_mismatch(model(folder), "other")
    assert found is not None and found.spread == 1.5
    with pytest.raises(PlantError, match=r"no mismatch 'othr'; there are: 'none', 'other'"):
        find_mismatch(model(folder), "othr")


def test_a_flowsheet_needs_no_true_plant_of_its_own_to_be_disturbed(folder: Path) -> None:
    (folder / "true" / "plant.py").unlink()
    (folder / "true").rmdir()
    truth = true_model(own := model(folder))
    assert truth is not None
    assert {"V1 dead_s", "V2 lag_s", "P1 stiction", "T1 offset", "F3 noise"} <= set(truth.departures.parameters)
    twice = find_mismatch(own, "twice")
    assert twice is not None and twice.spread == 2.0 and list(mismatches(own)) == ["twice"]
    with pytest.raises(PlantError, match=r"no mismatch 'plant'; there are: 'none', 'twice'"):
        find_mismatch(own, "plant")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "cannot be read: No such file or directory; put it there"),
        (b"[other\n", "is no TOML file: "),
        (b"\xff\xfe", "is no TOML file: "),
        (b"other = 3\n", "mismatches.toml: other: Input should be a valid dictionary"),
        (b"[other]\n", "mismatches.toml: other.description: Field required"),
        (b'[other]\ndescription = ""\nspread = nan\n', "other.spread: Input should be"),
        (b'[other]\ndescription = ""\nspread = -1\n', "other.spread: Input should be greater than or equal to 0"),
        (b'[other]\ndescription = ""\nsprad = 2\n', "other.sprad: Extra inputs are not permitted"),
        (b'[other]\ndescription = ""\ndrifts = ["UA"]\n', "mismatches.toml: other.drifts: "),
        (b'[other]\ndescription = ""\n[other.values]\ncolored = 1\n', "has no 'colored'; did you mean 'coloured'"),
        (b'[other]\ndescription = ""\n[other.values]\ncoloured = inf\n', "other.values.coloured: Input should be"),
        (b'[none]\ndescription = ""\n', "'none' is the true plant that is its model"),
    ],
)
def test_a_file_that_states_no_mismatch_is_refused_in_one_line(folder: Path, content: bytes | None, words: str) -> None:
    if content is not None:
        (folder / "true" / "mismatches.toml").write_bytes(content)
    with pytest.raises(PlantError) as refused:
        mismatches(model(folder))
    assert words in str(refused.value) and "\n" not in str(refused.value)


def test_a_true_plant_that_lacks_a_module_is_no_plant_without_one(folder: Path) -> None:
    (folder / "true" / "plant.py").write_text(f"import {folder.name}.true.kernels\n", "utf-8")
    with pytest.raises(PlantError, match=r"cannot be run: No module named .*kernels"):
        true_model(model(folder))
