"""A fault that begins before monitoring knows the plant is told with the number that would do."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from homeostat.evaluate.lint.check import check
from homeostat.evaluate.lint.finding import Finding, Severity
from tests.evaluate.lint.copied import copied

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parents[3] / "examples"
GENERATED = shutil.ignore_patterns("plant.ttl", "__pycache__")
ONSET = "onset_s = 2000.0"


def found(made: Path, before: str, after: str) -> list[Finding]:
    text = (made / "case.toml").read_text("utf-8")
    assert before in text
    (made / "case.toml").write_text(text.replace(before, after), "utf-8")
    return [each for each in check(str(made)).findings if each.where.key == "run, onset_s"]


def tanks(folder: Path, after: str) -> list[Finding]:
    return found(Path(shutil.copytree(EXAMPLES / "two_tanks", folder / "two_tanks", ignore=GENERATED)), ONSET, after)


def test_an_onset_before_the_means_are_known_is_told(tmp_path: Path) -> None:
    (told,) = tanks(tmp_path, "onset_s = 900.0")
    assert told.severity is Severity.WARNING and told.where.file == "case.toml" and told.where.row == 7
    assert "begins at 900 s" in told.what and "after 1100 s at the earliest" in told.what
    assert "(settle_s = 500, centre_s = 600)" in told.what and "let it begin after 1100 s" in told.remedy


@pytest.mark.parametrize(
    "after",
    [
        ONSET,
        "onset_s = 1100.0",
        "onset_s = 900.0\n[monitoring]\nsettle_s = 200.0",
        "onset_s = 900.0\n[monitoring]\ncentre_s = 100000.0",
    ],
)
def test_a_later_one_or_a_shorter_or_endless_stretch_is_not(after: str, tmp_path: Path) -> None:
    assert tanks(tmp_path, after) == []


def test_a_run_that_is_too_short_for_a_later_one_is_told_so(tmp_path: Path) -> None:
    end = "end_s = 5000.0\nonset_s = 900.0\n[monitoring]\nsettle_s = 4000.0\ncentre_s = 3000.0"
    made = Path(shutil.copytree(EXAMPLES / "two_tanks", tmp_path / "two_tanks", ignore=GENERATED))
    (told,) = found(made, f"end_s = 5000.0\n{ONSET}", end)
    assert "or let a run last longer (end_s)" in told.remedy and "begin after" not in told.remedy


@pytest.mark.parametrize("name", ["mixing_module", "tennessee_eastman"])
def test_batches_and_plants_that_ship_are_not_told(name: str, tmp_path: Path) -> None:
    assert found(copied(name, tmp_path), "end_s = ", "end_s = ") == []
