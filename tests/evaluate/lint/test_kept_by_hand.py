"""What one state commands by hand and the next one does not command stays where it is: a pump that never starts."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.evaluate.lint.finding import Finding, Severity
from homeostat.evaluate.lint.fits import fits
from homeostat.plants.scaffold import make_plant

RANGE = "\nholding,H1.man,0,1,\n"
START_BY_HAND = f"{RANGE}starting,H1.man,,,0.4\n"
"""Whether what follows on start-up by itself goes on by hand nobody can tell, so that no row follows."""


def found_in(folder: Path, rows: str, omitted: str = "") -> list[Finding]:
    """What is found of the states of a heated tank whose setpoints say ``rows`` of its heater while it is held."""
    make_plant(folder, "tanks")
    table = folder / "engineering" / "setpoints.csv"
    text = table.read_text("utf-8")
    assert RANGE in text
    table.write_text(text.replace(RANGE, rows), "utf-8")
    if omitted:
        (folder / "engineering" / "omitted.csv").write_text(f"table,row\nsetpoints,{omitted}\n", "utf-8")
    return [each for each in fits(folder) if each.check == "states"]


def test_a_manual_output_that_the_next_state_leaves_alone_is_warned_of(tmp_path: Path) -> None:
    (found,) = found_in(tmp_path / "held", START_BY_HAND)
    assert found.severity is Severity.WARNING
    assert str(found.where) == "engineering/setpoints.csv row 12 (starting H1.man)"
    assert "'H1.man' is commanded by hand, to 0.4 in 'starting', and 'normal', which follows, does not" in found.what
    assert "normal,H1.man,0,0," in found.remedy


def test_start_up_after_a_fallback_is_looked_at_as_well(tmp_path: Path) -> None:
    (found,) = found_in(tmp_path / "start", RANGE, omitted="starting H1.man")
    assert "to 0 in 'flushing' and 0 in 'shutdown', and 'starting', which follows, does not command it" in found.what


def test_what_a_fallback_commands_within_a_range_of_its_state_is_by_hand(tmp_path: Path) -> None:
    make_plant(tmp_path / "ranged", "tanks")
    table = tmp_path / "ranged" / "engineering" / "setpoints.csv"
    table.write_text(table.read_text("utf-8").replace("flushing,H1.man,0,0,0", "flushing,H1.man,0,1,"), "utf-8")
    (tmp_path / "ranged" / "engineering" / "omitted.csv").write_text("table,row\nsetpoints,starting *\n", "utf-8")
    (found,) = [each for each in fits(tmp_path / "ranged") if each.check == "states"]
    assert "to 0 in 'flushing' and 0 in 'shutdown'" in found.what


@pytest.mark.parametrize("row", ["normal,H1.man,0,0,", "normal,H1.man,0,1,", "normal,H1.man,0,0,0"])
def test_one_that_the_next_state_has_a_row_for_is_not(row: str, tmp_path: Path) -> None:
    assert found_in(tmp_path / "back", f"{START_BY_HAND}{row}\n") == []


def test_one_that_is_handed_back_by_a_row_that_follows_is_not(tmp_path: Path) -> None:
    assert found_in(tmp_path / "held", "\nholding,H1.man,0,1,0\n") == []


def test_a_range_without_a_design_holds_nothing_by_hand(tmp_path: Path) -> None:
    assert found_in(tmp_path / "range", RANGE) == []
