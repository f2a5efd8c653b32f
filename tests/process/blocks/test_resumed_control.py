"""A record is gone on with as if nothing had happened, whatever stands between controllers, plant and instruments."""

from collections.abc import Callable

import numpy as np
import pytest

from homeostat.process.batch import Batch, simulate
from homeostat.process.blocks import Flowsheet, Vessel, limited, linear_valve, minimum
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.term import Term
from tests.process.blocks.sheets import commanded, composed, row, run

STATED = {
    "V0": 10.0, "F_in": 0.2, "F_out": 0.2, "tau_V1": 1.0, "tau_V2": 1.0, "tau_V3": 1.0,
    "Kp_LIC": 0.5, "Ki_LIC": 0.01, "Kp_FIC": 1.0, "Ki_FIC": 0.2,
}  # fmt: skip
Build = Callable[[Flowsheet, Vessel], None]


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels run as plain Python: a compiler for each of these would take longer than what they do."""
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")


def tank(build: Build) -> ComposedModel:
    """A tank with an outlet that is commanded from outside; every position is shown."""
    s = Flowsheet()
    b = Vessel(s, "B", "L", "V0")
    s.sensor("L", b.volume)
    build(s, b)
    b.draw(linear_valve("F_out", s.actuator("V2").opening))
    for a in s.actuators.values():
        s.sensor(f"{a.name}_pos", a.position)
    return composed(s, STATED)


def inlet(s: Flowsheet, b: Vessel, name: str, opening: Term) -> None:
    f = linear_valve("F_in", opening)
    if name:
        s.sensor(name, f)
    b.feed(f)


def override(s: Flowsheet, b: Vessel) -> None:
    level, flow = s.controller("LIC", "L", acts=-1), s.controller("FIC", "F", acts=-1)
    inlet(s, b, "F", s.actuator("V1", minimum(level.output, flow.output)).opening)


def cascade(s: Flowsheet, b: Vessel) -> None:
    level = s.controller("LIC", "L", acts=-1)
    flow = s.controller("FIC", "F", acts=-1, setpoint=level.output * "F_in")
    inlet(s, b, "F", s.actuator("V1", flow.output).opening)


def split(s: Flowsheet, b: Vessel) -> None:
    out = s.controller("LIC", "L", acts=-1).output
    inlet(s, b, "", s.actuator("V1", limited(2.0 * out - 1.0, 0.0, 1.0)).opening)
    b.draw(linear_valve("F_out", s.actuator("V3", limited(1.0 - 2.0 * out, 0.0, 1.0)).opening))


def drained(s: Flowsheet, b: Vessel) -> None:
    """Something flows in all the time, so that the second part of the split range, an outlet, is what moves."""
    split(s, b)
    b.feed(linear_valve("F_in", 0.4))


def drained_by_a_loop(s: Flowsheet, b: Vessel) -> None:
    """The first part of the split range is the setpoint of an inner loop, which comes last of what follows it."""
    out = s.controller("LIC", "L", acts=-1).output
    wanted = limited(2.0 * out - 1.0, 0.0, 1.0) * "F_in"
    flow = s.controller("FIC", "F", acts=-1, setpoint=wanted)
    inlet(s, b, "F", s.actuator("V1", flow.output).opening)
    b.draw(linear_valve("F_out", s.actuator("V3", limited(1.0 - 2.0 * out, 0.0, 1.0)).opening))
    b.feed(linear_valve("F_in", 0.4))


@pytest.mark.parametrize(
    ("build", "given"),
    [
        pytest.param(override, {"L_sp": 100.0, "F_sp": 0.05, "V2_cmd": 0.1}, id="the flow controller is selected"),
        pytest.param(override, {"L_sp": 12.0, "F_sp": 0.19, "V2_cmd": 0.3}, id="the level controller is selected"),
        pytest.param(override, {"L_sp": 12.0, "F_sp": 0.1, "V2_cmd": 0.3, "V1_man": 0.4}, id="selected by hand"),
        pytest.param(cascade, {"L_sp": 12.0, "V2_cmd": 0.3}, id="a level sets a flow"),
        pytest.param(cascade, {"L_sp": 12.0, "F_sp": 0.07, "V2_cmd": 0.3}, id="a flow that a level no longer sets"),
        pytest.param(split, {"L_sp": 12.0, "V2_cmd": 0.3}, id="the inlet of a split range"),
        pytest.param(split, {"L_sp": 5.0, "V2_cmd": 0.0}, id="the outlet of a split range"),
        pytest.param(drained, {"L_sp": 10.2, "V2_cmd": 0.0}, id="the outlet of a split range moves"),
        pytest.param(drained, {"L_sp": 10.2, "V2_cmd": 0.0, "V1_man": 0.1}, id="it moves, the inlet is by hand"),
        pytest.param(drained_by_a_loop, {"L_sp": 10.2, "V2_cmd": 0.0}, id="a split range over a loop: the valve"),
        pytest.param(drained_by_a_loop, {"L_sp": 10.2, "V2_cmd": 0.7}, id="a split range over a loop: the loop"),
        pytest.param(drained_by_a_loop, {"L_sp": 10.2, "F_sp": 0.05, "V2_cmd": 0.0}, id="the loop is set by hand"),
    ],
)
@pytest.mark.parametrize("at", [40, 600])
def test_a_record_is_gone_on_with_without_a_bump(build: Build, given: dict[str, float], at: int) -> None:
    model, later = tank(build), 20
    inputs = commanded(model, **given)
    _, course = run(model, STATED, inputs, at + later)
    states = np.stack([course[name] for name in model.states], axis=1)
    record = [model.readings(state, inputs) for state in states[: at + 1]]
    begun = model.estimate(record[-1])[None]
    parameters = row(model, STATED)[None]
    model.resume(begun, {name: np.array([r[name] for r in record]) for name in record[0]}, parameters)
    commands = [a.command for a in model.flowsheet.actuators.values()]
    none = np.zeros((1, len(model.faults)))
    batch = Batch(
        state=begun, parameters=parameters, severity=none, onset_s=none, inputs=np.tile(inputs, (1, later, 1)),
        input_of=np.zeros(1, dtype=np.int64), start_s=float(at), steps=later, stride=1,
        record=tuple(model.states.index(name) for name in commands), seeds=np.array([7]),
        process_noise=np.zeros(1), sensor_noise=np.zeros(1),
    )  # fmt: skip
    with np.errstate(over="ignore"):
        again = simulate(model.kernel, batch).record[0]
    for i, name in enumerate(commands):
        assert again[: later - 1, i] == pytest.approx(course[name][at + 1 :], abs=0.01), name


@pytest.mark.parametrize("slow", ["lag", "delay"])
def test_what_an_instrument_shows_late_is_known_from_it(slow: str) -> None:
    """A state that no instrument shows at once stands where the late one says, not where a run begins."""
    s = Flowsheet()
    level, acid = s.state("V", "L", "V0"), s.state("x", "mol/L", 0.1)
    s.rate(level, Term("number", value=0.0))
    s.rate(acid, -0.001 * acid)
    late = s.lag("probe", acid, "tau_probe") if slow == "lag" else s.delay("probe", acid, 5.0)
    s.sensor("L", level)
    s.sensor("C", 2.0 * late)
    model = composed(s, {"V0": 10.0, "tau_probe": 8.0})
    state = dict(zip(model.states, model.estimate({"L": 12.0, "C": 0.06}).tolist(), strict=True))
    assert state["V"] == pytest.approx(12.0) and state["x"] == pytest.approx(0.03)
    assert state["probe" if slow == "lag" else "probe_0"] == pytest.approx(0.03)


def relief(s: Flowsheet, b: Vessel) -> None:
    """An outlet that opens above 12 L; the tank is filled from 10 L on."""
    out = s.controller("LIC", "L", acts=1).output
    b.draw(linear_valve("F_out", s.actuator("V3", out).opening))
    b.feed(linear_valve("F_in", s.actuator("V1").opening))


def test_a_relief_that_has_never_opened_opens_at_its_setpoint_and_not_before() -> None:
    """What just closes it, 0.5 / L * 2 L, would open it at the first rise: a forecast would promise too much of it."""
    model, at, later = tank(relief), 40, 60
    inputs = commanded(model, L_sp=12.0, V1_cmd=0.0, V2_cmd=0.0)
    _, course = run(model, STATED, inputs, at + 1)
    record = [model.readings(state, inputs) for state in np.stack([course[n] for n in model.states], axis=1)]
    begun = model.estimate(record[-1])[None]
    parameters = row(model, STATED)[None]
    model.resume(begun, {name: np.array([r[name] for r in record]) for name in record[0]}, parameters)
    filled = commanded(model, L_sp=12.0, V1_cmd=0.5, V2_cmd=0.0)
    none = np.zeros((1, len(model.faults)))
    shown = tuple(model.states.index(name) for name in ("B_V", "V3_cmd"))
    batch = Batch(
        state=begun, parameters=parameters, severity=none, onset_s=none, inputs=np.tile(filled, (1, later, 1)),
        input_of=np.zeros(1, dtype=np.int64), start_s=float(at), steps=later, stride=1, record=shown,
        seeds=np.array([7]), process_noise=np.zeros(1), sensor_noise=np.zeros(1),
    )  # fmt: skip
    with np.errstate(over="ignore"):
        content, command = simulate(model.kernel, batch).record[0].T
    assert content[0] < 10.5 and content[-1] > 12.2
    assert np.all(command[content < 11.9] == 0.0) and command[-1] > 0.1
