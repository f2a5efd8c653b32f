"""A plant that runs away without its control: it is found, and followed by what its loops were to hold."""

from __future__ import annotations

import numpy as np
import pytest

from homeostat.process.batch import Batch, simulate
from homeostat.process.blocks import Flowsheet, Law, exp, term
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.types import Table, Vec
from tests.process.blocks.sheets import commanded, composed, row, run

STATED = {
    "grows": 0.01, "most": 0.05, "tau_V": 1.0, "Kp_TIC": 2.0, "Ki_TIC": 0.02, "Kp_TRIM": 0.1, "Ki_TRIM": 0.001,
}  # fmt: skip
SETPOINTS = {"Y_sp": 0.45}


def runaway() -> Flowsheet:
    """dx/dt = grows x - most V: a trim, that may take away as well as add, sets what x is held at."""
    s = Flowsheet(replayed="setpoints")
    x = s.state("x", "1", 1.0)
    trim = s.controller("TRIM", measured="Y", acts=1, law=Law(least=term(-1.0)))
    hold = s.controller("TIC", measured="X", acts=1, forward=0.2, setpoint=1.0 + 0.5 * trim.output)
    valve = s.actuator("V", hold.output)
    s.rate(x, "grows" * x - "most" * valve.opening)
    s.sensor("X", x)
    s.sensor("Y", 1.0 - 0.6 * x)
    return s


@pytest.fixture(scope="module")
def plant() -> ComposedModel:
    return composed(runaway(), STATED)


def test_a_record_is_followed_by_setpoints(plant: ComposedModel) -> None:
    inputs = commanded(plant, **SETPOINTS)[None].repeat(5, axis=0)
    followed = plant.replay_inputs({"V_cmd": np.full(5, 0.3)}, inputs)
    assert np.array_equal(followed, inputs, equal_nan=True) and np.isnan(followed[:, plant.inputs.index("V_man")]).all()


def test_its_own_control_goes_on_from_where_it_was_found(plant: ComposedModel) -> None:
    inputs = commanded(plant, **SETPOINTS)
    done, course = run(plant, STATED, inputs, 400)
    found = plant.estimate(plant.readings(done.state[0], inputs))
    assert course["TRIM_out"][-1] < -1e-3  # a trim that takes away is known, too
    for name in ("x", "TRIM_out", "TIC_sp", "TIC_out"):
        assert found[plant.layout.column[name]] == pytest.approx(course[name][-1], abs=1e-3), name
    members = np.stack([done.state[0], found])
    later = simulate(plant.kernel, onwards(plant, members, inputs, 300)).record[:, :, 0]
    assert np.abs(later[1] - later[0]).max() < 0.01  # without its control a thousandth grows twentyfold


def onwards(plant: ComposedModel, members: Table, inputs: Vec, steps: int) -> Batch:
    """The batch of ``members`` that go on under ``inputs``, of which x is recorded."""
    count, none = len(members), np.zeros((len(members), len(plant.faults)))
    return Batch(
        state=members, parameters=row(plant, STATED)[None].repeat(count, axis=0), severity=none, onset_s=none,
        inputs=np.tile(inputs, (1, steps, 1)), input_of=np.zeros(count, dtype=np.int64), start_s=400.0, steps=steps,
        stride=1, record=(plant.layout.column["x"],), seeds=np.arange(count), process_noise=np.zeros(count),
        sensor_noise=np.zeros(count),
    )  # fmt: skip


def test_states_are_found_where_full_steps_lead_away() -> None:
    s = Flowsheet()
    x = s.state("x", "1", 4.0)
    s.rate(x, 0.0 * x)
    s.sensor("R", 1.0 / (1.0 + exp(-1.0 * x)))  # flat where a run begins: a full step goes to -40, where it is flatter
    s.actuator("V")
    model = composed(s, {"tau_V": 1.0, "sd_R": 1e-4})
    assert model.estimate({"R": 0.2, "V_cmd": 0.0})[0] == pytest.approx(np.log(0.2 / 0.8), abs=1e-3)
