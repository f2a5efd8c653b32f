"""Controllers of a flowsheet: manual, override, split range, cascade, ratio; lags, dead times, memories, analysers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from homeostat.process.blocks import Flowsheet, Vessel, limited, linear_valve, maximum, minimum, where
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.term import Term
from tests.process.blocks.sheets import commanded, composed, row, run

TANK = {"V0": 10.0, "F_in": 0.2, "F_out": 0.2, "tau_V1": 1.0, "tau_V2": 1.0, "Kp_LIC": 0.5, "Ki_LIC": 0.01}


def tank(more: Callable[[Flowsheet, Vessel], None]) -> Flowsheet:
    """A tank whose level is shown as ``L``; ``more`` says what flows."""
    s = Flowsheet()
    b = Vessel(s, "B", "L", "V0")
    s.sensor("L", b.volume)
    more(s, b)
    return s


def levelled(s: Flowsheet, b: Vessel) -> None:
    """A level loop on the inflow, and an outflow that is commanded from outside."""
    b.feed(linear_valve("F_in", s.loop("LIC", measured="L", drives="V1", acts=-1).opening))
    b.draw(linear_valve("F_out", s.actuator("V2").opening))


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels run as plain Python: a compiler for each of these would take longer than what they do."""
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")


@pytest.fixture(scope="module")
def level() -> ComposedModel:
    """A tank with a level loop."""
    return composed(tank(levelled), TANK)


def test_a_first_order_actuator_goes_63_per_cent_in_its_time_constant() -> None:
    model = composed(tank(levelled), {**TANK, "tau_V2": 5.0})
    _, course = run(model, {**TANK, "tau_V2": 5.0}, commanded(model, L_sp=10.0, V2_cmd=0.5), 10)
    assert course["V2_position"][4] == pytest.approx(0.5 * (1.0 - np.exp(-1.0)))


def test_a_second_order_actuator_begins_slowly_and_arrives() -> None:
    def slow(s: Flowsheet, b: Vessel) -> None:
        b.feed(linear_valve("F_in", s.actuator("V1", lags=("tau_V1", "tau_V2")).opening))

    stated = {**TANK, "tau_V1": 10.0, "tau_V2": 10.0}
    model = composed(tank(slow), stated)
    _, course = run(model, stated, commanded(model, V1_cmd=1.0), 200)
    assert course["V1_position"][0] < 0.02 and course["V1_position"][-1] == pytest.approx(1.0, abs=1e-6)


def test_a_loop_holds_its_setpoint_and_is_taken_over_from_manual_without_a_bump(level: ComposedModel) -> None:
    _, course = run(level, TANK, commanded(level, L_sp=12.0, V2_cmd=0.4), 3000)
    assert course["L_true"][-1] == pytest.approx(12.0, abs=1e-3)
    by_hand = np.tile(commanded(level, L_sp=12.0, V2_cmd=0.4, V1_man=0.7), (1, 40, 1))
    by_hand[0, 20:, level.inputs.index("V1_man")] = np.nan
    _, course = run(level, TANK, by_hand[0, 0], 20)
    assert course["V1_cmd"][-1] == 0.7
    integral = course["LIC_integral"][-1] + 0.5 * (12.0 - course["L"][-2])
    assert integral == pytest.approx(0.7, abs=1e-9)


def test_an_integral_does_not_wind_up_behind_a_closed_valve(level: ComposedModel) -> None:
    """An hour above the setpoint with nothing that leaves, then the outlet opens: the valve opens within seconds."""
    _, course = run(level, {**TANK, "V0": 20.0}, commanded(level, L_sp=10.0, V2_cmd=0.0), 3600)
    assert course["V1_cmd"][-1] == 0.0 and course["LIC_integral"][-1] >= -1e-9


