"""The published base case, and single equations worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from homeostat.plants.tennessee_eastman import flows, substances
from homeostat.plants.tennessee_eastman.control import GRADE
from homeostat.process.blocks.term import Leaf, Term, evaluate, term
from tests.plants.tennessee_eastman.eastman import (
    DESIGN,
    SHEET,
    SHOWN,
    THOUSANDS,
    eastman,
    leaves_at,
    measured,
    model,
    rates,
    stated,
)

BASE = (
    0.25052, 3664.0, 4509.3, 9.3477, 26.902, 42.339, 2705.0, 75.0, 120.40, 0.33712, 80.109, 50.0, 2633.7, 25.160, 50.0,
    3102.2, 22.949, 65.731, 230.31, 341.43, 94.599, 77.297, 32.188, 8.8933, 26.383, 6.8820, 18.776, 1.6567, 32.958,
    13.823, 23.978, 1.2565, 18.579, 2.2633, 4.8436, 2.2986, 0.01787, 0.83570, 0.09858, 53.724, 43.828,
)  # fmt: skip
"""The 41 measurements of the base case (Downs and Vogel 1993, table 4 and 5)."""
NOISE = {
    1: 0.0012, 2: 18.0, 3: 22.0, 4: 0.05, 5: 0.2, 6: 0.21, 7: 0.3, 8: 0.5, 9: 0.01, 10: 0.0017, 11: 0.01, 12: 1.0,
    13: 0.3, 14: 0.125, 15: 1.0, 16: 0.3, 17: 0.115, 18: 0.01, 19: 1.15, 20: 0.2, 21: 0.01, 22: 0.01, 23: 0.25,
    24: 0.1, 25: 0.25, 26: 0.1, 27: 0.25, 28: 0.025, 29: 0.25, 30: 0.1, 31: 0.25, 32: 0.1, 33: 0.25, 34: 0.025,
    35: 0.05, 36: 0.05, 37: 0.01, 38: 0.01, 39: 0.01, 40: 0.5, 41: 0.5,
}  # fmt: skip
"""Standard deviation of the noise of each measurement (XMEAS) in the published code, in its published unit."""
T = Term(Leaf.STATE, value="t")


def start() -> dict[Term, object]:
    """The plant where a run begins."""
    x = model().initial_state(stated())
    states = {name: np.array([x[model().layout.column[name]]]) for name in SHEET.states}
    return leaves_at(states, np.array([DESIGN]), {})


def test_a_run_begins_at_the_published_base_case() -> None:
    shown = measured(start())
    off = {v: abs(float(np.ravel(shown[v])[0]) / base - 1.0) for v, base in zip(SHOWN, BASE, strict=True)}
    assert max(off.values()) < 5e-3, off


def test_the_grade_is_a_mole_fraction_and_that_of_the_base_case_is_as_much_g_as_h_by_mass() -> None:
    shown = {v: float(np.ravel(value)[0]) for v, value in measured(start()).items()}
    g, h = (shown[f"X11{name}"] * substances.MASS["ABCDEFGH".index(name)] for name in "GH")
    assert g == pytest.approx(h, rel=1e-3) and shown["X11G"] == pytest.approx(GRADE)
    words = {s.tag.name: s.tag.description for s in eastman().description.signals}
    assert "mol %" in words["X11G"] and "mol %" in words["X11G.sp"] and words["Gp"].startswith("Mole fraction of G")


@pytest.mark.parametrize("number", NOISE)
def test_an_instrument_is_as_noisy_as_the_published_one(number: int) -> None:
    name = SHOWN[number - 1]
    ours = stated()[model().parameters.index(f"sd_{name}")] / (1000.0 if name in THOUSANDS else 1.0)
    assert ours == pytest.approx(NOISE[number]), f"XMEAS {number}, {name}"


def test_the_base_case_is_at_rest() -> None:
    values = start()
    for name, rate in rates(values).items():
        if name != "product":
            held = max(abs(float(np.ravel(values[Term(Leaf.STATE, value=name)])[0])), 1e-3)
            assert abs(float(np.ravel(rate)[0])) < 0.05 * held, name  # by hand: twenty hours at that rate


def test_the_base_case_costs_what_was_published() -> None:
    """By hand: purge 15.1 kmol/h at 7.60 USD, product 211.4 kmol/h at 0.143, 341.4 kWh at 0.0536, 230.3 kg at 0.0318.

    That is 114.7 + 30.3 + 18.3 + 7.3 = 170.6 USD an hour (Downs and Vogel 1993, table 9, and the base case there).
    """
    shown = {v: float(np.ravel(value)[0]) for v, value in measured(start()).items()}
    lost = {"A": 2.209, "C": 6.177, "D": 22.06, "E": 14.56, "F": 17.89, "G": 30.44, "H": 22.94}
    purge = 44.791 * shown["F9"] * sum(price * shown[f"X9{name}"] for name, price in lost.items()) / 100.0
    product = 9.21 * shown["F11"] * sum(lost[name] * shown[f"X11{name}"] for name in "DEF") / 100.0
    assert purge == pytest.approx(114.7, abs=0.5) and product == pytest.approx(30.3, abs=0.2)
    assert purge + product + 0.0536 * shown["JK"] + 0.0318 * shown["FS"] == pytest.approx(170.6, abs=0.5)


def test_what_is_made_is_what_is_fed_less_what_is_purged() -> None:
    """A, C, D and E come in as 11.2 + 417.5 + 114.5 + 98 kmol/h, and leave as G and H; B leaves with the purge only."""
    shown = {v: float(np.ravel(value)[0]) for v, value in measured(start()).items()}
    inert_in = shown["F4"] / 0.022412 * 0.005 + 1e-4 * (shown["F1"] / 0.022412 + shown["F2"] / 32.0)
    inert_out = shown["F9"] / 0.022412 * shown["X9B"] / 100.0
    assert inert_out == pytest.approx(inert_in, rel=0.01)


def test_vapour_pressure_and_density_by_hand() -> None:
    """G at 120.4 degC: exp(16.43 - 2748 / 353.3) mmHg, and 49.9 - 0.0191 T - 4.25e-4 T^2 = 41.44 lb/ft3 of 62 lb."""
    at = {T: 120.4}
    mmhg = math.exp(16.43 - 2748.0 / 353.3)
    assert evaluate(substances.vapour_pressure(6, T), at) == pytest.approx(mmhg * 101.325 / 760.0)
    assert evaluate(substances.molar_volume(6, T), at) == pytest.approx(62.0 / 41.44 / 35.3145 / 0.454, rel=1e-3)


@pytest.mark.parametrize("i", range(8))
def test_a_heat_capacity_is_the_slope_of_its_enthalpy(i: int) -> None:
    for heat, capacity in (
        (substances.liquid_heat, substances.liquid_capacity),
        (substances.vapour_heat, substances.vapour_capacity),
    ):
        slope = (evaluate(heat(i, T), {T: 80.01}) - evaluate(heat(i, T), {T: 79.99})) / 0.02
        assert evaluate(capacity(i, T), {T: 80.0}) == pytest.approx(slope, rel=1e-6)


def test_a_valve_passes_by_the_root_of_its_drop() -> None:
    """1937.6 lb/h at 1 mmHg are 879.7 kg/h of 20 kg/kmol, and twice that at 4 mmHg; backwards there is no flow."""
    mmhg = 101.325 / 760.0
    for drop, flow in ((1.0, 43.98), (4.0, 87.97), (-1.0, 0.0)):
        assert evaluate(flows.through(1937.6, term(drop * mmhg), term(20.0)), {}) == pytest.approx(flow, rel=1e-3)
