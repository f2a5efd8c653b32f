"""An actuator that no loop drives though tables name its manual output: the row of the loops is blamed, not those."""

from pathlib import Path

import pytest

from tests.knowledge.shorts import Short


@pytest.fixture
def split(tmp_path: Path) -> Short:
    """Two tanks with a third pump beside the first one, commanded by the same loop, and named by hand."""
    short = Short.at(tmp_path / "plant")
    short.add("equipment", "P3,Actuator,,Second transfer pump")
    short.edit("loops", "LIC1,L1,P1.cmd", "LIC1,L1,P1.cmd|P3.cmd")
    short.add("setpoints", "holding,P3.man,0,1,")
    short.write("writables", "tag,fastest", "P3.man,0.5")
    assert short.mistakes() == []
    return short


def told(short: Short) -> list[str]:
    return [f"{error.thing}: {error.message}" for error in short.mistakes()]


def test_the_wrong_command_of_a_split_range_is_the_only_mistake(split: Short) -> None:
    split.edit("loops", "P1.cmd|P3.cmd", "P1.cmd|H1.cmd")
    (found,) = told(split)
    assert found.startswith(
        "loops.csv row 3 ('LIC1'): mv: H1.cmd is the manipulated value of LIC1 and TIC2, and P3.cmd"
    )
    assert "and P3.cmd of none" in found and "setpoints.csv row" in found and "writables.csv row 2" in found
    assert found.endswith("correct mv, or name P3.cmd there, which it has without a loop")


def test_a_forgotten_loop_is_told_at_the_actuator(split: Short) -> None:
    split.edit("loops", "P1.cmd|P3.cmd", "P1.cmd")
    (found,) = told(split)
    assert found.startswith("equipment.csv row") and "('P3')" in found
    assert "no row of loops.csv has P3.cmd as its mv" in found and "add its loop, or name P3.cmd there" in found


def test_two_that_override_each_other_are_not_blamed_for_it(split: Short) -> None:
    split.edit("loops", "P1.cmd|P3.cmd", "P1.cmd")
    split.add("loops", "LIC2,L2,P1.cmd")
    found = told(split)[0]
    assert found.startswith("equipment.csv row")


def test_a_misspelt_command_is_still_told_where_it_stands(split: Short) -> None:
    split.edit("loops", "P1.cmd|P3.cmd", "P1.cmd|P9.cmd")
    found = told(split)
    assert any("loops.csv row 3" in each and "there is no tag 'P9.cmd'" in each for each in found)
    assert not any("is the manipulated value of" in each or "no row of loops.csv" in each for each in found)


def test_empty_cells_of_a_row_that_names_nothing_are_not_told(split: Short) -> None:
    split.edit("writables", "P3.man", "P3.mann")
    (found,) = told(split)
    assert "there is no tag 'P3.mann'" in found and "P3.man" in found