def override(s: Flowsheet, b: Vessel) -> None:
    """The smaller of a level and a flow controller's output moves the inlet."""
    low = s.controller("LIC", "L", acts=-1)
    flow = s.controller("FIC", "F", acts=-1)
    f = linear_valve("F_in", s.actuator("V1", minimum(low.output, flow.output)).opening)
    s.sensor("F", f)
    b.feed(f)
    b.draw(linear_valve("F_out", s.actuator("V2").opening))


def test_an_override_lets_the_smaller_output_act_and_the_other_follow() -> None:
    stated = {**TANK, "Kp_FIC": 1.0, "Ki_FIC": 0.2}
    model = composed(tank(override), stated)
    # far below its level: the flow controller limits the inlet to 0.05 L/s
    _, course = run(model, stated, commanded(model, L_sp=100.0, F_sp=0.05, V2_cmd=0.0), 600)
    assert course["F_true"][-1] == pytest.approx(0.05, abs=1e-3)
    assert course["LIC_integral"][-1] == pytest.approx(course["V1_cmd"][-1]), "the other one stands ready, not wound up"
    _, course = run(model, stated, commanded(model, L_sp=12.0, F_sp=0.05, V2_cmd=0.1), 3000)
    assert course["L_true"].max() < 12.5 and course["L_true"][-1] == pytest.approx(12.0, abs=0.02), "and takes over"


def test_a_split_range_moves_one_valve_after_the_other() -> None:
    def split(s: Flowsheet, b: Vessel) -> None:
        out = s.controller("LIC", "L", acts=1).output
        b.feed(Term("number", value=0.15))
        for name, part in {"V1": limited(2.0 * out, 0.0, 1.0), "V2": limited(2.0 * out - 1.0, 0.0, 1.0)}.items():
            b.draw(linear_valve("F_out" if name == "V1" else "F_in", s.actuator(name, part).opening))

    stated = {**TANK, "F_out": 0.1}
    model = composed(tank(split), stated)
    _, course = run(model, stated, commanded(model, L_sp=10.0), 6000)
    assert course["L_true"][-1] == pytest.approx(10.0, abs=1e-2)
    assert course["V1_position"][-1] == pytest.approx(1.0) and course["V2_position"][-1] == pytest.approx(
        0.25, abs=1e-2
    )


def shared(s: Flowsheet, b: Vessel) -> None:
    """One controller draws through two valves."""
    out = s.controller("LIC", "L", acts=1).output
    b.feed(Term("number", value=0.15))
    for name in ("V1", "V2"):
        b.draw(linear_valve("F_out", s.actuator(name, out).opening))


def test_of_two_valves_that_share_a_controller_one_holds_the_level_while_the_other_is_by_hand() -> None:
    model = composed(tank(shared), TANK)
    _, course = run(model, TANK, commanded(model, L_sp=10.0), 3000)
    assert course["L_true"][-1] == pytest.approx(10.0, abs=1e-2)
    assert course["V1_position"][-1] == pytest.approx(0.375, abs=1e-3) == course["V2_position"][-1]
    _, course = run(model, TANK, commanded(model, L_sp=10.0, V1_man=0.0), 3000)
    assert course["L_true"][-1] == pytest.approx(10.0, abs=1e-2), "its controller integrates on"
    assert course["V2_position"][-1] == pytest.approx(0.75, abs=1e-3)


def test_a_controller_that_two_valves_share_goes_on_from_the_one_that_follows_it() -> None:
    model = composed(tank(shared), TANK)
    at = {name: i for i, name in enumerate(model.states)}
    inputs = commanded(model, L_sp=10.0, V1_man=0.0)
    result, course = run(model, TANK, inputs, 3000)
    told = {name: course[name][-200:] for name in ("L", "V1_cmd", "V2_cmd")}
    told |= {name: np.full(200, inputs[i]) for i, name in enumerate(model.inputs)}
    states = result.state.copy()
    states[:, at["LIC_integral"]] = 0.0
    model.resume(states, told, row(model, TANK)[None])
    assert states[0, at["LIC_integral"]] == pytest.approx(result.state[0, at["LIC_integral"]], abs=1e-6)


