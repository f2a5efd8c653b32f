"""The Mixing Module as a process model: the contract, and what is its own."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from homeostat.plants.mixing_module.layout import P, S
from homeostat.plants.mixing_module.process import MixingModel
from homeostat.process.batch import Batch, simulate
from homeostat.process.model import ProcessModel
from homeostat.process.types import Vec
from tests.contracts.process_model import SECONDS, ProcessModelContract
from tests.plants.mixing_module import module
from tests.plants.mixing_module.module import MODEL, batch, run, start

CORRECTED = tomllib.loads((module.TABLES.parent / "case.toml").read_text(encoding="utf-8"))["twin"]["corrected"]
KPA_PER_M = 998.0 * 9.80665 / 1000.0
HIDDEN = {"delivered", "spilled", "overflowed"}
"""Bound to tags for scoring alone: no instrument shows them, so that a reading is NaN."""
TANKS = ("B201", "B202", "B203", "B204")


class TestMixingModule(ProcessModelContract):
    """The module has no controllers, and the twin corrects it by pressures; some clauses say that in its own way."""

    @pytest.fixture
    def model(self) -> MixingModel:
        return MixingModel()

    @pytest.fixture
    def parameters(self) -> Vec:
        return module.parameters()

    @pytest.fixture
    def inputs(self) -> Vec:
        """Every valve and pump at a place where each fault moves it."""
        return module.inputs(VI1=0.7, VI2=0.7, VI3=0.7, VO1=0.7, VO2=0.7, VO3=0.7, VI4=0.7, VO4=0.7, P1=0.8, P2=0.95)

    @pytest.fixture
    def settle_s(self) -> int:
        return 40

    @pytest.fixture
    def corrected(self) -> tuple[str, ...]:
        return tuple(CORRECTED)

    def test_the_start_is_readable_and_every_value_finite_but_automatic_outputs(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        _, result = self.settled(model, parameters, inputs, settle_s, noise=1.0)
        for state in (model.initial_state(parameters), *result.record[0]):
            read = model.readings(state, inputs)
            assert {n for n, v in read.items() if not np.isfinite(v)} == HIDDEN
            assert set(model.variables) == set(read) and set(model.inputs) <= set(read)
            assert all(type(v) is float for v in read.values())

    def test_readings_without_noise_and_calibration_errors_are_the_truth(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        what, result = self.settled(model, parameters, inputs, settle_s)
        truth = model.truth(result.record, what.inputs)
        for name, read in self.readings(model, result.record[0], inputs).items():
            if name not in HIDDEN:
                np.testing.assert_allclose(truth[name][0], read, rtol=1e-12, atol=1e-12, err_msg=name)

    def test_an_estimate_shows_the_readings_that_it_was_made_from(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        """And stands where the hydrostatic pressures say: a level transmitter may lie."""
        _, result = self.settled(model, parameters, inputs, settle_s, noise=1.0)
        read = dict(model.readings(result.state[0], inputs)) | {"L_B202": 0.9}
        estimate = model.estimate(read)
        assert estimate.shape == (len(model.states),) and np.isfinite(estimate).all()
        assert model.readings(estimate, inputs) == pytest.approx(read, rel=1e-12, abs=1e-12, nan_ok=True)
        for i, tank in enumerate(TANKS):
            assert estimate[S.L1 + i] == pytest.approx(read[f"P_{tank}"] / KPA_PER_M, abs=1e-12)
            assert estimate[S.V1 + i] == pytest.approx(14.31355 * estimate[S.L1 + i], abs=1e-12)

    def test_a_correction_moves_the_truth_by_the_residual(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int, corrected: tuple[str, ...]
    ) -> None:
        """1 kPa is 0.102 m; a tank is never corrected below empty."""
        _, result = self.settled(model, parameters, inputs, settle_s, members=4)
        states = result.state.copy()
        assert corrected == tuple(f"P_{tank}" for tank in TANKS)
        model.correct(states, {name: np.array([0.25, -0.01, 0.0, -50.0]) for name in corrected})
        for i in range(4):
            moved = states[:, S.L1 + i] - result.state[:, S.L1 + i]
            assert moved[:3] == pytest.approx(np.array([0.25, -0.01, 0.0]) / KPA_PER_M, abs=1e-12)
            assert states[3, S.L1 + i] == states[3, S.V1 + i] == 0.0
            assert states[:, S.V1 + i] == pytest.approx(14.31355 * states[:, S.L1 + i], abs=1e-12)
        assert states[2] == pytest.approx(result.state[2], abs=1e-15)

    def test_control_resumes_without_a_bump(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        """There are no controllers: what the instruments show is set, and totals begin at nothing."""
        what, result = self.settled(model, parameters, inputs, settle_s, noise=1.0)
        now = model.readings(result.state[0], inputs)
        states = np.tile(model.estimate(now), (1, 1))
        model.resume(states, {v: np.array([0.0, now[v]]) for v in now}, what.parameters)
        assert model.readings(states[0], inputs) == pytest.approx(now, nan_ok=True)
        assert not states[0, S.supplied :].any()
        going = simulate(model.kernel, replace(what, state=states, start_s=float(settle_s + SECONDS), steps=1))
        assert going.state[0, S.idle1] == now["idle_P101"] == 0.0


def test_layout_and_tables_have_the_same_names() -> None:
    assert set(module.NOMINAL) == set(P._fields)
    assert {r["id"] for r in module.rows("faults")} == set(module.FAULTS)
    assert {r["variable"] for r in module.rows("signals")} <= set(MODEL.variables)


ODD = {"leakage_main": (0.4, 50.0), "sensor_drift_B202": (0.001, 20.0), "clogging_common": (0.4, 80.0)}


def crowd(steps: int = 120) -> Batch:
    """Five members that differ in everything: inputs, levels, faults, parameters, seeds, and where noise is."""
    routes = [{"VO1": 1.0, "P1": 0.9}, {"VO2": 1.0, "P2": 0.9}, {"VI1": 1.0, "VO4": 1.0}]
    u = np.stack([np.tile(module.inputs(VI4=1.0, **r), (steps, 1)) for r in routes])
    what = batch(steps, members=5, process=1.0, sensor=1.0)
    severity, onset = what.severity.copy(), what.onset_s.copy()
    for member, (fault, (size, at)) in enumerate(ODD.items()):
        severity[member, module.FAULTS.index(fault)], onset[member, module.FAULTS.index(fault)] = size, at
    p = np.stack([module.parameters(k_tank=20.0 + m, tau_pump=1.0 + 0.1 * m) for m in range(5)])
    x = np.stack([start(B201=0.2 - 0.02 * m, B202=0.1 + 0.02 * m) for m in range(5)])
    return replace(
        what, state=x, parameters=p, severity=severity, onset_s=onset, inputs=u,
        input_of=np.array([0, 1, 2, 0, 1]), sensor_noise=np.array([1.0, 0.0, 1.0, 1.0, 0.0]),
    )  # fmt: skip


def one_of(what: Batch, member: int) -> Batch:
    """A member by itself."""
    own = slice(member, member + 1)
    return replace(
        what, state=what.state[own], parameters=what.parameters[own], severity=what.severity[own],
        onset_s=what.onset_s[own], input_of=what.input_of[own], seeds=what.seeds[own],
        process_noise=what.process_noise[own], sensor_noise=what.sensor_noise[own],
    )  # fmt: skip


@pytest.mark.parametrize("member", range(5))
def test_a_member_alone_is_bit_for_bit_the_same_member_among_others(member: int) -> None:
    what = crowd()
    together = simulate(MODEL.kernel, what)
    alone = simulate(MODEL.kernel, one_of(what, member))
    assert alone.record[0].tobytes() == together.record[member].tobytes()


def test_the_order_of_the_members_does_not_matter() -> None:
    what, order = crowd(), np.array([3, 0, 4, 2, 1])
    shuffled = replace(
        what, state=what.state[order], parameters=what.parameters[order], severity=what.severity[order],
        onset_s=what.onset_s[order], input_of=what.input_of[order], seeds=what.seeds[order],
        process_noise=what.process_noise[order], sensor_noise=what.sensor_noise[order],
    )  # fmt: skip
    together, mixed = simulate(MODEL.kernel, what), simulate(MODEL.kernel, shuffled)
    assert mixed.record.tobytes() == together.record[order].tobytes()


def test_the_same_seed_gives_the_same_bits_and_another_one_others() -> None:
    line = module.inputs(VO1=1.0, VI4=1.0, P1=0.9)
    one, again, other = (
        run(batch(60, u=line, x=start(B201=0.2), process=1.0, sensor=1.0, first_seed=s)) for s in (5, 5, 6)
    )
    assert one.record.tobytes() == again.record.tobytes() != other.record.tobytes()


def test_a_run_in_two_parts_agrees_with_one_run_to_a_billionth() -> None:
    """As a sequence is simulated second by second and the plant in one go."""
    line = module.inputs(VI1=0.5, VO1=1.0, VO2=1.0, VI4=1.0, P1=0.9)
    whole = run(batch(60, u=line, x=start(B201=0.2, B202=0.1), process=1.0, sensor=1.0))
    state = start(B201=0.2, B202=0.1)
    for k in range(60):
        state = run(batch(1, u=line, x=state, start_s=float(k), process=1.0, sensor=1.0)).state[0]
    assert state == pytest.approx(whole.state[0], rel=0.0, abs=1e-8)


def test_what_is_shown_and_what_is_true_differ_by_faults_and_calibration() -> None:
    p = module.parameters(bias_LT1=0.01, bias_FT=0.02)
    line = module.inputs(VO1=1.0, VI4=1.0, P1=0.9)
    what = batch(20, p=p, x=start(B201=0.2), u=line, faults={"sensor_bias_B204": (0.05, 0.0)})
    state = run(what).state
    shown, true = MODEL.shown_and_true(state, what.parameters, what.severity, what.onset_s, 20.0)
    assert shown["L_B201"] - true["L_B201"] == pytest.approx(0.01)
    assert shown["L_B204"] - true["L_B204"] == pytest.approx(0.05)
    assert shown["flow"] / true["flow"] == pytest.approx(1.02)
