"""No liquid is made or lost: V + delivered + spilled + overflowed - supplied stays what it was."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.plants.mixing_module.layout import S
from homeostat.process.types import Table, Vec
from tests.plants.mixing_module.module import FAULTS, MODEL, RANGE, Run, batch, run, start, timed

END_S = 420
TOTALS = ("supplied", "delivered", "spilled", "overflowed", "dry_s", "dead_head_s")
LITRES = 1e-9
"""What may be missing after a batch [L]."""


def by_the_clock(pumps: dict[str, float]) -> Table:
    """A batch: fill three tanks, empty them with ``pumps``, drain."""
    line = {"VI4": 1.0} | pumps
    return timed(
        END_S, (0, {"VI1": 1.0}), (38, {"VI2": 1.0}), (76, {"VI3": 1.0}), (114, {"VO1": 1.0} | line),
        (140, {"VO2": 1.0} | line), (166, {"VO3": 1.0} | line), (200, {"VI4": 1.0}), (204, {"VO4": 1.0}), (340, {}),
    )  # fmt: skip


MAIN, BOTH = by_the_clock({"P1": 0.9}), by_the_clock({"P1": 0.9, "P2": 0.9})
BYPASS = by_the_clock({"P2": 0.9})
FLOOD = timed(END_S, (0, {"VI1": 1.0, "VI2": 1.0, "VI3": 1.0, "VO1": 1.0, "VI4": 1.0, "P1": 1.0}))
CASES: dict[str, tuple[Table, dict[str, tuple[float, float]]]] = {
    "no fault": (MAIN, {}),
    "bypass": (BYPASS, {}),
    "both pumps": (BOTH, {}),
    "tanks that overflow": (FLOOD, {}),
    "leak of the main line": (MAIN, {"leakage_main": (0.3, 60.0)}),
    "largest leak of the common line": (MAIN, {"leakage_common": (1.0, 0.0)}),
    "both leaks, both pumps": (BOTH, {"leakage_main": (0.5, 30.0), "leakage_common": (0.2, 150.0)}),
    "clogging": (MAIN, {"clogging_main": (0.8, 120.0), "clogging_common": (0.5, 0.0), "clogging_B202": (1.0, 0.0)}),
    "outlets that do not close": (MAIN, {"stuck_open_VO201": (1.0, 0.0), "stuck_open_VO203": (0.2, 0.0)}),
    "inlet and drain that do not close": (MAIN, {"stuck_open_VI202": (0.2, 50.0), "stuck_open_VO204": (0.3, 120.0)}),
    "pump that stops": (MAIN, {"pump_failure": (1.0, 125.0)}),
}


def missing(result: Run, x: Vec, member: int = 0) -> Vec:
    """What was made (positive) or lost since the start, over time [L]."""
    held = result.record[member, :, S.V1 : S.V4 + 1].sum(axis=1)
    gone = sum(result.of(n, member) for n in ("delivered", "spilled", "overflowed"))
    return held + gone - result.of("supplied", member) - (x[S.V1 : S.V4 + 1].sum() + booked(x))


def booked(x: Vec) -> float:
    """Totals at the start [L]."""
    return float(x[S.delivered] + x[S.spilled] + x[S.overflowed] - x[S.supplied])


def check(result: Run, x: Vec) -> None:
    """Balance, and that every amount is possible, in every second."""
    assert np.abs(missing(result, x)).max() < LITRES
    possible(result)


def possible(result: Run) -> None:
    """No tank holds less than nothing or more than fits; no total ever falls."""
    v = result.record[0, :, S.V1 : S.V4 + 1]
    assert v.min() >= 0.0
    assert (v <= 14.31355 * np.array([0.22, 0.22, 0.22, 1.22]) * (1.0 + 1e-12)).all()
    for name in TOTALS:
        assert (np.diff(result.of(name)) >= 0.0).all(), name
    assert min(result.of("q_leak").min(), result.of("q_drain").min(), result.of("q_over").min()) >= 0.0


@pytest.mark.parametrize("plant", CASES)
def test_a_batch_with_noise_conserves_liquid(plant: str) -> None:
    u, faults = CASES[plant]
    x = start()
    result = run(batch(END_S, u=u, faults=faults, x=x, process=1.0, sensor=1.0, first_seed=7))
    check(result, x)
    if plant == "tanks that overflow":
        assert result.of("overflowed")[-1] > 5.0
    if "leak" in plant:
        assert result.of("spilled")[-1] > 0.3


@dataclass(frozen=True)
class Odd:
    """A run with any faults, any commands at any times, and any start."""

    x: Vec
    u: Table
    faults: dict[str, tuple[float, float]]
    seed: int


@st.composite
def odd(draw: st.DrawFn) -> Odd:
    steps = 240
    command = st.one_of(st.sampled_from([0.0, 1.0]), st.floats(0.0, 1.0))
    u = np.zeros((steps, len(MODEL.inputs)))
    for since in sorted(draw(st.lists(st.integers(0, steps - 1), min_size=1, max_size=6, unique=True))):
        u[since:] = draw(st.lists(command, min_size=len(MODEL.inputs), max_size=len(MODEL.inputs)))
    faults = {
        name: (draw(st.floats(*RANGE[name])), float(draw(st.integers(0, steps))))
        for name in draw(st.lists(st.sampled_from(FAULTS), max_size=4, unique=True))
    }
    feed, collect = st.one_of(st.just(0.0), st.floats(0.0, 0.22)), st.one_of(st.just(0.0), st.floats(0.0, 1.22))
    x = start(B201=draw(feed), B202=draw(feed), B203=draw(feed), B204=draw(collect))
    return Odd(x, u, faults, draw(st.integers(0, 10_000)))


def simulated(what: Odd) -> Run:
    return run(
        batch(len(what.u), x=what.x, u=what.u, faults=what.faults, process=1.0, sensor=1.0, first_seed=what.seed)
    )


SOMETIMES = settings(max_examples=150, derandomize=True)


@SOMETIMES
@given(odd())
def test_nothing_impossible_happens_whatever_is_commanded_and_whatever_fails(what: Odd) -> None:
    possible(simulated(what))


@SOMETIMES
@given(odd())
def test_liquid_is_conserved_whatever_is_commanded_and_whatever_fails(what: Odd) -> None:
    check(simulated(what), what.x)


def test_an_empty_b204_gives_nothing_back_through_a_standing_line() -> None:
    """Drained, and a feed tank open below it: the non-return valves let 1e-8 L/s of nothing back."""
    x = start(B203=0.1, B204=0.0)
    result = run(batch(60, x=x, u=timed(60, (0, {"VO1": 1.0}))))
    assert result.of("q_transfer").min() >= 0.0
    check(result, x)


def test_a_leak_takes_no_more_than_the_tanks_give() -> None:
    """B201 runs empty while the main line leaks and B204 is empty and closed."""
    x = start(B201=0.004, B202=0.0, B203=0.0, B204=0.0, VO1=1.0, n=(1.0, 0.0))
    result = run(batch(60, x=x, u=timed(60, (0, {"VO1": 1.0, "P1": 1.0})), faults={"leakage_main": (1.0, 0.0)}))
    check(result, x)


def test_totals_go_on_from_what_they_were() -> None:
    """A member that starts in the middle of a batch keeps its books."""
    half = run(batch(160, u=MAIN[:160], process=1.0)).state[0]
    result = run(batch(END_S - 160, x=half, u=MAIN[160:], start_s=160.0, process=1.0))
    check(result, half)
    assert math.isclose(result.of("supplied")[0], half[S.supplied], abs_tol=1e-12)