def cascade(s: Flowsheet, b: Vessel) -> None:
    """A level controller gives a flow controller its setpoint."""
    outer = s.controller("LIC", "L", acts=-1)
    inner = s.controller("FIC", "F", acts=-1, setpoint=outer.output * "F_in")
    f = linear_valve("F_in", s.actuator("V1", inner.output).opening)
    s.sensor("F", f)
    b.feed(f)
    b.draw(linear_valve("F_out", s.actuator("V2").opening))


def test_a_cascade_holds_the_level_and_can_be_given_the_flow() -> None:
    stated = {**TANK, "Kp_FIC": 1.0, "Ki_FIC": 0.2}
    model = composed(tank(cascade), stated)
    _, course = run(model, stated, commanded(model, L_sp=12.0, V2_cmd=0.3), 6000)
    assert course["L_true"][-1] == pytest.approx(12.0, abs=1e-2)
    assert course["F_true"][-1] == pytest.approx(0.06, abs=1e-3)
    _, given = run(model, stated, commanded(model, L_sp=12.0, F_sp=0.02, V2_cmd=0.3), 600)
    assert given["F_true"][-1] == pytest.approx(0.02, abs=1e-3)


def test_a_ratio_follows_the_flow_that_leads() -> None:
    def ratio(s: Flowsheet, b: Vessel) -> None:
        lead = linear_valve("F_out", s.actuator("V2").opening)
        wild = s.sensor("W", lead)
        inner = s.controller("FIC", "F", acts=-1, setpoint=0.5 * wild)
        f = linear_valve("F_in", s.actuator("V1", inner.output).opening)
        s.sensor("F", f)
        b.feed(f)
        b.feed(lead)

    stated = {**TANK, "Kp_FIC": 1.0, "Ki_FIC": 0.2}
    model = composed(tank(ratio), stated)
    _, course = run(model, stated, commanded(model, V2_cmd=0.8), 600)
    assert course["F_true"][-1] == pytest.approx(0.5 * course["W_true"][-1], rel=1e-3)


def test_a_derivative_acts_on_what_changes() -> None:
    def derived(s: Flowsheet, b: Vessel) -> None:
        c = s.controller("LIC", "L", acts=1, derivative=True)
        b.feed(linear_valve("F_in", s.actuator("V1").opening))
        b.draw(linear_valve("F_out", s.actuator("V2", c.output).opening))

    stated = {**TANK, "Kd_LIC": 2.0, "Ki_LIC": 0.0, "Kp_LIC": 0.0}
    model = composed(tank(derived), stated)
    _, course = run(model, stated, commanded(model, L_sp=10.0, V1_cmd=1.0), 30)
    rises = np.diff(course["L"])
    assert course["V2_cmd"][20] == pytest.approx(2.0 * rises[18], rel=1e-6)


def test_a_dead_time_shows_what_was() -> None:
    def delayed(s: Flowsheet, b: Vessel) -> None:
        b.feed(linear_valve("F_in", s.actuator("V1").opening))
        s.sensor("late", s.delay("pipe", b.volume, 30))

    model = composed(tank(delayed), TANK)
    _, course = run(model, TANK, commanded(model, V1_cmd=1.0), 100)
    np.testing.assert_allclose(course["late_true"][40:], course["L_true"][10:-30], rtol=1e-12)


def test_a_lag_follows_with_its_time_constant() -> None:
    def lagged(s: Flowsheet, b: Vessel) -> None:
        b.feed(linear_valve("F_in", s.actuator("V1").opening))
        s.sensor("slow", s.lag("wall", b.volume, 20.0))

    model = composed(tank(lagged), {**TANK, "tau_V1": 0.01})
    _, course = run(model, {**TANK, "tau_V1": 0.01}, commanded(model, V1_cmd=1.0), 400)
    # behind a ramp of 0.2 L/s it is 20 s late, and the second of a step more
    assert course["L_true"][-1] - course["slow_true"][-1] == pytest.approx(0.2 * 20.5, rel=1e-2)


