"""What follows from a flowsheet is a process model as any other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from homeostat.process.batch import simulate
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.types import Vec
from tests.contracts.process_model import ProcessModelContract
from tests.process.blocks.sheets import FAULTS, SETPOINTS, STATED, commanded, composed, row, run, two_tanks


class TestTwoTanks(ProcessModelContract):
    """Two heated tanks, put together from blocks."""

    @pytest.fixture
    def model(self) -> ComposedModel:
        return composed(two_tanks(), STATED, FAULTS)

    @pytest.fixture
    def parameters(self, model: ComposedModel) -> Vec:
        return row(model, STATED)

    @pytest.fixture
    def inputs(self, model: ComposedModel) -> Vec:
        return commanded(model, **SETPOINTS)

    @pytest.fixture
    def settle_s(self) -> int:
        return 900

    @pytest.fixture
    def corrected(self) -> tuple[str, ...]:
        return "L1", "L2", "T1", "T2"

    def test_it_settles_where_its_balances_say(self, model: ComposedModel) -> None:
        """0.1 L/s leave the first tank by gravity where V = A (F / Kv)^2 = 20 L; 12.54 kW warm it by 30 K."""
        _, course = run(model, STATED, commanded(model, **SETPOINTS), 6000)
        assert course["B1_V"][-1] == pytest.approx(20.0, abs=1e-3)
        assert course["B2_V"][-1] == pytest.approx(20.0, abs=1e-3)
        assert course["H1_position"][-1] == pytest.approx(12.54 / 60.0, abs=1e-4)

    def test_energy_and_matter_are_kept(self, model: ComposedModel) -> None:
        result, course = run(model, STATED, commanded(model, **SETPOINTS), 400)
        del result
        feed, out = course["F1_true"], course["F2_true"]
        held = course["B1_V"] + course["B2_V"]
        gained = np.diff(held)
        # the feed is held within a second, what is drawn follows the level within it
        assert np.abs(gained - (feed[1:] - out[1:])).max() < 1e-6
        assert np.abs(np.diff(course["product"]) - out[1:]).max() < 1e-6

    def test_compiled_and_plain_agree(self, model: ComposedModel, monkeypatch: pytest.MonkeyPatch) -> None:
        inputs = commanded(model, **SETPOINTS)
        fast, _ = run(model, STATED, inputs, 60, {"P1_weak": 0.3}, noise=1.0)
        monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
        plain, _ = run(composed(two_tanks(), STATED, FAULTS), STATED, inputs, 60, {"P1_weak": 0.3}, noise=1.0)
        np.testing.assert_allclose(fast.record, plain.record, rtol=1e-12, atol=1e-12)

    def test_a_weak_pump_must_run_faster_for_the_same_flow(self, model: ComposedModel) -> None:
        inputs = commanded(model, **SETPOINTS)
        _, sound = run(model, STATED, inputs, 3000)
        _, weak = run(model, STATED, inputs, 3000, {"P1_weak": 0.4})
        assert weak["F2_true"][-1] == pytest.approx(sound["F2_true"][-1], rel=1e-3)
        assert weak["P1_position"][-1] == pytest.approx(sound["P1_position"][-1] / 0.6, rel=1e-3)

    @pytest.mark.parametrize(("fault", "position"), [("V1_stuck_open", 0.3), ("V1_stuck_closed", 0.7)])
    def test_a_stuck_valve_stays_whatever_it_is_told(self, model: ComposedModel, fault: str, position: float) -> None:
        _, course = run(model, STATED, commanded(model, **SETPOINTS), 30, {fault: 0.3})
        assert course["V1_position"][-1] == pytest.approx(position)
        assert course["V1_cmd"][-1] == pytest.approx(1.0 if fault == "V1_stuck_open" else 0.0, abs=0.3)

    def test_a_leak_takes_its_share_of_the_volume(self, model: ComposedModel) -> None:
        shut = commanded(model, **SETPOINTS, V1_man=0.0)
        _, course = run(model, {**STATED, "Kv_12": 0.0}, shut, 100, {"B1_leak": 0.01})
        assert course["B1_V"][-1] == pytest.approx(20.0 * np.exp(-1.0), rel=1e-3)

    def test_a_fault_that_no_table_has_is_no_column(self) -> None:
        model = composed(two_tanks(), STATED, ["P1_weak"])
        assert model.faults == ("P1_weak",)

    def test_the_state_is_found_again_from_readings(self, model: ComposedModel) -> None:
        inputs = commanded(model, **SETPOINTS)
        result, _ = run(model, STATED, inputs, 900)
        found = model.estimate(model.readings(result.state[0], inputs))
        for name in ("B1_V", "B2_V", "B1_T", "B2_T", "V1_position", "P1_position", "H1_position"):
            at = model.states.index(name)
            assert found[at] == pytest.approx(result.state[0, at], rel=1e-4), name

    def test_a_tank_that_runs_empty_while_it_is_fed_stays_a_tank(self, model: ComposedModel) -> None:
        """The pump takes what comes, and the tank is as warm as its feed."""
        stated = {**STATED, "Kv_12": 5.0}
        _, course = run(model, stated, commanded(model, **SETPOINTS), 2000)
        assert 0.0 <= course["B1_V"].min() < 0.5
        assert np.abs(course["B1_T"] - 300.0).max() < 1e-6 and course["F2_true"][-1] == pytest.approx(0.1, abs=1e-3)

    def test_noise_is_that_of_the_tables(self, model: ComposedModel) -> None:
        _, course = run(model, STATED, commanded(model, **SETPOINTS), 2000, noise=1.0)
        off = course["L2"] - course["L2_true"]
        assert abs(np.std(off) - 0.01) < 0.001 and abs(np.mean(off)) < 0.001
        share = course["F1"] / course["F1_true"] - 1.0
        assert abs(np.std(share[200:]) - 0.01) < 0.001

    def test_members_do_not_know_of_each_other(self, model: ComposedModel) -> None:
        parameters, inputs = row(model, STATED), commanded(model, **SETPOINTS)
        several = self.batch(model, parameters, inputs, 50, members=3, noise=1.0)
        alone = self.batch(model, parameters, inputs, 50, members=1, noise=1.0)
        together = simulate(model.kernel, several).record[1]
        apart = simulate(model.kernel, replace(alone, seeds=several.seeds[1:2])).record[0]
        np.testing.assert_array_equal(together, apart)
