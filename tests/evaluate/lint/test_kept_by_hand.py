"""What one state commands by hand and the next one does not command stays where it is: a pump that never starts."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.evaluate.lint.finding import Finding, Severity
from homeostat.evaluate.lint.fits import fits
from homeostat.plants.scaffold import make_plant

RANGE = "\nholding,H1.man,0,1,\n"
HELD = "\nholding,H1.man,0,1,0\n"


def found_in(folder: Path, rows: str) -> list[Finding]:
    """What is found of the states of a heated tank whose setpoints say ``rows`` of its heater while it is held."""
    make_plant(folder, "tanks")
    table = folder / "engineering" / "setpoints.csv"
    text = table.read_text("utf-8")
    assert RANGE in text
    table.write_text(text.replace(RANGE, rows), "utf-8")
    return [each for each in fits(folder) if each.check == "states"]


def test_a_manual_output_that_the_next_state_leaves_alone_is_warned_of(tmp_path: Path) -> None:
    (found,) = found_in(tmp_path / "held", HELD)
    assert found.severity is Severity.WARNING
    assert str(found.where) == "engineering/setpoints.csv row 11 (holding H1.man)"
    assert "'H1.man' is commanded by hand, to 0 in 'holding', and 'normal', which follows, does not" in found.what
    assert "normal,H1.man,0,0," in found.remedy


@pytest.mark.parametrize("row", ["normal,H1.man,0,0,", "normal,H1.man,0,1,", "normal,H1.man,0,0,0"])
def test_one_that_the_next_state_has_a_row_for_is_not(row: str, tmp_path: Path) -> None:
    assert found_in(tmp_path / "back", f"{HELD}{row}\n") == []


def test_a_range_without_a_design_holds_nothing_by_hand(tmp_path: Path) -> None:
    assert found_in(tmp_path / "range", RANGE) == []
