"""The reactor as a process model: the contract, and what is its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from homeostat.process.model import ProcessModel
from homeostat.process.types import Vec
from tests.contracts.process_model import ProcessModelContract
from tests.plants.cstr import reactor
from tests.plants.cstr.reactor import S, U


class TestReactor(ProcessModelContract):
    @pytest.fixture
    def model(self) -> ProcessModel:
        return reactor.MODEL

    @pytest.fixture
    def parameters(self) -> Vec:
        return reactor.parameters()

    @pytest.fixture
    def inputs(self) -> Vec:
        return reactor.inputs()

    @pytest.fixture
    def settle_s(self) -> int:
        return 1500

    @pytest.fixture
    def corrected(self) -> tuple[str, ...]:
        return ("T1", "L1")


def test_layout_and_tables_have_the_same_names() -> None:
    """The one place where positions are known, and the one place where meanings and values are."""
    assert set(reactor.NOMINAL) == set(reactor.MODEL.parameters)
    assert {r["id"] for r in reactor.rows("faults")} == set(reactor.FAULTS)
    read = reactor.MODEL.readings(reactor.MODEL.initial_state(reactor.parameters()), reactor.inputs())
    assert set(reactor.VARIABLES.values()) <= set(read)


def test_a_fault_of_a_transmitter_is_in_what_is_shown_and_not_in_the_truth() -> None:
    p = reactor.parameters(bias_T2=0.2, bias_F1=0.01)
    b = reactor.batch(50, p=p, x=reactor.run(reactor.batch(1500)).state[0], faults={"temp_bias": (5.0, 0.0)})
    state = reactor.run(b).state
    shown, true = reactor.MODEL.shown_and_true(state, b.parameters, b.severity, b.onset_s, 50.0)
    assert shown["T1"] - true["T1"] == pytest.approx(5.0)
    assert shown["T2"] - true["T2"] == pytest.approx(0.2)
    assert shown["F1"] / true["F1"] == pytest.approx(1.01)
    assert shown["L1"] == pytest.approx(true["L1"])


def test_a_vessel_is_never_estimated_or_corrected_below_empty() -> None:
    read = dict(reactor.MODEL.readings(reactor.run(reactor.batch(1500)).state[0], reactor.inputs()))
    read["L1"] = -0.02
    x = reactor.MODEL.estimate(read)
    assert x[S.V] == 0.0 and x[S.L1] == -0.02
    states = np.stack([x, x])
    reactor.MODEL.correct(states, {"T1": np.zeros(2), "L1": np.array([-1.0, 1.0])})
    assert states[:, S.V].tolist() == [0.0, 1.0]


def test_deviations_are_those_that_the_loops_see() -> None:
    """A transmitter that reads high makes the loop see no deviation where there is one; scoring looks at T1 itself."""
    b = reactor.batch(3000, p=reactor.parameters(bias_T1=0.5))
    truth = reactor.MODEL.truth(reactor.run(b).record, b.inputs)
    assert truth["T1"][0, -1] - truth["T1_sp"][0, -1] == pytest.approx(-0.5, abs=1e-4)
    assert truth["T1_err"][0, -1] == pytest.approx(0.0, abs=1e-4)


def test_the_measured_temperatures_are_replayed() -> None:
    """As the transmitters read them: replayed, the model takes the calibration that it knows of away again."""
    p = reactor.parameters(bias_T2=0.3, bias_T3=-0.2, T_coolant=288.0)
    b = reactor.batch(30, p=p, x=reactor.run(reactor.batch(1500, p=p)).state[0], process=1.0)
    result = reactor.run(b)
    read = {n: np.array([reactor.MODEL.readings(row, b.inputs[0, 0])[n] for row in result.record[0]])
            for n in ("V1_cmd", "P1_cmd", "V2_cmd", "T2", "T3")}  # fmt: skip
    replay = reactor.MODEL.replay_inputs(read, b.inputs[0])
    assert np.array_equal(replay[:, U.T_feed_in], result.of("T2")) and np.array_equal(
        replay[:, U.T_coolant_in], result.of("T3")
    )
    again = reactor.run(replace(b, inputs=replay[None], parameters=reactor.parameters(bias_T2=0.3, bias_T3=-0.2)[None]))
    for name in ("T2_true", "T3_true"):
        np.testing.assert_allclose(again.of(name), result.of(name), atol=1e-12)


KEPT = {"product", "V1_travel", "P1_travel", "V2_travel", "XV1_travel", "phase"}
"""Counters, on which nothing acts; and the phase, which acts as NORMAL where it is none of the three."""


@pytest.mark.parametrize("name", reactor.MODEL.states)
def test_a_state_that_is_not_a_number_is_reported_or_gone_in_a_second(name: str) -> None:
    """Behind the engine's check at the door, which refuses every state that is not finite."""
    b = reactor.batch(20, x=reactor.run(reactor.batch(1500)).state[0], start_s=1500.0)
    b.state[0, reactor.MODEL.states.index(name)] = np.nan
    broken, out = np.full(1, np.nan), np.zeros((1, 20, len(S)))
    reactor.MODEL.kernel(
        0, 1, b.state, b.parameters, b.severity, b.onset_s, b.inputs, b.input_of, b.start_s,
        np.zeros(1, dtype=np.int64), 20, 1, b.seeds, b.process_noise, b.sensor_noise, np.arange(len(S)), out, broken,
    )  # fmt: skip
    if np.isnan(broken[0]):
        kept = {reactor.MODEL.states[i] for i in np.flatnonzero(np.isnan(out[0]).any(axis=0))}
        assert kept == ({name} if name in KEPT else set())
    else:
        assert broken[0] <= 1502.0
