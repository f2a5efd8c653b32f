"""Controllers that a command holds, alone or in favour of another one, and overrides that it switches off."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from homeostat.process.batch import Batch, simulate
from homeostat.process.blocks import Flowsheet, FlowsheetError, Law, Vessel, limited, linear_valve, maximum, where
from homeostat.process.blocks.agreement import StatedUnits, disagreements
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.types import Table, Vec
from tests.process.blocks.sheets import commanded, composed, row

STATED = {"V0": 10.0, "F_in": 0.2, "F_out": 0.2, "tau_V1": 1.0, "tau_V2": 1.0, "Kp_LIC": 0.1, "Ki_LIC": 0.01,
          "Kp_LIX": 0.05, "Ki_LIX": 0.005, "L_high": 11.0}  # fmt: skip
STEADY = {"L_sp": 10.0, "V2_cmd": 0.5, "LIC_on": 1.0, "LIX_on": 0.0, "LY_on": 1.0}


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels run as plain Python: a compiler for each of these would take longer than what they do."""
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")


def tank() -> Flowsheet:
    """A level on the inlet that can be held, or left to another controller; of a full tank it closes."""
    s = Flowsheet()
    b = Vessel(s, "B", "L", "V0")
    instead = s.command("LIX_on")
    rests = Law(held=instead <= 0.5, meanwhile=s.output("LIC"))
    s.controller("LIX", "L", -1, setpoint=s.setpoint("L"), law=rests)
    stands = where(instead > 0.5, s.output("LIX"), s.output("LIC"))
    law = Law(held=(s.command("LIC_on") < 0.5) | (instead > 0.5), meanwhile=stands)
    c = s.controller("LIC", "L", -1, setpoint=s.setpoint("L"), law=law)
    full = limited(0.5 * maximum(s.reading("L") - "L_high", 0.0), 0.0, 1.0)
    takes = where(s.command("LY_on") < 0.5, 0.0, full)
    b.feed(linear_valve("F_in", s.actuator("V1", c.output, withheld=takes).opening))
    b.draw(linear_valve("F_out", s.actuator("V2").opening))
    s.sensor("L", b.volume)
    return s


@pytest.fixture(scope="module")
def model() -> ComposedModel:
    return composed(tank(), STATED)


def inputs(model: ComposedModel, steps: int, *events: tuple[int, Mapping[str, float]]) -> Table:
    """Inputs of every tick, shape (steps, inputs): ``STEADY``, and from each tick of ``events`` on what is said."""
    found = np.tile(commanded(model, **STEADY), (steps, 1))
    for at, values in events:
        for name, value in values.items():
            found[at:, model.inputs.index(name)] = value
    return found


def course(model: ComposedModel, given: Table, state: Vec | None = None) -> dict[str, Vec]:
    """State -> its course under ``given`` inputs, from where the plant starts or from ``state``."""
    parameters, none = row(model, STATED)[None], np.zeros((1, len(model.faults)))
    batch = Batch(
        state=(model.initial_state(parameters[0]) if state is None else state)[None], parameters=parameters,
        severity=none, onset_s=none, inputs=given[None], input_of=np.zeros(1, dtype=np.int64), start_s=0.0,
        steps=len(given), stride=1, record=tuple(range(len(model.states))), seeds=np.array([7]),
        process_noise=np.zeros(1), sensor_noise=np.zeros(1),
    )  # fmt: skip
    with np.errstate(over="ignore"):
        found = simulate(model.kernel, batch).record[0]
    return dict(zip(model.states, found.T, strict=True))


def test_what_is_frozen_is_constant_whatever_is_read_and_asked_for(model: ComposedModel) -> None:
    found = course(model, inputs(model, 900, (400, {"LIC_on": 0.0, "V2_cmd": 0.3, "L_sp": 12.0, "LY_on": 0.0})))
    assert np.unique(found["LIC_out"][400:]).size == 1 and found["LIC_out"][400] == found["LIC_out"][399]
    assert found["L_true"][-1] > found["L_true"][399] + 5.0


