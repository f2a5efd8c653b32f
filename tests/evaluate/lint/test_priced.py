"""What is priced is noticed: by a symptom that reads what it is about, in time, or by the faults that miss it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.priced import unnoticed
from homeostat.evaluate.lint.deep.symptoms import Shown
from homeostat.evaluate.lint.finding import Finding, Severity
from homeostat.plants.files.folder import INSTALLED
from tests.evaluate.two_tanks import TANKS, change, tanks

SEEN = Shown(confirmed_s=2100.0, largest=3.0, opposite=0.0, threshold=1.0)


def priced(folder: Path, formula: str, shown: Mapping[str, Mapping[str, Shown]] | None = None) -> Iterator[Finding]:
    """What is said of the two tanks with this criterion in place of theirs."""
    made = tanks(folder)
    change(made, "engineering/criteria.csv", "abs(T2.err) <= 2", formula)
    return unnoticed(Bench(made), shown or {})


@pytest.mark.slow
def test_one_that_no_feature_reads_is_told(tmp_path: Path) -> None:
    (only,) = priced(tmp_path, "T1 >= 15")
    assert only.severity is Severity.WARNING and str(only.where) == "engineering/criteria.csv row 2 (ACC-T2)"
    assert "nothing notices that it is missed: no feature of a symptom reads what it is about" in only.what
    assert "no fault of the tables misses it" in only.what and "72 units an hour" in only.what
    assert "symptoms.csv" in only.remedy and "prices.csv" in only.remedy


@pytest.mark.slow
def test_one_that_is_missed_before_its_symptom_comes_is_told_with_the_value(tmp_path: Path) -> None:
    (only,) = priced(tmp_path, "abs(T2.err) <= 0.6")
    assert only.severity is Severity.WARNING
    assert "it is missed from 'T2' = " in only.what and "'S-TIC2-OFF', the nearest symptom" in only.what
    assert "lower the threshold of 'S-TIC2-OFF'" in only.remedy


@pytest.mark.slow
def test_one_that_a_fault_misses_and_shows_otherwise_is_a_note(tmp_path: Path) -> None:
    (only,) = priced(tmp_path, "abs(T2.err) <= 0.6", {"H1_stuck_open": {"S-H1-OFF": SEEN}})
    assert only.severity is Severity.NOTE and "other signs of 'H1_stuck_open'" in only.what


@pytest.mark.slow
def test_one_that_a_fault_misses_without_a_sign_is_told_with_the_fault(tmp_path: Path) -> None:
    (only,) = priced(tmp_path, "abs(T2.err) <= 0.6", {"H1_stuck_open": {}})
    assert only.severity is Severity.WARNING and "of 'H1_stuck_open', which misses it, there is no sign" in only.what


@pytest.mark.slow
def test_one_that_costs_nothing_is_not(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    change(folder, "engineering/criteria.csv", "abs(T2.err) <= 2", "T1 >= 15")
    (folder / "engineering" / "prices.csv").write_text(
        "kind,item,price,description\ncriterion,ACC-T2,0,Nobody minds\n", "utf-8"
    )
    assert list(unnoticed(Bench(folder), {})) == []


@pytest.mark.slow
def test_what_only_commands_cost_need_not_be_noticed(tmp_path: Path) -> None:
    assert list(priced(tmp_path, "H1.pos <= 0.9")) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "folder",
    [TANKS, INSTALLED / "cstr", pytest.param(INSTALLED / "tennessee_eastman", marks=pytest.mark.slow)],
    ids=lambda f: f.name,
)
def test_those_of_the_plants_that_ship_are_noticed(folder: Path) -> None:
    assert list(unnoticed(Bench(folder), {})) == []
