"""The pipes' solver on any network: balances and laws hold, and another method finds the same flows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.plants.mixing_module import hydraulics
from tests.plants.mixing_module.module import NOMINAL, TIGHT, Network, batch, network, parameters, run, start, timed
from tests.reference.make_mixing_reference import laws_of, surplus
from tests.reference.make_mixing_reference import network as other_method

HERE = parameters()
OPENING = st.one_of(st.sampled_from([0.0, 1.0]), st.floats(0.0, 1.0))
SPEED = st.one_of(st.just(0.0), st.floats(0.0, 1.0))
LEAK = st.one_of(st.just(0.0), st.floats(0.0, 1.0))
FEED, B204 = st.floats(0.0, 0.22), st.floats(0.0, 1.22)
CONVERGED = 1e-9


@dataclass(frozen=True)
class Plant:
    """What a network is made of."""

    levels: tuple[float, float, float, float]
    outlets: tuple[float, float, float]
    into: float
    n: tuple[float, float]
    clogging: float
    leaks: tuple[float, float]

    def solved(self, guess: float = 0.05) -> Network:
        """By the engine."""
        one, two = (max(NOMINAL["leak_size"] * s, 1e-9) ** -2 for s in self.leaks)
        return network(
            HERE, self.levels, outlets=self.outlets, into_B204=self.into, n=self.n, leak_main=one, leak_common=two,
            main=self.main, guess=guess,
        )  # fmt: skip

    @property
    def main(self) -> float:
        """Resistance of the discharge pipe with its clogging."""
        free = max(1.0 - self.clogging, 1e-6)
        return NOMINAL["k_main"] + NOMINAL["k_clog"] * (1.0 / free**2 - 1.0)

    def otherwise(self) -> tuple[list[float], list[float]]:
        """By the heads' method of the reference, which always arrives."""
        leaks = tuple(max(NOMINAL["leak_size"] * s, 1e-9) for s in self.leaks)
        laws = laws_of(NOMINAL, list(self.outlets), self.into, list(self.n), main=self.main, leaks=(leaks[0], leaks[1]))
        tanks = [*self.levels[:3], NOMINAL["floor_B204"] + self.levels[3]]
        return other_method(laws, tanks, NOMINAL["floor_leak"])


CASES = st.builds(
    Plant, st.tuples(FEED, FEED, FEED, B204), st.tuples(OPENING, OPENING, OPENING), OPENING, st.tuples(SPEED, SPEED),
    st.one_of(st.sampled_from([0.0, 1.0]), st.floats(0.0, 1.0)), st.tuples(LEAK, LEAK),
)  # fmt: skip
OFTEN = settings(max_examples=300, derandomize=True)


@OFTEN
@given(CASES, st.sampled_from([0.0, 0.05, 0.3]))
def test_what_flows_into_a_junction_flows_out_of_it(plant: Plant, guess: float) -> None:
    """Converged or not."""
    now = plant.solved(guess)
    assert np.isfinite(now.flows).all() and np.isfinite(now.heads).all()
    assert np.abs(surplus([(q, 0.0) for q in now.flows])).max() < 1e-12


@OFTEN
@given(CASES)
def test_another_method_finds_the_same_flows(plant: Plant) -> None:
    """Newton on the junctions' heads with an exact line search, laws inverted in closed form, in plain Python."""
    now = plant.solved()
    flows, heads = plant.otherwise()
    np.testing.assert_allclose(now.flows, flows, rtol=0.0, atol=1e-6)
    if max(plant.outlets) > 0.01 and plant.into > 0.01 and max(plant.n) > 0.3:
        np.testing.assert_allclose((now.heads[0], now.heads[2]), (heads[0], heads[2]), rtol=0.0, atol=1e-6)


@OFTEN
@given(CASES)
def test_every_branch_law_is_satisfied(plant: Plant) -> None:
    """What a law says at the heads found is the flow found, to 1e-6 L/s."""
    now = plant.solved()
    p, (s, m, d) = NOMINAL, now.heads
    leaks = tuple(max(p["leak_size"] * x, 1e-9) for x in plant.leaks)
    laws = laws_of(p, list(plant.outlets), plant.into, list(plant.n), main=plant.main, leaks=(leaks[0], leaks[1]))
    top, leak = p["floor_B204"] + plant.levels[3], p["floor_leak"]
    drops = [*(x - s for x in plant.levels[:3]), s - m, m - d, s - d, d - top, m - leak, d - leak]
    for law, drop, flow in zip(laws, drops, now.flows, strict=True):
        assert law(drop)[0] == pytest.approx(flow, abs=1e-6)


@OFTEN
@given(CASES)
def test_the_guess_does_not_matter(plant: Plant) -> None:
    one, two = plant.solved(0.0), plant.solved(0.3)
    np.testing.assert_allclose(one.flows, two.flows, rtol=0.0, atol=1e-6)


def test_the_pumps_law_grows_with_flow_and_the_pipes_too() -> None:
    """One flow for every head, so that the network has one solution; slopes are those of the law."""
    q = np.linspace(-0.3, 0.3, 1201)
    for law in (
        lambda f: hydraulics.pipe(50.0, f),
        lambda f: hydraulics.one_way(50.0, f),
        lambda f: hydraulics.pump(2.141, 2.728, 40.42, 0.9, f),
    ):
        head, slope = np.array([law(float(f)) for f in q]).T
        assert (np.diff(head) > 0.0).all() and (slope > 0.0).all()
        central = (head[2:] - head[:-2]) / (q[2:] - q[:-2])
        smooth = np.abs(slope[2:] - slope[:-2]) < 1.0
        assert smooth.mean() > 0.9
        assert central[smooth] == pytest.approx(slope[1:-1][smooth], rel=1e-6, abs=0.6)


STANDSTILL = {
    f"leak {leak}, speed {n}": Plant((0.2, 0.1, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0, (n, 0.0), 0.0, (leak, 0.0))
    for leak, n in ((0.7, 0.13), (0.3, 0.12))
}
"""A leak of the main line, B204's valve closed, and P101 so slow that its head is about that of the leak."""


@pytest.mark.parametrize("name", STANDSTILL)
def test_the_iteration_ends_also_where_a_non_return_valve_is_about_to_open(name: str) -> None:
    now = STANDSTILL[name].solved()
    assert now.left <= CONVERGED
    np.testing.assert_allclose(now.flows, STANDSTILL[name].otherwise()[0], rtol=0.0, atol=1e-6)


def test_a_pump_runs_down_against_a_closed_valve_and_a_leak() -> None:
    """P101 at 0.9 with its suction open, B204 empty, its valve closed and a leak of 3 %; at 8 s it is stopped."""
    u = timed(30, (0, {"VO1": 1.0, "VO2": 1.0, "P1": 0.9}), (8, {"VO1": 1.0, "VO2": 1.0}))
    result = run(batch(30, x=start(B201=0.2, B202=0.1, B204=0.0), u=u, faults={"leakage_main": (0.03, 0.0)}))
    assert result.of("N1")[-1] < 1e-6 and result.of("q_leak")[-1] < 1e-6


def test_a_leak_that_is_not_there_passes_nothing() -> None:
    now = network(HERE, (0.2, 0.0, 0.0, 0.1), outlets=(1.0, 0.0, 0.0), n=(1.0, 0.0), leak_main=TIGHT)
    assert 0.0 <= now.flows[7] < 2e-9 and 0.0 <= now.flows[8] < 2e-9
