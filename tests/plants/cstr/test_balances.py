"""Matter and heat: what goes in comes out or stays, and the steady state is the one of the closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.plants.cstr.reactor import MODEL, NOMINAL, PUBLISHED, Run, S, batch, inputs, parameters, run

A_EQUIVALENTS = ("CA", "CB", "CC")
"""A + D -> B and A -> C: every mole of B or C was a mole of A."""
D_EQUIVALENTS = ("CB", "CD")
CASES = {
    "filling": (0.0, 290.0, {}, {}),
    "normal": (400.0, 1400.0, {}, {}),
    "overflowing": (1400.0, 2400.0, {"outlet_block": (0.9, 1400.0)}, {}),
    "leaking": (1400.0, 2400.0, {"leak": (0.005, 1450.0)}, {}),
    "draining": (1400.0, 1650.0, {}, {"t_shutdown": 1450.0}),
}


def total(result: Run, names: tuple[str, ...]) -> np.ndarray:
    """Concentration of equivalents over time [mol/L]."""
    return np.sum([result.of(n) for n in names], axis=0)


def imbalance(result: Run, names: tuple[str, ...], feed: float, first: int, last: int) -> tuple[float, float]:
    """(in - out - stored) between two seconds, and what went in [mol]; liquid leaves at the mean of each second."""
    c, v = total(result, names), result.of("V")
    out = result.of("F2_true") + result.of("leak") + result.of("overflow")
    seconds = slice(first, last)
    gone = np.sum(out[seconds] * (c[first:last] + c[first - 1 : last - 1]) / 2.0)
    came = feed * np.sum(result.of("F1_true")[seconds])
    stored = v[last - 1] * c[last - 1] - v[first - 1] * c[first - 1]
    return float(came - gone - stored), float(came)


@pytest.mark.parametrize("plant", CASES)
@pytest.mark.parametrize(("names", "feed"), [(A_EQUIVALENTS, "CA_feed"), (D_EQUIVALENTS, "CD_feed")])
def test_matter_is_conserved_also_while_the_volume_changes(plant: str, names: tuple[str, ...], feed: str) -> None:
    first, last, faults, changes = CASES[plant]
    result = run(batch(int(last), p=parameters(**changes), faults=faults))
    # Below 0.1 L, the first four seconds, the balances are held at that volume.
    missing, came = imbalance(result, names, NOMINAL[feed], max(int(first), 5), int(last))
    scale = max(came, 10.0 * NOMINAL[feed])
    assert abs(missing) < 2e-6 * scale, missing / scale


@pytest.mark.parametrize(("plant", "share"), [("filling", 4.0), ("draining", 0.4)])
def test_the_published_balances_do_not_conserve_matter(plant: str, share: float) -> None:
    """Filling invents more than four times what is fed; draining loses nearly half of what was there."""
    first, last, faults, changes = CASES[plant]
    result = run(batch(int(last), p=parameters(**{"published_balance": 1.0} | changes), faults=faults))
    missing, came = imbalance(result, A_EQUIVALENTS, NOMINAL["CA_feed"], max(int(first), 5), int(last))
    held = total(result, A_EQUIVALENTS)[int(first) - 1] * result.of("V")[int(first) - 1] if first else came
    assert abs(missing) > share * held
    assert (missing < 0.0) == (plant == "filling")


def test_the_published_vessel_holds_five_times_what_was_fed() -> None:
    at = 304 - 1
    published, ours = (run(batch(304, p=parameters(**p))) for p in (PUBLISHED, {}))
    assert published.of("CC")[at] == pytest.approx(0.503654, abs=1e-6)
    fed = 304 / 30 * 0.1
    assert published.of("V")[at] * total(published, A_EQUIVALENTS)[at] == pytest.approx(5.6, abs=0.05)
    assert ours.of("V")[at] * total(ours, A_EQUIVALENTS)[at] == pytest.approx(fed, rel=0.02)


def test_published_and_corrected_balances_agree_where_the_volume_rests() -> None:
    """In steady state, and always in V; temperatures differ by the small heat of reaction alone."""
    same_control = {"trim_low": 0.0}
    a = run(batch(6000, p=parameters(published_balance=1.0, **same_control)))
    b = run(batch(6000, p=parameters(published_balance=0.0, **same_control)))
    assert np.array_equal(a.of("V"), b.of("V"))
    assert np.abs(a.of("T") - b.of("T")).max() < 0.1
    for name in ("CA", "CB", "CC", "CD", "T"):
        assert a.of(name)[-1] == pytest.approx(b.of(name)[-1], rel=1e-6)


def test_a_draining_vessel_keeps_its_composition() -> None:
    """Without feed the equivalents per litre stay what they are; in the published form they decay with the level."""
    u = inputs(V1_man=0.0, P1_man=0.5)
    x = run(batch(1500)).state[0]
    corrected, published = (run(batch(200, u=u, x=x, p=parameters(published_balance=b))) for b in (0.0, 1.0))
    assert corrected.of("V")[-1] < 2.1
    for names in (A_EQUIVALENTS, D_EQUIVALENTS):
        # The valve takes two seconds to close.
        c = total(corrected, names)[20:]
        assert c == pytest.approx(c[0], rel=1e-8)
        assert total(published, names)[-1] < 0.3 * c[0]


FLOW = st.floats(0.0, 0.06)


@given(st.floats(0.55, 10.9), FLOW, FLOW, st.floats(0.0, 0.5), st.floats(280.0, 370.0))
def test_one_second_agrees_with_the_closed_form(v: float, f1: float, f2: float, c0: float, temp: float) -> None:
    """Equivalents, and temperature without heat exchange: y(t) = in + (y0 - in) (V0 / V(t))^(F1 / (F1 - Fo))."""
    p = parameters(UA=0.0, UA_ambient=0.0, dH_A=0.0, dH_AD=0.0)
    x = MODEL.initial_state(p)
    x[[S.V, S.CA, S.CC, S.CD, S.T]] = v, 0.7 * c0, 0.3 * c0, c0, temp
    x[[S.V1_position, S.P1_position]] = f1 / 0.06, f2 / 0.08
    u = inputs(V1_man=f1 / 0.06, P1_man=f2 / 0.08)
    x = run(batch(1, x=x, u=u, p=p)).state[0]
    grown = v + f1 - f2
    assert x[S.V] == pytest.approx(grown, abs=1e-13)
    # expm1 and log1p stay exact where the flows are equal.
    power = f1 * math.log1p((f1 - f2) / v) / (f1 - f2) if abs(f1 - f2) > 1e-12 else f1 / v
    left = math.exp(-power)
    assert x[S.CA] + x[S.CB] + x[S.CC] == pytest.approx(0.1 + (c0 - 0.1) * left, abs=1e-8)
    assert x[S.CB] + x[S.CD] == pytest.approx(0.05 + (c0 - 0.05) * left, abs=1e-8)
    assert x[S.T] == pytest.approx(350.0 + (temp - 350.0) * left, abs=2e-6)


def steady_temperature(flow: float, ua: float) -> float:
    """T_ss(F, UA u) of the heat balance without reaction heat [K]; flow [L/s], ua [W/K]."""
    return (4180.0 * flow * 350.0 + 290.0 * ua + 50.0 * 300.0) / (4180.0 * flow + ua + 50.0)


@pytest.mark.parametrize("feed", [0.2, 5.0 / 9.0, 0.9])
@pytest.mark.parametrize("cooling", [0.0, 0.3, 0.5076, 1.0])
def test_the_steady_state_is_that_of_the_closed_form(feed: float, cooling: float) -> None:
    u = inputs(V1_man=feed, V2_man=cooling)
    x = run(batch(1500)).state[0]
    expected = steady_temperature(0.06 * feed, 500.0 * cooling)
    cold = run(batch(12_000, u=u, x=x, p=parameters(dH_A=0.0, dH_AD=0.0), stride=12_000))
    assert cold.state[0, S.T] == pytest.approx(expected, abs=1e-6)
    reacting = run(batch(12_000, u=u, x=x, stride=12_000))
    assert 0.0 < reacting.state[0, S.T] - expected < 0.02


def test_the_design_point() -> None:
    """Hand check of the kernel: 310 K at u = 0.5076; time constant 94 s; gain -22.6 K; 2.7 W of reaction."""
    assert steady_temperature(1.0 / 30.0, 500.0 * 0.5076) == pytest.approx(310.0, abs=0.01)
    x = run(batch(6000)).state[0]
    assert x[S.T] == pytest.approx(310.0, abs=1e-6)
    assert x[S.V] == pytest.approx(10.0, abs=1e-6)
    assert x[S.V2_position] == pytest.approx(0.507604, abs=1e-6)
    assert 1000.0 * x[S.V] * (
        0.05 * math.exp(-7000 / (8.314 * 310)) * x[S.CA] * x[S.CD] + 0.1 * math.exp(-5000 / (8.314 * 310)) * x[S.CA]
    ) == pytest.approx(2.7, abs=0.05)
    step = run(
        batch(2000, x=x, u=inputs(V1_man=x[S.V1_position], P1_man=x[S.P1_position], V2_man=x[S.V2_position] + 0.01))
    )
    change = step.of("T") - 310.0
    assert change[-1] / 0.01 == pytest.approx(-22.6, abs=0.4)
    assert np.argmax(change < (1.0 - 1.0 / math.e) * change[-1]) == pytest.approx(94.0, abs=2.0)
