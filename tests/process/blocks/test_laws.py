"""What a flowsheet needs for a plant with phases: laws of controllers, switches, what is held, faults that grow."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from homeostat.process.batch import Batch, simulate
from homeostat.process.blocks import Flowsheet, FlowsheetError, Law, Vessel, limited, pump_flow, term, where
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.true import TrueFlowsheet
from homeostat.process.departures import Departures
from tests.process.blocks.sheets import commanded, composed, row, run

STATED = {"F_in": 0.2, "F_P1": 0.5, "tau_P1": 0.1, "Kp_level": 0.1, "Ki_level": 0.01, "least": -1.0, "t_rest": 1e6,
          "tau_wear": 50.0}  # fmt: skip


def tank() -> Flowsheet:
    """A tank that is fed; its pump follows the measured feed, and a controller trims that down to ``least``."""
    s = Flowsheet()
    feed = s.disturbance("F_in")
    b = Vessel(s, "B1", "L", 10.0, leak=s.hold("lost", s.fault("hole") * term(2.0)))
    b.feed(feed)
    resting = s.time >= "t_rest"
    wild = s.reading("F1") / 0.5
    trim = s.controller("level", "L1", acts=1, law=Law(term("least"), wild, resting))
    pump = s.actuator("P1", where(resting, 0.0, limited(trim.output + wild, 0.0, 1.0)), faults={"weak": "tired"})
    s.sensor("L1", b.volume, off=-s.fault("low"))
    s.sensor("F1", feed)
    out = b.draw(pump_flow("F_P1", pump.opening * (1.0 - s.growing("wear", "tau_wear"))))
    s.sensor("F2", out)
    s.switch("high", b.volume >= 10.5)
    return s


FAULTS = ("hole", "tired", "low", "wear")


@pytest.fixture(scope="module")
def model() -> ComposedModel:
    return composed(tank(), STATED, FAULTS)


def course(
    model: ComposedModel, steps: int, faults: dict[str, float] | None = None, **changes: float
) -> dict[str, np.ndarray]:
    given = {name: value for name, value in changes.items() if name in model.inputs}
    stated = STATED | {name: value for name, value in changes.items() if name not in given}
    return dict(run(model, stated, commanded(model, **{"L1_sp": 10.0} | given), steps, faults)[1])


def test_a_feed_forward_is_added_behind_the_limits_of_the_controller(model: ComposedModel) -> None:
    found = course(model, 400)
    assert found["P1_cmd"][-1] == pytest.approx(0.4, abs=1e-6) and found["B1_V"][-1] == pytest.approx(10.0, abs=0.02)
    assert found["level_out"].min() < 0.0 < -STATED["least"]
    assert course(model, 400, least=0.0, L1_sp=11.0)["level_out"].min() == 0.0


def test_a_controller_that_rests_keeps_its_integral_term(model: ComposedModel) -> None:
    found = course(model, 60, t_rest=20.0)
    assert (found["P1_cmd"][20:] == 0.0).all() and found["P1_cmd"][19] > 0.0
    assert np.unique(found["level_integral"][20:]).size == 1


def test_by_hand_the_integral_term_follows_what_is_left_of_the_command(model: ComposedModel) -> None:
    found = course(model, 50, P1_man=0.7)
    error = found["L1"][-2] - 10.0
    assert found["level_integral"][-1] == pytest.approx(0.7 - 0.2 / 0.5 - 0.1 * error, abs=1e-12)


def test_control_resumes_behind_its_law_without_a_bump(model: ComposedModel) -> None:
    result, found = run(model, STATED, commanded(model, L1_sp=9.5), 80, noise=1.0)
    rows = [model.readings(x, commanded(model, L1_sp=9.5)) for x in result.record[0]]
    states = result.state.copy()
    true = states[0, model.states.index("level_integral")]
    states[:, model.states.index("level_integral")] = 0.0
    model.resume(states, {name: np.array([r[name] for r in rows]) for name in rows[0]}, row(model, STATED)[None])
    assert states[0, model.states.index("level_integral")] == pytest.approx(true, abs=1e-9)
    assert found["level_integral"][-1] == true


def test_a_switch_is_one_where_its_condition_holds(model: ComposedModel) -> None:
    found = course(model, 100, P1_man=0.0)
    assert np.array_equal(found["high"], (found["B1_V"] >= 10.5).astype(float)) and found["high"][-1] == 1.0


def test_control_may_know_a_switch_and_no_state() -> None:
    s = Flowsheet()
    b = Vessel(s, "B1", "L", 1.0)
    s.sensor("L1", b.volume)
    s.actuator("P1", where(s.switch("dry", b.volume <= 0.1) >= 1.0, 0.0, 1.0))
    assert "dry" in s.quantities and s.complete()
    s.actuator("P2", where(b.volume <= 0.1, 0.0, 1.0))
    with pytest.raises(FlowsheetError, match="uses the true 'B1_V'"):
        s.complete()


def test_what_is_held_is_that_of_the_start_of_a_second(model: ComposedModel) -> None:
    found = course(model, 30, {"hole": 0.01}, P1_man=0.0)
    assert found["lost"] == pytest.approx(0.02, abs=1e-15)
    assert found["B1_V"] == pytest.approx(10.0 + 0.18 * np.arange(1, 31), abs=1e-9)


def test_a_fault_grows_into_its_severity(model: ComposedModel) -> None:
    found = course(model, 101, {"wear": 0.5}, P1_man=0.5)
    assert found["F2"][100] == pytest.approx(0.25 * (1.0 - 0.5 * (1.0 - math.exp(-100.0 / 50.0))), rel=1e-9)


def test_a_fault_of_a_transmitter_is_shown_and_is_not_true(model: ComposedModel) -> None:
    found = course(model, 5, {"low": 0.5}, P1_man=0.4)
    assert found["L1"] - found["B1_V"] == pytest.approx(-0.5) and np.array_equal(found["L1_true"], found["B1_V"])


def test_a_fault_has_the_name_that_the_tables_give_it(model: ComposedModel) -> None:
    found = course(model, 20, {"tired": 0.5}, P1_man=0.5)
    assert found["F2"][-1] == pytest.approx(0.125, abs=1e-9)


def test_conditions_are_joined_and_nothing_else_is() -> None:
    a, b = term("a"), term("b")
    assert where((a < b) & (a < 1.0) | (b < 1.0), 1.0, 0.0).args[0].op == "or"
    with pytest.raises(TypeError, match="is no comparison"):
        (a < b) & a


def test_columns_of_members_come_in_the_order_that_is_asked_for() -> None:
    s = tank()
    s.first = ("low", "tau_P1", "F_in")
    model = composed(s, STATED, FAULTS)
    assert model.parameters[:2] == ("tau_P1", "F_in") and model.faults == ("low", "hole", "tired", "wear")


DEPARTURES = Departures(("P1",), ("L1", "F1", "F2"))


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_true_plant_with_neutral_parameters_is_its_model_to_the_bit(model: ComposedModel, noise: float) -> None:
    truth = TrueFlowsheet(tank(), DEPARTURES).behind(model)
    parameters, state = row(model, STATED), model.initial_state(row(model, STATED))
    none = np.zeros((1, len(model.faults)))
    ours = Batch(
        state=state[None], parameters=parameters[None], severity=none, onset_s=np.full_like(none, np.inf),
        inputs=np.tile(commanded(model, L1_sp=10.2), (1, 200, 1)), input_of=np.zeros(1, dtype=np.int64), start_s=0.0,
        steps=200, stride=1, record=tuple(range(len(model.states))), seeds=np.array([3]),
        process_noise=np.full(1, noise), sensor_noise=np.full(1, noise),
    )  # fmt: skip
    theirs = replace(
        ours, state=np.concatenate([state, truth.own_states(state)])[None],
        parameters=np.concatenate([parameters, DEPARTURES.neutral()])[None],
    )  # fmt: skip
    with np.errstate(over="ignore"):
        assert np.array_equal(simulate(model.kernel, ours).record, simulate(truth.kernel, theirs).record)


def test_a_true_plant_that_takes_something_away_is_refused(model: ComposedModel) -> None:
    s = Flowsheet()
    s.sensor("L1", Vessel(s, "B1", "L", 1.0).volume)
    with pytest.raises(FlowsheetError, match="take nothing away"):
        TrueFlowsheet(s, DEPARTURES).behind(model)


def test_a_concentration_may_be_negative_where_it_is_said_to() -> None:
    def mixed(least: float | None) -> float:
        s = Flowsheet()
        b = Vessel(s, "B1", "L", 10.0)
        net = b.holds("net", "mmol/L", least=least)
        b.feed(s.disturbance("F_in"), net="net_in")
        s.sensor("N1", net)
        stated = {"F_in": 0.2, "net_in": -5.0}
        made = composed(s, stated)
        return float(run(made, stated, commanded(made), 50)[1]["B1_net"][-1])

    assert mixed(0.0) == 0.0
    assert mixed(None) == pytest.approx(-2.5, rel=1e-3), "10 L of nothing and 10 L of -5 mmol/L"


def test_a_disturbance_spreads_as_its_docstring_says() -> None:
    """By hand: sd 2, a filter of 8 s and a tick of 1 s give 2 sqrt(tanh(1/16)) = 0.4997; a lag of 24 s half of that."""
    s = Flowsheet()
    outside = s.disturbance("T_in", sd="sd_in", tau="tau_in")
    behind = s.lag("behind", outside, "slow")
    s.rate(s.state("x", "1", 0.0), outside * 0.0)
    s.sensor("T", outside)
    s.quantity("calm", behind)
    stated = {"T_in": 0.0, "sd_in": 2.0, "tau_in": 8.0, "slow": 24.0}
    model = composed(s, stated)
    _, course = run(model, stated, commanded(model), 60_000, noise=1.0)
    assert float(np.std(course["T_in_now"][1000:])) == pytest.approx(0.4997, rel=0.05)
    assert float(np.std(course["behind"][1000:])) == pytest.approx(0.2498, rel=0.07)
