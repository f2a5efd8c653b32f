"""An exchanger with what it holds: its effectiveness by hand, a side that stands, heat that is not lost."""

from __future__ import annotations

import numpy as np
import pytest

from homeostat.process.blocks import Exchanger, Flowsheet, FlowsheetError, counter_current, linear_valve
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.term import evaluate
from tests.process.blocks.sheets import commanded, composed, run

STATED = {"start": 20.0, "T_cold": 20.0, "T_hot": 120.0, "UA": 2.0, "C": 2.0, "K": 40.0, "tau_VH": 1.0, "tau_VC": 1.0}


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels run as plain Python: a compiler for each of these would take longer than what they do."""
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")


def model_of(cells: int, faults: tuple[str, ...] = ()) -> ComposedModel:
    """An exchanger with a valve on each side, which passes C [kW/K] when it is open."""
    s = Flowsheet()
    e = Exchanger(s, "E", "UA", "start", cells=cells)
    e.hot(linear_valve("C", s.actuator("VH").opening), "T_hot", "K")
    e.cold(linear_valve("C", s.actuator("VC").opening), "T_cold", "K")
    for name, of in {"T_h": e.hot_out, "T_c": e.cold_out, "Q": e.duty}.items():
        s.sensor(name, of)
    return composed(s, STATED, faults)


@pytest.mark.parametrize("cells", [1, 2, 5])
def test_equal_flows_have_the_effectiveness_that_is_worked_out_by_hand(cells: int) -> None:
    model = model_of(cells)
    _, course = run(model, STATED, commanded(model, VH_cmd=1.0, VC_cmd=1.0), 600)
    by_hand = cells / (2.0 * cells + 1.0) * 100.0
    assert course["T_c_true"][-1] == pytest.approx(20.0 + by_hand, abs=1e-3)
    assert course["T_h_true"][-1] == pytest.approx(120.0 - by_hand, abs=1e-3)
    assert course["Q_true"][-1] == pytest.approx(2.0 * by_hand, abs=1e-2)


def test_many_cells_come_near_to_the_steady_effectiveness() -> None:
    model = model_of(10)
    _, course = run(model, STATED, commanded(model, VH_cmd=1.0, VC_cmd=0.5), 800)
    steady = float(evaluate(counter_current(2.0, (2.0, 120.0), (1.0, 20.0)), {}))
    assert course["Q_true"][-1] == pytest.approx(steady, rel=0.06)


def test_a_side_that_stands_comes_to_the_temperature_of_the_other() -> None:
    model = model_of(2)
    _, course = run(model, STATED, commanded(model, VH_cmd=1.0, VC_cmd=0.0), 1500)
    assert course["T_c_true"][-1] == pytest.approx(120.0, abs=0.1)


def test_what_the_hot_side_gives_is_in_both_sides() -> None:
    model = model_of(2)
    _, course = run(model, STATED, commanded(model, VH_cmd=1.0, VC_cmd=0.0), 100)
    held = sum(STATED["K"] / 2.0 * (course[f"E_{side}{i}"][-1] - 20.0) for side in ("hot", "cold") for i in (1, 2))
    left = np.concatenate([[20.0], course["E_hot2"]])
    given = STATED["C"] * course["VH_position"] * (120.0 - 0.5 * (left[1:] + left[:-1]))
    assert held == pytest.approx(float(given.sum()), rel=1e-3)


def test_a_fouled_exchanger_passes_less() -> None:
    model = model_of(1, faults=("E_fouled",))
    _, course = run(model, STATED, commanded(model, VH_cmd=1.0, VC_cmd=1.0), 600, faults={"E_fouled": 0.5})
    assert course["T_c_true"][-1] == pytest.approx(20.0 + 100.0 / 4.0, abs=1e-3), "UA = C/2: T_c = dT / (1 + 1 + 2)"


@pytest.mark.parametrize("cells", [0, 11])
def test_a_number_of_cells_that_cannot_be_is_refused(cells: int) -> None:
    with pytest.raises(FlowsheetError, match=f"exchanger E: cells = {cells}; a side has 1 to 10"):
        Exchanger(Flowsheet(), "E", "UA", "start", cells=cells)


def test_what_is_inside_is_estimated_from_what_leaves() -> None:
    model = model_of(3)
    result, course = run(model, STATED, commanded(model, VH_cmd=1.0, VC_cmd=0.5), 600)
    told = {name: float(course[name][-1]) for name in ("T_h", "T_c", "VH_cmd", "VC_cmd")}
    estimated = dict(zip(model.states, model.estimate(told), strict=True))
    inside = [f"E_{side}{i}" for side in ("hot", "cold") for i in (1, 2, 3)]
    true = {name: float(result.state[0, model.states.index(name)]) for name in inside}
    assert {name: estimated[name] for name in inside} == pytest.approx(true, abs=0.05)
