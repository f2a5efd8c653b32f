"""Rows that hand a manual output back to automatic: where they follow, and where silence may mean something else."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.knowledge.build.derived.tables import idle_omissions, stated_tables, tables
from homeostat.knowledge.build.timing import timing_of
from tests.knowledge.shorts import Short

CHOICE = "reduced holding,H1.man,0,1,\n"
"""What the plant leaves open of its heater, which a fallback switches off in shutdown."""


@pytest.fixture
def short(tmp_path: Path) -> Short:
    return Short.at(tmp_path / "two_tanks")


def of_the_heater(short: Short) -> dict[str, tuple[str, str, str]]:
    """State -> what it is commanded of the heater's manual output: low, high, design."""
    rows = tables(short.folder)["setpoints"].rows
    return {r["state"]: (r["low"], r["high"], r["design"]) for r in rows if r["tag"] == "H1.man"}


AUTOMATIC = ("0", "0", "")


def test_states_on_the_way_back_hand_over_to_the_loop(short: Short) -> None:
    found = of_the_heater(short)
    assert found["starting"] == found["normal"] == AUTOMATIC
    assert found["shutdown"] == ("0", "0", "0") and found["holding"] == ("0", "1", "")
    plant = short.plant()
    row = plant.machine.state("starting").setpoint("H1.man")
    assert row is not None and row.design is None
    assert plant.writables["H1.man"].automatic


def test_they_say_what_they_follow_from(short: Short) -> None:
    table = tables(short.folder)["setpoints"]
    told = {r["state"]: o for r, o in zip(table.rows, table.origins, strict=True) if r["tag"] == "H1.man"}
    assert told["starting"].generated and told["normal"].generated and not told["holding"].generated
    assert told["starting"].table == "setpoints"


def test_where_no_state_but_the_fallbacks_commands_it_only_the_start_hands_it_back(short: Short) -> None:
    short.edit("setpoints", CHOICE, "")
    assert of_the_heater(short) == {"shutdown": ("0", "0", "0"), "starting": AUTOMATIC}


@pytest.mark.parametrize(
    ("row", "cells"),
    [
        ("starting,H1.man,0,1,", ("0", "1", "")),
        ("starting,H1.man,,,0", ("0", "0", "0")),
        ("*,H1.man,,,0", ("0", "0", "0")),
    ],
)
def test_what_an_engineer_wrote_counts(row: str, cells: tuple[str, str, str], short: Short) -> None:
    short.add("setpoints", row)
    assert of_the_heater(short)["starting"] == cells


def test_such_a_row_may_be_left_out(short: Short) -> None:
    short.write("omitted", "table,row", "setpoints,starting H1.man")
    assert "starting" not in of_the_heater(short) and of_the_heater(short)["normal"] == AUTOMATIC
    assert idle_omissions(stated_tables(short.folder)[0], timing_of(short.folder)) == ()


def test_where_a_fallback_leads_nothing_is_handed_back(short: Short) -> None:
    """What another state had left by hand stays, and is handed back at the start."""
    short.edit("setpoints", CHOICE, f"{CHOICE}reduced,P1.man,0,1,\n")
    rows = {r["state"]: r["design"] for r in tables(short.folder)["setpoints"].rows if r["tag"] == "P1.man"}
    assert rows == dict.fromkeys(("reduced", "holding", "normal", "starting"), "")


def test_phases_that_follow_on_each_other_by_themselves_may_go_on_by_hand(short: Short) -> None:
    """After a start by hand nobody can tell what a silent state means, nor before one that is by hand by design."""
    short.add("setpoints", "starting,H1.man,,,0.4")
    assert "normal" not in of_the_heater(short)
    short.edit("setpoints", "starting,H1.man,,,0.4", "normal,H1.man,,,0.4")
    assert "starting" not in of_the_heater(short)


def test_an_output_that_may_not_be_handed_back_is_not(short: Short) -> None:
    short.write("writables", "tag,automatic", "H1.man,no")
    assert set(of_the_heater(short)) == {"reduced", "holding", "shutdown"}


def test_an_output_that_only_ever_was_on_automatic_has_no_row(short: Short) -> None:
    short.edit("setpoints", CHOICE, f"{CHOICE}reduced,P1.man,0,0,\n")
    rows = tables(short.folder)["setpoints"].rows
    assert [r["state"] for r in rows if r["tag"] == "P1.man"] == ["reduced"]


def test_an_actuator_without_a_loop_has_nothing_to_be_handed_back_to(short: Short) -> None:
    short.edit("loops", "TIC2,T2,H1.cmd\n", "")
    assert set(of_the_heater(short)) == {"reduced", "holding", "shutdown"}
