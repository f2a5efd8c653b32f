"""Steps of many stages: of second order, stable with fast motions, and the same in a kernel as by hand."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from homeostat.process.batch import ProcessError
from homeostat.process.blocks import Flowsheet, FlowsheetError
from homeostat.process.blocks.stabilised import fastest, lengths, stages_of
from homeostat.process.blocks.stiffness import Motion
from tests.process.blocks.sheets import commanded, composed, row, run

FAST = {"fast": 20.0, "slow": 0.01}
"""A cell that follows within 0.05 s, and one that takes 100 s [1/s]."""


def cells(fastest_s: float | None) -> Flowsheet:
    """A cell that follows another one at once, which falls slowly."""
    s = Flowsheet(fastest_s=fastest_s)
    slow, fast = s.state("slow_x", "1", 1.0), s.state("fast_x", "1", 0.0)
    s.rate(slow, -slow * "slow")
    s.rate(fast, (slow * slow - fast) * "fast")
    s.sensor("S", slow)
    s.sensor("F", fast)
    return s


def after(rate: float, tick_s: float, fastest_s: float) -> float:
    """What a tick makes of 1 where y' = -rate y."""
    begun = before = first = here = 1.0
    for stage in stages_of(tick_s, fastest_s):
        found = -rate * here
        if stage.fresh:
            begun, before, first = here, 0.0, found
        now = (1.0 - stage.here - stage.before) * begun + stage.here * here + stage.before * before
        before, here = here, now + stage.rate * found + stage.first * first
    return here


def test_two_stages_by_hand() -> None:
    """A tick of 0.1 s for what takes a second is one step of two stages: 1 - h + h^2 / 2, as any method of order 2."""
    assert len(stages_of(0.1, 1.0)) == 2 and lengths(0.1, 1.0) == pytest.approx((0.1,))
    assert after(1.0, 0.1, 1.0) == pytest.approx(1.0 - 0.1 + 0.1**2 / 2.0, abs=1e-12)


@pytest.mark.parametrize("fastest_s", [0.004, 0.02, 0.5])
def test_what_is_slow_is_the_exponential_to_the_second_order(fastest_s: float) -> None:
    wrong = [abs(after(1.0, h, fastest_s * h) - math.exp(-h)) for h in (0.1, 0.05)]
    assert wrong[0] < 0.1**3 and 6.0 < wrong[0] / wrong[1] < 10.0, "an error that goes with the third power of a step"


@pytest.mark.parametrize(("tick_s", "fastest_s"), [(60.0, 0.6), (1.0, 0.01), (0.1, 0.5), (3600.0, 2.0)])
def test_steps_grow_and_what_does_not_swing_dies_out_within_a_tick(tick_s: float, fastest_s: float) -> None:
    steps = lengths(tick_s, fastest_s)
    assert sum(steps) == pytest.approx(tick_s) and steps[0] <= fastest_s + 1e-12
    assert all(after_it == pytest.approx(1.5 * step) for step, after_it in itertools.pairwise(steps))
    bound = fastest(tick_s, fastest_s)
    assert bound >= 1.0 / fastest_s
    assert max(abs(after(rate, tick_s, fastest_s)) for rate in np.geomspace(0.01 * bound, bound, 500)) < 1.0
    assert len(steps) < 5 or abs(after(1.0 / fastest_s, tick_s, fastest_s)) < 0.02, "it has died out"


@pytest.mark.slow
def test_a_kernel_follows_fast_cells() -> None:
    """By hand: the fast cell is the slow one's square, exp(-2 t / 100), but for what that falls in 0.05 s."""
    model = composed(cells(0.05), FAST)
    found = run(model, FAST, commanded(model), 100)[1]
    assert found["slow_x"][-1] == pytest.approx(math.exp(-1.0), rel=1e-5)
    assert found["fast_x"][-1] == pytest.approx(math.exp(-2.0) * 20.0 / 19.98, rel=3e-3)
    once = composed(cells(None), FAST)
    with pytest.raises(ProcessError, match="left the physical world"):
        run(once, FAST, commanded(once), 100)


def test_plain_and_compiled_steps_are_the_same() -> None:
    model = composed(cells(0.05), FAST)
    begun = model.initial_state(row(model, FAST))
    motion = Motion(model.layout, begun[None], np.zeros((1, len(model.inputs))), row(model, FAST))
    found = run(model, FAST, commanded(model), 3)[1]
    ahead = dict(zip(motion.names, motion.ahead(3)[0], strict=True))
    assert found["fast_x"][-1] == pytest.approx(ahead["fast_x"], rel=1e-12)
    finer = dict(zip(motion.names, motion.ahead(3, 4)[0], strict=True))
    assert finer["fast_x"] != ahead["fast_x"] and finer["fast_x"] == pytest.approx(ahead["fast_x"], rel=3e-3)
    assert motion.stable[0] >= 20.0


@pytest.mark.parametrize("wrong", [0.0, -1.0, math.nan, math.inf])
def test_a_fastest_motion_takes_a_time(wrong: float) -> None:
    with pytest.raises(
        FlowsheetError,
        match=r"fastest_s = .*: it is a time in seconds, more than 0, or it is left out|has no end; write a finite",
    ):
        Flowsheet(fastest_s=wrong)


def test_what_is_far_too_fast_for_a_tick_is_told() -> None:
    with pytest.raises(FlowsheetError, match=r"fastest_s = 1e-06 beside a tick of 1 s: a step would have \d+ stages"):
        composed(cells(1e-6), FAST)