def test_an_analyser_shows_a_new_value_when_it_has_one_and_rounds_it() -> None:
    def analysed(s: Flowsheet, b: Vessel) -> None:
        b.feed(linear_valve("F_in", s.actuator("V1").opening))
        s.sensor("A", b.volume, every_s=60, step=0.5)

    model = composed(tank(analysed), TANK)
    _, course = run(model, TANK, commanded(model, V1_cmd=1.0), 300)
    assert len(np.unique(course["A"])) == 6
    assert np.allclose(np.mod(course["A"], 0.5), 0.0)


def test_a_latch_stays() -> None:
    def latched(s: Flowsheet, b: Vessel) -> None:
        read = s.sensor("S", b.volume)
        tripped = s.memory("tripped", lambda was: where(read > 12.0, 1.0, was))
        b.feed(linear_valve("F_in", s.actuator("V1", where(tripped > 0.5, 0.0, 1.0)).opening))
        b.draw(linear_valve("F_out", maximum(s.actuator("V2").opening, 0.1)))

    model = composed(tank(latched), TANK)
    _, course = run(model, TANK, commanded(model, V2_cmd=0.1), 400)
    first = int(np.argmax(course["tripped"] > 0.5))
    assert first > 0 and course["L"][first - 1] > 12.0 and (course["tripped"][first:] == 1.0).all()
    assert course["L"][-1] < 12.0 and course["V1_cmd"][-1] == 0.0


def test_noise_has_any_number_of_channels() -> None:
    def many(s: Flowsheet, b: Vessel) -> None:
        b.feed(linear_valve("F_in", s.actuator("V1").opening))
        for k in range(130):
            s.sensor(f"L{k}", b.volume)

    model = composed(tank(many), TANK)
    _, course = run(model, TANK, commanded(model, V1_cmd=0.0), 300, noise=1.0)
    noise = np.stack([course[f"L{k}"] - course["L_true"] for k in range(130)])
    shifted = np.concatenate([noise[:, :-1], noise[:, 1:]])
    off = np.corrcoef(shifted) - np.eye(260)
    assert np.abs(off).max() < 0.4, "no channel repeats another one, now or a second later"


def test_resuming_follows_a_cascade() -> None:
    stated = {**TANK, "Kp_FIC": 1.0, "Ki_FIC": 0.2}
    model = composed(tank(cascade), stated)
    inputs = commanded(model, L_sp=12.0, V2_cmd=0.3)
    result, _ = run(model, stated, inputs, 2000)
    read = [model.readings(r, inputs) for r in result.record[0, -2:]]
    states = np.tile(model.estimate(read[-1]), (1, 1))
    model.resume(states, {v: np.array([r[v] for r in read]) for v in read[0]}, np.zeros((1, len(model.parameters))) + [
        {**stated}.get(n, 0.0 if n.startswith("bias_") else 0.01) for n in model.parameters
    ])  # fmt: skip
    for name in ("LIC_out", "FIC_out"):
        at = model.states.index(name)
        assert states[0, at] == pytest.approx(result.state[0, at], abs=1e-3), name


def test_a_flowsheet_may_be_integrated_in_smaller_steps(level: ComposedModel) -> None:
    fine = Flowsheet(parts=4)
    b = Vessel(fine, "B", "L", "V0")
    fine.sensor("L", b.volume)
    levelled(fine, b)
    model = composed(fine, TANK)
    _, coarse = run(level, TANK, commanded(level, L_sp=12.0, V2_cmd=0.4), 200)
    _, finer = run(model, TANK, commanded(model, L_sp=12.0, V2_cmd=0.4), 200)
    np.testing.assert_allclose(coarse["B_V"], finer["B_V"], rtol=1e-6)
