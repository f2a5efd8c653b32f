"""What every process model must do. A test class inherits this and says which model, parameters and inputs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from homeostat.process.batch import Batch, BatchResult, simulate
from homeostat.process.model import ProcessModel
from homeostat.process.types import Table, Vec
from homeostat.twin.shared_prefix import simulate_with_prefix

SECONDS = 120


class ProcessModelContract:
    """Inherit, and provide the fixtures ``model``, ``parameters``, ``inputs`` (at the start) and ``settle_s``.

    ``settle_s``: process time [s] after which the plant runs normally.
    """

    def batch(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, steps: int, members: int = 1, noise: float = 0.0
    ) -> Batch:
        """Members that start where the plant starts."""
        none = np.zeros((members, len(model.faults)))
        return Batch(
            state=np.tile(model.initial_state(parameters), (members, 1)),
            parameters=np.tile(parameters, (members, 1)),
            severity=none, onset_s=np.full_like(none, np.inf),
            inputs=np.tile(inputs, (1, steps, 1)), input_of=np.zeros(members, dtype=np.int64), start_s=0.0,
            steps=steps, stride=1, record=tuple(range(len(model.states))),
            seeds=np.arange(members, dtype=np.int64) + 5,
            process_noise=np.full(members, noise), sensor_noise=np.full(members, noise),
        )  # fmt: skip

    def settled(
        self,
        model: ProcessModel,
        parameters: Vec,
        inputs: Vec,
        settle_s: int,
        noise: float = 0.0,
        members: int = 1,
    ) -> tuple[Batch, BatchResult]:
        """A run of ``SECONDS`` from normal operation on."""
        first = self.batch(model, parameters, inputs, settle_s, members, noise)
        more = replace(
            self.batch(model, parameters, inputs, SECONDS, members, noise),
            state=simulate(model.kernel, first).state,
            start_s=float(settle_s),
        )
        return more, simulate(model.kernel, more)

    def readings(self, model: ProcessModel, rows: Table, inputs: Vec) -> dict[str, Vec]:
        """Variable -> readings over time."""
        each = [model.readings(row, inputs) for row in rows]
        return {name: np.array([r[name] for r in each]) for name in each[0]}

    # Names and shapes.

    def test_names_are_unique(self, model: ProcessModel) -> None:
        for names in (model.states, model.parameters, model.inputs, model.faults):
            assert names and len(set(names)) == len(names)

    def test_the_initial_state_is_finite_and_its_own(self, model: ProcessModel, parameters: Vec) -> None:
        before = parameters.tobytes()
        first, second = model.initial_state(parameters), model.initial_state(parameters)
        assert first.shape == (len(model.states),) and np.isfinite(first).all()
        first[:] = -1.0
        assert second.tobytes() == model.initial_state(parameters).tobytes() and parameters.tobytes() == before

    def test_the_start_is_readable_and_every_value_finite_but_automatic_outputs(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        _, result = self.settled(model, parameters, inputs, settle_s, noise=1.0)
        automatic = {n for n, v in zip(model.inputs, inputs, strict=True) if math.isnan(v)}
        for state in (model.initial_state(parameters), *result.record[0]):
            read = model.readings(state, inputs)
            assert {n for n, v in read.items() if not math.isfinite(v)} == automatic
            assert set(model.inputs) <= set(read)
            assert all(type(v) is float for v in read.values())

    def test_reading_changes_nothing(self, model: ProcessModel, parameters: Vec, inputs: Vec) -> None:
        state = model.initial_state(parameters)
        before = state.tobytes(), inputs.tobytes()
        model.readings(state, inputs)
        assert before == (state.tobytes(), inputs.tobytes())

    def test_a_manual_output_has_the_command_that_it_replaces(
        self, model: ProcessModel, parameters: Vec, inputs: Vec
    ) -> None:
        read = model.readings(model.initial_state(parameters), inputs)
        for name in model.inputs:
            if name.endswith("_man"):
                assert name.replace("_man", "_cmd") in read

    # Truth.

    def test_truth_has_the_shape_of_the_record_and_every_variable_that_can_be_read(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        what, result = self.settled(model, parameters, inputs, settle_s, members=3, noise=1.0)
        record = result.record.tobytes()
        truth = model.truth(result.record, np.repeat(what.inputs, 3, axis=0))
        assert set(model.readings(result.state[0], inputs)) <= set(truth)
        assert {v.shape for v in truth.values()} == {(3, SECONDS)}
        assert result.record.tobytes() == record

    def test_readings_without_noise_and_calibration_errors_are_the_truth(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        """Travel counts from the first sample on in truth, from the start of the plant in readings."""
        what, result = self.settled(model, parameters, inputs, settle_s)
        truth = model.truth(result.record, what.inputs)
        for name, read in self.readings(model, result.record[0], inputs).items():
            offset = read[0] if name.endswith("_travel") else 0.0
            np.testing.assert_allclose(truth[name][0], read - offset, rtol=1e-12, atol=1e-12, err_msg=name)

    def test_noise_moves_readings_and_never_what_they_would_be_scored_by(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        """The same state read with other noise has the same truth."""
        what, _ = self.settled(model, parameters, inputs, settle_s)
        one = simulate(model.kernel, replace(what, steps=1, sensor_noise=np.ones(1)))
        two = simulate(model.kernel, replace(what, steps=1, sensor_noise=np.ones(1), seeds=what.seeds + 1))
        at = what.inputs[:, :1]
        a, b = (model.truth(r.record, at) for r in (one, two))
        changed = {n for n in a if not np.array_equal(a[n], b[n], equal_nan=True)}
        assert changed == set()
        read = [model.readings(r.state[0], inputs) for r in (one, two)]
        assert any(read[0][n] != read[1][n] for n in read[0])

    def test_shown_and_true_agree_without_calibration_errors_and_faults(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        what, result = self.settled(model, parameters, inputs, settle_s, members=2, noise=1.0)
        before = result.state.tobytes()
        shown, true = model.shown_and_true(result.state, what.parameters, what.severity, what.onset_s, 1.0)
        assert shown.keys() == true.keys() and shown
        for name in shown:
            assert shown[name].shape == true[name].shape == (2,)
            np.testing.assert_allclose(shown[name], true[name], rtol=1e-12, err_msg=name)
        assert result.state.tobytes() == before

    # What the twin does with it.

    def test_an_estimate_shows_the_readings_that_it_was_made_from(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        _, result = self.settled(model, parameters, inputs, settle_s, noise=1.0)
        read = model.readings(result.state[0], inputs)
        estimate = model.estimate(read)
        assert estimate.shape == (len(model.states),) and np.isfinite(estimate).all()
        again = model.readings(estimate, inputs)
        for name, value in read.items():
            assert again[name] == pytest.approx(value, rel=1e-12, abs=1e-12, nan_ok=True), name

    def test_an_estimate_has_what_no_instrument_shows_where_it_was_followed_to(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int, corrected: tuple[str, ...]
    ) -> None:
        _, result = self.settled(model, parameters, inputs, settle_s)
        read = {**model.readings(result.state[0], inputs)}
        shown = model.estimate(read)
        for name in model.unseen:
            assert name in model.states and name not in model.variables
            moved = shown[model.states.index(name)] + 0.01
            found = model.estimate({**read, name: moved})
            told = name.endswith("_integral")  # what the command of a loop tells goes before
            assert told or found[model.states.index(name)] == pytest.approx(moved, rel=1e-6)
            others = [model.shown[v] for v in corrected]
            np.testing.assert_allclose(found[others], shown[others], rtol=1e-6, atol=1e-9)

    def test_an_estimate_can_be_simulated(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        """Also one from readings that noise pushed beyond what can be."""
        what, result = self.settled(model, parameters, inputs, settle_s, noise=1.0)
        read: Mapping[str, float] = model.readings(result.state[0], inputs)
        pushed = {n: v - 1e-3 if n.endswith(("_zt", "1")) and n not in model.inputs else v for n, v in read.items()}
        for readings in (read, pushed):
            start = np.tile(model.estimate(readings), (1, 1))
            assert np.isfinite(simulate(model.kernel, replace(what, state=start)).record).all()

    def test_a_correction_moves_the_truth_by_the_residual(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int, corrected: tuple[str, ...]
    ) -> None:
        what, result = self.settled(model, parameters, inputs, settle_s, members=3)
        before = model.truth(result.state[:, None], what.inputs[:, :1])
        states = result.state.copy()
        residuals = {name: np.array([0.25, -0.5, 0.0]) for name in corrected}
        model.correct(states, residuals)
        after = model.truth(states[:, None], what.inputs[:, :1])
        for name in corrected:
            np.testing.assert_allclose(after[name][:, 0] - before[name][:, 0], residuals[name], atol=1e-12)
        assert np.array_equal(states[2], result.state[2])

    def test_control_resumes_without_a_bump(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        """From a state that knows the readings alone, the next commands are those of the plant that ran on."""
        what, result = self.settled(model, parameters, inputs, settle_s, noise=1.0)
        row = SECONDS // 2
        before, now = (model.readings(result.record[0, row - k], inputs) for k in (1, 0))
        states = np.tile(model.estimate(now), (1, 1))
        model.resume(states, {v: np.array([before[v], now[v]]) for v in now}, what.parameters)
        start_s = settle_s + row + 1.0
        going = simulate(model.kernel, replace(what, state=states, start_s=start_s, steps=1))
        expected = model.readings(result.record[0, row + 1], inputs)
        resumed = model.readings(going.state[0], inputs)
        commands = [n for n in resumed if n.endswith("_cmd") and n not in model.inputs]
        assert commands
        for name in commands:
            assert resumed[name] == pytest.approx(expected[name], abs=1e-9), name

    def test_replayed_inputs_make_the_model_repeat_recorded_commands(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        what, result = self.settled(model, parameters, inputs, settle_s, noise=1.0)
        read = self.readings(model, result.record[0], inputs)
        recorded = what.inputs[0]
        before = recorded.tobytes()
        replayed = model.replay_inputs(read, recorded)
        assert replayed.shape == recorded.shape and recorded.tobytes() == before
        quiet = replace(what, inputs=replayed[None], process_noise=np.zeros(1), sensor_noise=np.zeros(1))
        again = self.readings(model, simulate(model.kernel, quiet).record[0], inputs)
        for name in read:
            if name.endswith("_cmd") and name not in model.inputs:
                np.testing.assert_array_equal(again[name], read[name], err_msg=name)

    # The kernel.

    def test_the_same_again(self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int) -> None:
        """Bit for bit; a member in a crowd, and a run in two parts, too."""
        what, result = self.settled(model, parameters, inputs, settle_s, members=4, noise=1.0)
        assert simulate(model.kernel, what).record.tobytes() == result.record.tobytes()
        crowd = len({row.tobytes() for row in result.record})
        assert crowd == 4, "four seeds must give four runs"
        half = SECONDS // 2
        first = simulate(model.kernel, replace(what, steps=half))
        rest = replace(what, state=first.state, start_s=what.start_s + half, steps=SECONDS - half)
        assert simulate(model.kernel, rest).state.tobytes() == result.state.tobytes()

    def test_what_members_share_before_a_fault_is_simulated_once_to_the_bit(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        """Every fault at two sizes and onsets, before, at and after the start; one pair; a fault-free member."""
        what, _ = self.settled(model, parameters, inputs, settle_s, members=5 * len(model.faults))
        severity, onset = what.severity.copy(), what.onset_s.copy()
        for m, lag in enumerate(np.tile([-3.0, 0.0, 1.0, 60.5, SECONDS + 7.0], len(model.faults))):
            severity[m, m // 5], onset[m, m // 5] = 0.3 + 0.01 * lag / SECONDS, settle_s + lag
        severity[::7, 0], onset[::7, 0] = 0.2, settle_s + 20.0
        severity[-1] = 0.0
        onset[-1] = np.inf
        several = replace(what, severity=severity, onset_s=onset, record=(3, 0, len(model.states) - 1))
        names = model.states.__getitem__
        plain, shared = (f(model.kernel, several, names) for f in (simulate, simulate_with_prefix))
        assert shared.record.tobytes() == plain.record.tobytes() and shared.state.tobytes() == plain.state.tobytes()

    def test_every_fault_acts_from_its_onset_on(
        self, model: ProcessModel, parameters: Vec, inputs: Vec, settle_s: int
    ) -> None:
        what, healthy = self.settled(model, parameters, inputs, settle_s)
        for column in range(len(model.faults)):
            severity, onset = what.severity.copy(), what.onset_s.copy()
            severity[0, column], onset[0, column] = 0.5, settle_s + 60.0
            faulty = simulate(model.kernel, replace(what, severity=severity, onset_s=onset)).record[0]
            assert faulty[:59].tobytes() == healthy.record[0, :59].tobytes(), model.faults[column]
            assert faulty[60:].tobytes() != healthy.record[0, 60:].tobytes(), model.faults[column]
