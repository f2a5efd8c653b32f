"""Lost members: an explanation with which the model leaves the physical world costs the others nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from homeostat.domain.diagnosis import Effect, EffectKind, FaultState
from homeostat.process.batch import Batch, ProcessError, simulate
from homeostat.process.model import column
from homeostat.process.types import Vec
from homeostat.twin import shared_prefix
from homeostat.twin.carried import Carrier, FaultSet
from homeostat.twin.isolation import evidence as evidence_module
from homeostat.twin.isolation.evidence import Accuracy, Evidence
from homeostat.twin.isolation.responses import Responses
from homeostat.twin.shared_prefix import simulate_with_prefix
from tests.twin.followed import follow, reactor, readings

END_S = 1500
SIZE = 300.0
"""Multiple of a large change of a reaction's rate, with which the model goes where there is no plant [1]."""


def evidence() -> Evidence:
    plant = reactor()
    twin = follow(readings(4, END_S), 4)
    accuracy = Accuracy(plant.twin.errors, plant.twin.gain_error)
    carrier = Carrier(plant.model, plant.description)
    return Evidence(plant.model, carrier, twin._history.window(400), twin._posterior, accuracy)


def sets(seen: Evidence) -> tuple[list[FaultSet], list[FaultSet]]:
    """Explanations that a plant can have, and such that none can."""
    rate = "unknown_R1_k0_A"
    large = seen.carrier.modes[rate].severity_nominal
    good: list[FaultSet] = [(), (FaultState("temp_bias", 2.0, 1300.0),), (FaultState(rate, 0.1 * large, 1300.0),)]
    bad: list[FaultSet] = [(FaultState(rate, SIZE * large, at_s),) for at_s in (1122.0, 1250.0, 1400.0)]
    return good, bad


def test_what_cannot_be_is_found_in_one_replay_of_all(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = evidence()
    good, bad = sets(seen)
    alone = seen.likelihoods(good)
    calls, replay = [], evidence_module.replay
    monkeypatch.setattr(evidence_module, "replay", lambda *a, **k: calls.append(a) or replay(*a, **k))
    mixed = [bad[0], good[0], bad[1], good[1], good[2], bad[2]]
    found = seen.likelihoods(mixed)
    assert len(calls) == 1
    assert np.isneginf(found[[0, 2, 5]]).all()
    assert found[[1, 3, 4]] == pytest.approx(alone, rel=1e-12)
    assert np.isneginf(seen.likelihoods(bad)).all()
    with pytest.raises(ProcessError, match="member 0 left the physical world"):
        seen.residuals(mixed)


def test_what_does_not_even_begin_as_a_plant_costs_the_others_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = evidence()
    good, bad = sets(seen)
    before: FaultSet = (replace(bad[0][0], onset_s=seen.window.start_s - 100.0, severity=1e9 * bad[0][0].severity),)
    with pytest.raises(ProcessError):
        seen.residuals([before])
    found = seen.likelihoods([good[0], before, good[1]])
    assert np.isneginf(found[1]) and found[[0, 2]] == pytest.approx(seen.likelihoods(good[:2]), rel=1e-12)


def crowd(steps: int = 80) -> Batch:
    """Four members with a fault at other times, of which the last two do not last until then."""
    plant = reactor()
    model, parameters = plant.model, np.tile(plant.true_parameters(1), (4, 1))
    states = np.tile(model.initial_state(parameters[0]), (4, 1))
    parameters[2:, column(model.parameters, "k0_A")] = 1e60
    severity, onset_s = np.zeros((4, len(model.faults))), np.full((4, len(model.faults)), np.inf)
    severity[:, 0], onset_s[:, 0] = 0.1, (40.0, 60.0, 50.0, 70.0)
    none = np.zeros(4)
    return Batch(
        states, parameters, severity, onset_s, np.tile(plant.start, (1, steps, 1)), np.zeros(4, dtype=np.int64), 0.0,
        steps, 1, tuple(range(len(model.states))), np.zeros(4, dtype=np.int64), none, none,
    )  # fmt: skip


def test_a_beginning_that_is_shared_and_breaks_down_takes_nobody_else_with_it() -> None:
    batch, model = crowd(), reactor().model
    shared = simulate_with_prefix(model.kernel, batch, "state {}".format, refuse=False)
    plain = simulate(model.kernel, batch, refuse=False)
    assert np.array_equal(shared.record, plain.record, equal_nan=True)
    assert np.isfinite(shared.state[:2]).all() and np.isnan(shared.state[2:]).all()
    with pytest.raises(ProcessError, match="left the physical world"):
        simulate_with_prefix(model.kernel, batch, "state {}".format)
    assert len(shared_prefix._families(batch, shared_prefix._without_newest(batch, 1.0))) == 2


def test_the_state_in_which_a_window_begins_is_worked_out_once() -> None:
    window, asked = evidence().window, list[Mapping[str, float]]()

    def estimate(of: Mapping[str, float]) -> Vec:
        asked.append(of)
        return np.array([float(len(asked))])

    fresh = replace(window)
    first, state = fresh.begun(estimate)
    assert fresh.begun(estimate) == (first, state) and len(asked) == 1
    assert dict(first) == pytest.approx(window.beginning, nan_ok=True)
    other = replace(fresh, unseen={"CA": 0.5})
    assert other.begun(estimate)[1] == [2.0] and asked[-1]["CA"] == 0.5  # what is known of another is another state
    assert fresh.begun(lambda of: np.array([9.0]))[1] == [9.0]  # another model has its own


@pytest.mark.parametrize("length", [60, 90, 200, 400])
@pytest.mark.parametrize(
    ("kind", "quantity"),
    [(EffectKind.PARAMETER, "UA"), (EffectKind.BALANCE, "T"), (EffectKind.READING, "T1")],
)
def test_responses_that_are_there_are_not_simulated_again(length: int, kind: EffectKind, quantity: str) -> None:
    seen = evidence()
    short = seen.on(seen.window.part(seen.window.length - length, seen.window.length))
    responses, effect = Responses(short, ()), Effect(kind, quantity, 1.0)
    found = responses.of_newest(effect, responses.steps(effect))
    assert found == pytest.approx(responses.steps(effect, responses.newest), rel=1e-9, abs=1e-9)
