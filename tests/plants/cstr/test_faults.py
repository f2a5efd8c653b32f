"""Each of the nine faults does what its table says: from its onset on, as much as its severity says, and no more."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest

from tests.plants.cstr.reactor import FAULTS, NOMINAL, SEVERITY, Run, S, batch, inputs, parameters, rows, run

START_S, ONSET_S, STEPS = 2000.0, 2050.0, 400
STEADY = run(batch(2000)).state[0]
HEALTHY = run(batch(STEPS, x=STEADY, start_s=START_S))


def faulty(**severities: float) -> Run:
    """From steady state, with faults from ``ONSET_S`` on."""
    faults = {name: (severity, ONSET_S) for name, severity in severities.items()}
    return run(batch(STEPS, x=STEADY, start_s=START_S, faults=faults))


def fouling(r: Run, size: float, others: frozenset[str]) -> tuple[np.ndarray, np.ndarray]:
    age = np.arange(STEPS) + START_S - ONSET_S
    return r.of("UA"), 500.0 * (1.0 - size * (1.0 - np.exp(-age / 2000.0)))


def pump_capacity(r: Run, others: frozenset[str], size: float, other: str) -> tuple[np.ndarray, np.ndarray]:
    left = (1.0 - size) * (1.0 - SEVERITY[other] if other in others else 1.0)
    return r.of("F2_true"), 0.08 * left * r.of("P1_pos")


def stuck(r: Run, position: str, at: float) -> tuple[np.ndarray, np.ndarray]:
    """Position from the first second on, up to what is left of the movement, e^(-1/0.3) = 3.6 % per second."""
    pos = r.of(position)
    begin = int(ONSET_S - START_S)
    left = np.concatenate([np.zeros(begin), np.exp(-(np.arange(STEPS - begin) + 1.0) / 0.3)])
    return pos, at + left * (pos[begin - 1] - at)


EFFECT: dict[str, Callable[[Run, float, frozenset[str]], tuple[np.ndarray, np.ndarray]]] = {
    "fouling": fouling,
    "pump_degrade": lambda r, s, others: pump_capacity(r, others, s, "outlet_block"),
    "outlet_block": lambda r, s, others: pump_capacity(r, others, s, "pump_degrade"),
    "cool_stuck_closed": lambda r, s, others: stuck(
        r, "V2_pos", SEVERITY["cool_stuck_open"] if "cool_stuck_open" in others else 1.0 - s
    ),
    "cool_stuck_open": lambda r, s, others: stuck(r, "V2_pos", s),
    "inlet_stuck_open": lambda r, s, others: stuck(r, "V1_pos", s),
    "temp_bias": lambda r, s, others: (r.of("T1") - r.of("T"), np.full(STEPS, s)),
    "level_bias": lambda r, s, others: (r.of("L1") - r.of("V"), np.full(STEPS, -s)),
    "leak": lambda r, s, others: (r.of("leak"), s * np.concatenate([[STEADY[S.V]], r.of("V")[:-1]])),
}
"""Fault -> (what is seen, what must be seen), given its severity and the other faults, which have nominal ones."""
ONE_EARLIER = {"temp_bias", "level_bias"}
"""Faults of transmitters show in the reading taken at the onset; the others in the state a second later."""


def check(result: Run, fault: str, size: float, others: frozenset[str] = frozenset()) -> None:
    """The documented effect, in every second from the onset on."""
    begin = int(ONSET_S - START_S) - (fault in ONE_EARLIER)
    seen, expected = EFFECT[fault](result, size, others)
    np.testing.assert_allclose(seen[begin:], expected[begin:], rtol=1e-12, atol=1e-12, err_msg=fault)


def test_the_table_has_these_nine() -> None:
    assert {r["id"] for r in rows("faults")} == set(FAULTS) == set(EFFECT)


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("share", [0.3, 0.7, 1.0])
def test_documented_effect_scaled_by_severity(fault: str, share: float) -> None:
    result = faulty(**{fault: share * SEVERITY[fault]})
    check(result, fault, share * SEVERITY[fault])


@pytest.mark.parametrize("fault", FAULTS)
def test_nothing_before_the_onset_and_something_in_its_second(fault: str) -> None:
    result = faulty(**{fault: SEVERITY[fault]})
    begin = int(ONSET_S - START_S) - (fault in ONE_EARLIER)
    assert np.array_equal(result.record[0, :begin], HEALTHY.record[0, :begin])
    # At its onset fouling is (1 - exp(0)) = nothing yet.
    grace = 1 if fault == "fouling" else 0
    assert not np.array_equal(result.record[0, begin + grace], HEALTHY.record[0, begin + grace])


@pytest.mark.parametrize("fault", FAULTS)
def test_severity_zero_is_health(fault: str) -> None:
    assert np.array_equal(faulty(**{fault: 0.0}).record, HEALTHY.record)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_that_began_before_the_run_acts_from_the_start(fault: str) -> None:
    result = run(batch(3, x=STEADY, start_s=START_S, faults={fault: (SEVERITY[fault], 100.0)}))
    assert not np.array_equal(result.record[0, 0], HEALTHY.record[0, 0])


@pytest.mark.parametrize("pair", list(itertools.combinations(FAULTS, 2)), ids="+".join)
def test_faults_superpose(pair: tuple[str, str]) -> None:
    """Both effects at once; capacities multiply, and a cooling valve that is stuck both ways is open."""
    result = faulty(**{f: SEVERITY[f] for f in pair})
    for fault in pair:
        check(result, fault, SEVERITY[fault], frozenset(pair) - {fault})


def test_all_nine_at_once_stay_in_the_physical_world() -> None:
    result = run(batch(4000, x=STEADY, start_s=START_S, faults={f: (SEVERITY[f], ONSET_S) for f in FAULTS}))
    assert np.isfinite(result.record).all() and result.of("V").min() >= 0.0


def test_onsets_are_each_faults_own() -> None:
    late = {"pump_degrade": (0.5, ONSET_S), "temp_bias": (5.0, ONSET_S + 100.0)}
    both = run(batch(STEPS, x=STEADY, start_s=START_S, faults=late))
    one = faulty(pump_degrade=0.5)
    assert np.array_equal(both.record[0, :149], one.record[0, :149])
    assert both.of("T1")[149] - one.of("T1")[149] == pytest.approx(5.0)


def test_a_stuck_valve_moves_against_its_command() -> None:
    """The symptom that is natural for it: the command is the controller's, not the fault's."""
    result = faulty(cool_stuck_closed=0.7)
    assert result.of("V2_cmd")[-1] > 0.75 and result.of("V2_pos")[-1] == pytest.approx(0.3)
    manual = run(batch(STEPS, x=STEADY, start_s=START_S, faults={"cool_stuck_open": (0.8, 0.0)}, u=inputs(V2_man=0.1)))
    assert manual.of("V2_cmd")[-1] == 0.1 and manual.of("V2_pos")[-1] == pytest.approx(0.8)


def test_fouling_takes_at_most_95_percent() -> None:
    result = run(batch(5, x=STEADY, start_s=1e6, p=parameters(t_shutdown=1e9), faults={"fouling": (1.0, 0.0)}))
    assert result.of("UA") == pytest.approx(0.05 * NOMINAL["UA"])


def test_the_consequences_without_intervention() -> None:
    """Noise-free peaks of the published model that do not depend on its level trim or its species balances."""

    def worst(fault: str, name: str) -> float:
        whole = run(batch(5000, x=STEADY, start_s=START_S, faults={fault: (SEVERITY[fault], START_S)}))
        return float(whole.of(name).max())

    assert worst("fouling", "T") == pytest.approx(313.967, abs=0.02)
    assert worst("cool_stuck_closed", "T") == pytest.approx(316.118, abs=0.02)
    assert worst("outlet_block", "V") == pytest.approx(11.5115, abs=0.01)
    assert worst("inlet_stuck_open", "T") == pytest.approx(315.457, abs=0.05)