def test_a_controller_that_was_frozen_goes_on_without_a_bump_and_has_not_wound_up(model: ComposedModel) -> None:
    """Ten minutes of an error of litres: it goes on by Ki e = 0.01 e in its first tick, and integrates from there."""
    found = course(model, inputs(model, 1100, (400, {"LIC_on": 0.0, "V2_cmd": 0.48}), (1000, {"LIC_on": 1.0})))
    out, error = found["LIC_out"], 10.0 - found["L"]
    assert abs(error[999]) > 1.0
    assert out[1000] - out[999] == pytest.approx(0.1 * (error[999] - error[998]), abs=1e-9)
    assert out[1001] - out[1000] == pytest.approx(0.1 * (error[1000] - error[999]) + 0.01 * error[999], abs=1e-9)


def test_another_controller_takes_over_and_gives_back_where_the_first_one_stands(model: ComposedModel) -> None:
    found = course(model, inputs(model, 1500, (300, {"LIX_on": 1.0, "L_sp": 10.5}), (1000, {"LIX_on": 0.0})))
    one, other = found["LIC_out"], found["LIX_out"]
    assert np.array_equal(one[300:1000], other[300:1000])
    assert other[1001:] == pytest.approx(one[1000:-1], abs=1e-12), "the other one stands where the first did"
    assert abs(one[1000] - one[999]) < 1e-3 and found["L_true"][-1] == pytest.approx(10.5, abs=1e-2)


def test_an_override_acts_above_its_bound_and_not_where_it_is_switched_off(model: ComposedModel) -> None:
    """At 11.5 L it takes 0.25 from what is commanded, which has to be more by that; below 11 L it takes nothing."""
    for on, taken in ((1.0, 0.25), (0.0, 0.0), (np.nan, 0.25)):
        found = course(model, inputs(model, 900, (100, {"L_sp": 11.5, "LY_on": on}), (700, {"L_sp": 10.5})))
        assert (found["V1_cmd"] - found["V1_position"])[690] == pytest.approx(taken, abs=0.01)
        assert found["L_true"][690] == pytest.approx(11.5, abs=0.02), "control makes up for it"
        assert (found["V1_cmd"] - found["V1_position"])[-1] == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize(
    "event", [{"LIC_on": 0.0, "V2_cmd": 0.48}, {"LIX_on": 1.0, "L_sp": 10.5}, {"L_sp": 11.5}], ids=str
)
def test_a_record_is_gone_on_with_without_a_bump(model: ComposedModel, event: dict[str, float]) -> None:
    """Frozen, taken over by another one, and with neither: what is commanded and read says where control stands."""
    at, later = 500, 60
    whole = inputs(model, at + later, (300, event), (at + 20, {"LIC_on": 1.0, "LIX_on": 0.0}))
    found = course(model, whole)
    states = np.stack([found[name] for name in model.states], axis=1)
    record = [model.readings(state, given) for state, given in zip(states[:at], whole, strict=False)]
    begun = model.estimate(record[-1])[None]
    told = {name: np.array([each[name] for each in record]) for name in record[0]}
    model.resume(begun, told, row(model, STATED)[None])
    again = course(model, whole[at:], begun[0])
    assert again["V1_cmd"] == pytest.approx(found["V1_cmd"][at:], abs=2e-3)


def test_a_memory_that_an_instrument_shows_is_known_from_it() -> None:
    s = tank()
    asked = s.memory("asked", lambda was: where(s.reading("L") > 11.0, was, 0.3), start=0.1)
    s.sensor("A", asked)
    model = composed(s, STATED)
    readings = {name: 10.0 if name == "L" else 0.4 for name in model.shown}
    assert model.estimate(readings)[model.states.index("asked")] == 0.4
    assert model.estimate({"L": 10.0})[model.states.index("asked")] == 0.1


def test_a_command_of_a_name_that_is_taken_is_refused_and_units_of_switches_agree() -> None:
    with pytest.raises(FlowsheetError, match="LIC_on"):
        tank().command("LIC_on")
    variables = {"L": "L", "L_sp": "L", "LIC_on": "1", "LIX_on": "1", "LY_on": "1"}
    parameters = dict.fromkeys(("V0", "bias_L", "sd_L"), "L") | {"L_high": "L", "tau_V1": "s", "tau_V2": "s"}
    parameters |= dict.fromkeys(("F_in", "F_out"), "L/s") | dict.fromkeys(("Kp_LIC", "Kp_LIX"), "1/L")
    parameters |= dict.fromkeys(("Ki_LIC", "Ki_LIX"), "1/(L s)")
    found = disagreements(tank(), StatedUnits(parameters, variables, {}))
    assert len(found) == 1 and "withheld from V1" in found[0], "half of it for each litre has a unit"
