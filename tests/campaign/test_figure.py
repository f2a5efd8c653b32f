"""The picture of a run: limits where they are in force, moments in their order, the same bytes for the same run."""

from __future__ import annotations

import numpy as np
import pytest

from homeostat.campaign.figure import draw
from homeostat.campaign.figure_marks import explained
from homeostat.campaign.figure_panel import in_force, thresholds
from homeostat.campaign.milestones import Milestones
from homeostat.campaign.runner import RunResult, run
from homeostat.campaign.scenario import scenario
from homeostat.cases.case import Case, load_case
from homeostat.domain.formula import parse
from homeostat.domain.limits import Limit, LimitKind
from homeostat.domain.snapshot import Trajectory
from homeostat.plant.clock import DeclaredClock
from homeostat.trace import MemoryTrace


def limit(text: str) -> Limit:
    return Limit("LIM", LimitKind.INTERLOCK, parse(text), True, "table", "what it protects")


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("T1 <= 313", [(313.0, True)]),
        ("313 > T1", [(313.0, True)]),
        ("T1 >= -5", [(-5.0, False)]),
        ("-5 <= T1 and T1 < 20", [(-5.0, False), (20.0, True)]),
        ("L1 >= 2 or F1 <= 0.1", []),
        ("T1 - L1 <= 3", []),
    ],
)
def test_thresholds(text: str, found: list[tuple[float, bool]]) -> None:
    assert [(t.value, t.upper) for t in thresholds(limit(text), ("T1", "T1.sp"))] == found


def test_a_limit_is_not_in_force_while_an_alternative_holds() -> None:
    truth = Trajectory(1.0, 1.0, {"L1": np.array([[3.0, 1.0, 1.0]]), "F1": np.array([[1.0, 1.0, 0.0]])})
    one = limit("L1 >= 2 or F1 <= 0.1")
    (threshold,) = thresholds(one, ("L1",))
    assert in_force(one, threshold.node, truth).tolist() == [True, True, False]
    alone = limit("L1 >= 2")
    assert in_force(alone, thresholds(alone, ("L1",))[0].node, truth).all()


@pytest.fixture(scope="module")
def case() -> Case:
    return load_case("cstr")


def leaking(case: Case) -> tuple[RunResult, Milestones]:
    trace, milestones = MemoryTrace(), Milestones()
    trace.subscribe(milestones)
    return run(case, scenario(case, "leak", 1, 700.0, end_s=800.0), trace, DeclaredClock(1.0)), milestones


def test_moments_in_their_order_and_equal_runs_equal_pictures(case: Case) -> None:
    done, milestones = leaking(case)
    marks = explained(done, milestones)
    assert [m.at_s for m in marks] == sorted(m.at_s for m in marks) and marks[0].at_s == 700.0
    assert [m.words.split()[0] for m in marks] == ["leak", "noticed", "fallback"]
    assert draw(case, done, milestones) == draw(case, *leaking(case))
