"""At the bounds of what a search may ask for: the plant stays what it is, and steps are short enough for its gas."""

from __future__ import annotations

import itertools

import numpy as np

from homeostat.process.batch import Batch, BatchRun
from homeostat.process.blocks.stiffness import Motion
from tests.plants.tennessee_eastman.eastman import eastman, model, stated

TICKS = 720


def test_every_corner_of_what_may_be_adjusted_is_followed_for_half_a_day() -> None:
    """With steps of 4 s (Runge-Kutta 4) four of sixteen corners left the physical world after two to three hours."""
    plant, d = eastman(), eastman().description
    (state,) = (each for each in d.machine.states if each.name == "adjusted")
    free = [each for each in state.setpoints if each.low < each.high]
    corners = list(itertools.product(*((each.low, each.high) for each in free)))
    assert len(corners) >= 16
    inputs = np.tile(plant.start, (len(corners), TICKS, 1))
    for setpoint, values in zip(free, zip(*corners, strict=True), strict=True):
        inputs[:, 60:, model().inputs.index(d.variables[setpoint.tag])] = np.array(values)[:, None]
    none = np.zeros((len(corners), len(model().faults)))
    batch = Batch(
        state=np.repeat(model().initial_state(stated())[None], len(corners), axis=0),
        parameters=np.repeat(stated()[None], len(corners), axis=0),
        severity=none,
        onset_s=none.copy(),
        inputs=inputs,
        input_of=np.arange(len(corners)),
        start_s=0.0,
        steps=TICKS,
        stride=1,
        record=tuple(range(len(model().states))),
        seeds=np.arange(len(corners)),
        process_noise=np.zeros(len(corners)),
        sensor_noise=np.zeros(len(corners)),
    )
    run = BatchRun(model().kernel, batch, model().states.__getitem__, refuse=False)
    run.advance(TICKS)
    assert np.isfinite(run.record).all()
    for k, course in enumerate(run.record[:, ::8]):
        motion = Motion(model().layout, course, inputs[k, ::8], stated())
        assert np.max(motion.fastest()[0] / motion.stable) < 1.0, corners[k]


def test_a_stop_is_followed_beyond_the_limits() -> None:
    """Water that is too hot boils the separator dry while the feeds are shut: a fallback is foreseen all the same."""
    plant, d = eastman(), eastman().description
    inputs = np.tile(plant.start, (1, TICKS, 1))
    (stop,) = d.fallback_strategies
    for each in stop.actions.commands:
        inputs[0, 20:, model().inputs.index(d.variables[each.tag])] = np.nan if each.value is None else each.value
    parameters = np.array([plant.true_parameters(seed, spread=2.5) for seed in range(1, 9)])
    severity = np.zeros((len(parameters), len(model().faults)))
    severity[:, model().faults.index("S_water_hot")] = 6.0
    severity[:, model().faults.index("V3_stuck_closed")] = 1.0
    batch = Batch(
        state=np.array([model().initial_state(each) for each in parameters]),
        parameters=parameters,
        severity=severity,
        onset_s=np.zeros_like(severity),
        inputs=inputs,
        input_of=np.zeros(len(parameters), dtype=np.int64),
        start_s=0.0,
        steps=TICKS,
        stride=1,
        record=(model().states.index("LS_true"),),
        seeds=np.arange(len(parameters)),
        process_noise=np.ones(len(parameters)),
        sensor_noise=np.ones(len(parameters)),
    )
    run = BatchRun(model().kernel, batch, model().states.__getitem__, refuse=False)
    run.advance(TICKS)
    assert np.isfinite(run.record).all() and run.record.min() < 2.7, "beyond the limit, and still there"
