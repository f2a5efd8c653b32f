"""Permissives: judged on the readings as they would be right after the release, and undecided ones do not hold."""

from __future__ import annotations

import math

import pytest

from homeostat.domain.plant.limits import Criterion, LimitKind, Limits, Owner
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Finding
from homeostat.guard.requests.permissives import finding, permissive_findings, refusal, unjudged, usable
from homeostat.stl.deciding import Deciding
from tests.guard.vessel import HOT, LIMITS, limit

READ = {"T": 305.0, "Tx": 305.0, "L": 11.5, "F.sp": 0.0, "X.cmd": 1.0, "V.man": 0.5}


def judged(text: str, *commands: Command, bad: frozenset[str] = frozenset(), **values: float) -> Finding:
    """The one permissive ``text``, judged on the vessel's readings with some of them changed."""
    readings = READ | {name.replace("_", "."): value for name, value in values.items()}
    (found,) = permissive_findings(Snapshot(7.0, readings, bad), commands, only(text))
    return found


def only(text: str) -> Limits:
    return Limits((limit("PRM", LimitKind.PERMISSIVE, text), HOT), ())


def test_a_permissive_that_holds_says_by_how_much_and_one_that_does_not_says_so() -> None:
    assert judged("L <= 12") == Finding(
        "PRM", Owner.ACTION, 0.5, "L", 0.0, 0, "What PRM protects: 'L <= 12' holds by 0.5 L at 0 s (PRM)"
    )
    assert judged("L <= 11") == Finding(
        "PRM", Owner.ACTION, -0.5, "L", 0.0, 0, "What PRM protects: 'L <= 11' is violated by 0.5 L at 0 s (PRM)"
    )


def test_at_the_limit_a_permissive_holds() -> None:
    found = judged("L <= 11.5")
    assert found.satisfied and " holds by 0 L " in found.message


def test_only_permissives_are_judged_each_once_in_table_order() -> None:
    found = permissive_findings(Snapshot(7.0, READ), (), LIMITS)
    assert [f.criterion for f in found] == ["PRM-FEED", "PRM-OPEN"]


def test_what_is_commanded_counts_as_commanded_whatever_it_reads() -> None:
    assert judged("F.sp <= 0.01", F_sp=0.02).satisfied is False
    assert judged("F.sp <= 0.01", Command("F.sp", 0.004, 0.005), F_sp=0.02).margin == pytest.approx(0.006)
    assert judged("F.sp <= 0.01", Command("F.sp", 0.02, 0.005)).margin == pytest.approx(-0.01)


def test_what_is_handed_back_to_automatic_has_no_value_any_more() -> None:
    found = judged("V.man <= 0.9", Command("V.man", None, None))
    assert found.margin == -math.inf and "without a usable value of 'V.man'" in found.message


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_reading_that_is_no_number_decides_nothing(value: float) -> None:
    assert judged("L <= 12", L=value) == refusal(
        "PRM", "'L <= 12' cannot be judged without a usable value of 'L' (PRM)"
    )


def test_a_reading_that_is_marked_bad_decides_nothing() -> None:
    found = judged("L <= 12 and T <= 310", bad=frozenset({"L", "T"}))
    assert found.message == "'L <= 12 and T <= 310' cannot be judged without a usable value of 'L', 'T' (PRM)"
    assert usable(Snapshot(7.0, READ, frozenset({"L"}))) == {t: v for t, v in READ.items() if t != "L"}


def test_what_the_usable_readings_decide_needs_no_other() -> None:
    assert judged("F.sp <= 0.001 or L <= 11", bad=frozenset({"L"})).satisfied
    assert unjudged(HOT, {"T": 305.0}) is None and unjudged(HOT, {"T": 320.0}) is None


def test_readings_that_give_no_number_leave_a_limit_undecided() -> None:
    assert judged("T / Tx <= 1", T=0.0, Tx=0.0).message == "'T / Tx <= 1' has no value at these readings (PRM)"
    assert judged("T / Tx <= 1", Tx=math.nan).message == (
        "'T / Tx <= 1' cannot be judged without a usable value of 'Tx' (PRM)"
    )


def test_a_margin_that_is_not_known_is_violated_without_limit() -> None:
    criterion = Criterion("CRT", Owner.PLANNING, HOT.formula, True, "", "Vessel")
    found = finding(criterion, math.nan, 30.0, 4)
    assert found == Finding(
        "CRT", Owner.PLANNING, -math.inf, "K", 0.0, 4,
        "Vessel: 'T <= 313' cannot be judged, a value that it needs is not known (CRT)",
    )  # fmt: skip
    found = finding(criterion, -1.25, 30.0, 4)
    assert found == Finding(
        "CRT", Owner.PLANNING, -1.25, "K", 30.0, 4, "Vessel: 'T <= 313' is violated by 1.25 K at 30 s (CRT)"
    )


def test_what_decides_is_told_in_its_own_unit() -> None:
    mixed, by = limit("PRM", LimitKind.PERMISSIVE, "L <= 11 or T <= 300"), Deciding("L <= 11", -0.5, "L")
    found, said = finding(mixed, -2.5, 30.0, 4, by), "What PRM protects: 'L <= 11 or T <= 300' is violated by"
    assert (found.margin, found.unit, found.deciding) == (-2.5, mixed.formula.unit, by)
    assert found.message == f"{said} 0.5 L at 30 s (PRM)"
    unknown = finding(mixed, -2.5, 30.0, 4, Deciding("L <= 11", -0.5, ""))
    assert unknown.message == f"{said} 2.5 {mixed.formula.unit} at 30 s (PRM)".replace("  ", " ")


def test_no_margin_cures_a_refusal() -> None:
    assert refusal("CHK", "no") == Finding("CHK", Owner.ACTION, -math.inf, "1", 0.0, 0, "no")


@pytest.mark.parametrize(("by_hand", "holds"), [(0.0, True), (0.05, True), (1.0, False)])
def test_by_hand_a_command_is_what_the_manual_output_is_commanded_to(by_hand: float, holds: bool) -> None:
    """Whatever the command is at this moment: one that closes is not refused, and one that opens is."""
    rules = only("X.cmd <= 0.1 or L >= 20").with_manual({"X.man": "X.cmd"})
    for now in (0.0, 1.0):
        snapshot = Snapshot(7.0, READ | {"X.cmd": now})
        (found,) = permissive_findings(snapshot, (Command("X.man", by_hand, None),), rules)
        assert found.satisfied is holds
        (beside,) = permissive_findings(snapshot, (Command("F.sp", 0.0, None),), rules)
        assert beside.satisfied is (now <= 0.1)
