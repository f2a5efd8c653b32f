"""A remedy never names a value that another check refuses."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from homeostat.domain.plant.timing import Timing
from homeostat.evaluate.lint.deep import integration, safe_states
from homeostat.evaluate.lint.finding import Place
from homeostat.knowledge.description.guarding import times_s

TIMING = Timing(tick_s=1.0, response_s=300.0)


def hindered(back_s: float) -> str:
    bench: Any = SimpleNamespace(
        plant=SimpleNamespace(description=SimpleNamespace(timing=TIMING)),
        places=SimpleNamespace(row=lambda table, **cells: Place(f"{table}.csv")),
    )
    failure = safe_states._Failure("V1_stuck_open", "too late", back_s)
    (found,) = safe_states._hindered(bench, "stop", "LIM-L1", [failure, None])
    return found.remedy


def test_a_time_is_named_up_to_the_longest_that_may_be_stated() -> None:
    longest_s = times_s("acts_within_s", TIMING)[1]
    assert "about twice as long" in hindered(0.5 * longest_s)
    told = hindered(0.51 * longest_s)
    assert "about twice" not in told and f"acts_within_s may be {longest_s:g} s at most" in told
    assert "rate in fallbacks.csv, fastest in writables.csv" in told


@pytest.mark.parametrize(("rate", "named"), [(10.0, True), (1e7, False)])
def test_a_motion_is_named_that_the_flowsheet_takes(rate: float, named: bool) -> None:
    coarse = integration.Coarse(0.5, rate, 1, "x", "at the start")
    layout: Any = SimpleNamespace(tick_s=1.0, sheet=SimpleNamespace(fastest_s=1.0))
    _, remedy = integration._told(coarse, "it", layout)
    assert ("fastest_s=" in remedy) is named
