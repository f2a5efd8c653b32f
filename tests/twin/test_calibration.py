"""Calibration: what a healthy stretch teaches agrees with the truth as often as it claims."""

from __future__ import annotations

import functools
from copy import copy

import numpy as np
import pytest

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.recovery import ActionSet
from homeostat.plants.plant import Plant
from homeostat.twin.calibration import GoesWith, Posterior, Present, calibrate, prior
from homeostat.twin.carried import Carrier
from homeostat.twin.history import History, Window
from homeostat.twin.twin import Twin
from tests.twin.followed import HEALTHY_S, LEARN_S, follow, reactor, readings

SEEDS = range(8)


@functools.cache
def before() -> Posterior:
    plant = reactor()
    return prior(plant.model, plant.description.parameters)


@functools.cache
def after(seed: int) -> Posterior:
    plant = reactor()
    history = History(plant.description.variables, plant.model.inputs)
    for snapshot in readings(seed, HEALTHY_S):
        history.append(snapshot)
    return learned(plant, history.window(LEARN_S))


def learned(plant: Plant, window: Window) -> Posterior:
    """What a window without faults teaches."""
    nothing = Present((), Carrier(plant.model, plant.description).carry([()], window))
    return calibrate(plant.model, window, before(), [nothing], plant.twin.errors, plant.twin.initial)


def deviation(posterior: Posterior) -> np.ndarray:
    return np.sqrt((posterior.root**2).sum(axis=1))


UNCERTAIN = deviation(before()) > 0.0


def scores(seed: int) -> np.ndarray:
    """Truth minus expectation in posterior standard deviations, uncertain parameters only."""
    posterior = after(seed)
    return ((reactor().true_parameters(seed) - posterior.mean) / deviation(posterior).clip(1e-12))[UNCERTAIN]


def test_the_prior_is_what_the_tables_say() -> None:
    by_symbol = {p.symbol: p for p in reactor().description.parameters}
    names = reactor().model.parameters
    assert before().mean.tolist() == [by_symbol[name].value for name in names]
    assert deviation(before()) == pytest.approx([by_symbol[name].sd for name in names])


def test_the_truth_lies_where_the_posterior_says() -> None:
    """Under a correct posterior the scores are standard normal: 68 % within one deviation, 95 % within two."""
    z = np.concatenate([scores(seed) for seed in SEEDS])
    assert z.size > 200
    assert 0.55 <= np.mean(np.abs(z) < 1.0) <= 0.85
    assert np.mean(np.abs(z) < 2.0) >= 0.9 and np.abs(z).max() < 4.5
    assert 0.7 <= z.std() <= 1.3


def test_the_same_holds_for_what_was_really_learned() -> None:
    learned = [(scores(s), (deviation(after(s)) / deviation(before()).clip(1e-12))[UNCERTAIN] < 0.8) for s in SEEDS]
    z = np.concatenate([score[known] for score, known in learned])
    assert z.size >= 5 * len(SEEDS), "a healthy stretch says something about at least five parameters"
    assert np.mean(np.abs(z) < 2.0) >= 0.85


@pytest.mark.parametrize("symbol", ["bias_ZT1", "bias_ZTP", "bias_ZT2", "Cv_V1", "K_P1", "F3_max"])
def test_a_parameter_that_shows_is_found(symbol: str) -> None:
    """Over plants that differ, the estimate follows the truth far better than the tables do."""
    k = reactor().model.parameters.index(symbol)
    truth = np.array([reactor().true_parameters(seed)[k] for seed in SEEDS])
    found = np.array([after(seed).mean[k] for seed in SEEDS])
    table = before().mean[k]
    assert np.sqrt(np.mean((found - truth) ** 2)) < 0.6 * np.sqrt(np.mean((table - truth) ** 2))


def test_learning_never_makes_more_uncertain() -> None:
    for seed in SEEDS:
        assert (deviation(after(seed)) <= deviation(before()) * (1.0 + 1e-6) + 1e-12).all()
        assert (after(seed).mean[~UNCERTAIN] == before().mean[~UNCERTAIN]).all()


def test_draws_follow_the_posterior() -> None:
    posterior = after(0)
    draws = posterior.draws(4000, np.random.default_rng(1))
    assert draws.shape == (4000, len(reactor().model.parameters))
    assert (draws[0] == posterior.mean).all(), "the first draw is the expectation"
    spread = deviation(posterior)
    assert np.abs(draws.mean(axis=0) - posterior.mean)[UNCERTAIN] == pytest.approx(0.0, abs=float((spread * 0.1).max()))
    assert draws.std(axis=0)[UNCERTAIN] == pytest.approx(spread[UNCERTAIN], rel=0.1)
    assert (draws[:, ~UNCERTAIN] == posterior.mean[~UNCERTAIN]).all()
    assert (posterior.draws(5, np.random.default_rng(3)) == posterior.draws(5, np.random.default_rng(3))).all()


def test_a_stretch_that_is_too_short_to_compare_teaches_nothing() -> None:
    plant = reactor()
    history = History(plant.description.variables, plant.model.inputs)
    for snapshot in readings(0, HEALTHY_S)[-40:]:
        history.append(snapshot)
    same = learned(plant, history.window(40))
    assert same.mean == pytest.approx(before().mean)
    assert deviation(same) == pytest.approx(deviation(before()), rel=1e-6, abs=1e-9)


def test_a_twin_that_learned_predicts_better() -> None:
    """A quarter of an hour ahead, without action: the cooling command of the learned twin is nearer to the plant's."""
    idle, nothing = ActionSet((), "normal"), (Hypothesis((), 1.0),)
    wins = 0
    for seed in range(4):
        seen = readings(seed, HEALTHY_S + 900)
        truth = np.mean([s.values["V2.cmd"] for s in seen[HEALTHY_S:]])
        learned, fresh = (
            follow(seen[:HEALTHY_S], seed, learn).roll_out(idle, nothing).trajectory.signals["V2.cmd"].mean()
            for learn in (True, False)
        )
        wins += abs(learned - truth) < abs(fresh - truth)
    assert wins >= 3


# in a plant with a fault

STUCK = FaultState("cool_stuck_closed", 0.66, HEALTHY_S + 60.0)
"""A cooling valve that has closed by two thirds."""
END_S = HEALTHY_S + 900


def sized(severity: float, between: tuple[float, float] | None = (0.58, 0.72)) -> Hypothesis:
    return Hypothesis((FaultState(STUCK.fault, severity, STUCK.onset_s),), 0.5, between)


def predicted(twin: Twin, hypothesis: Hypothesis) -> float:
    """Mean temperature from five minutes ahead on if nobody acts [K]."""
    return float(twin.roll_out(ActionSet((), "normal"), (hypothesis,)).trajectory.signals["T1"][:, 60:].mean())


@functools.cache
def followed(seed: int) -> Twin:
    return follow(readings(seed, END_S, (STUCK,)), seed)


@pytest.mark.parametrize("seed", [0, 1])
def test_what_the_size_explains_is_not_learned_twice(seed: int) -> None:
    """What is read says where the temperature is. Whatever the size is taken for, that is what is predicted then."""
    few, many = sized(0.64), sized(0.68)
    sharp = copy(followed(seed))
    apart = predicted(sharp, many) - predicted(sharp, few)
    sharp.recalibrate(600, [few, many])
    now = np.mean([s.values["T1"] for s in readings(seed, END_S, (STUCK,))[-300:]])
    found = [predicted(sharp, each) for each in (few, many)]
    assert apart > 0.4 and abs(found[1] - found[0]) < apart / 2.0
    assert found == pytest.approx([now, now], abs=0.35)


def test_a_size_that_is_known_exactly_leaves_the_parameters_alone() -> None:
    sharp = copy(followed(0))
    sharp.recalibrate(600, [sized(0.66, None)])
    assert predicted(sharp, sized(0.70)) - predicted(sharp, sized(0.66)) > 0.2


def test_sharpening_again_and_again_makes_no_surer() -> None:
    """Ten looks at the same readings are one."""
    once, often = copy(followed(0)), copy(followed(0))
    once.recalibrate(600, [sized(0.66)])
    for _ in range(10):
        often.recalibrate(600, [sized(0.66)])
    assert predicted(often, sized(0.66)) == predicted(once, sized(0.66))


def test_parameters_go_with_a_size_in_proportion() -> None:
    goes = GoesWith("leak", 0.01, np.array([2.0, 0.0, -1.0]))
    assert goes.change([FaultState("leak", 0.03, 0.0)]) == pytest.approx([0.04, 0.0, -0.02])
    assert goes.change([FaultState("fouling", 0.5, 0.0)]) == pytest.approx([0.0, 0.0, 0.0])
    mean = np.zeros(3)
    assert Posterior(mean, np.eye(3), None, goes).change([FaultState("leak", 0.01, 0.0)]) == pytest.approx(mean)


@pytest.mark.parametrize(("severity", "between", "off"), [(0.5, (0.4, 0.6), 0.55), (0.98, (0.9, 1.0), 0.955)])
def test_a_size_is_off_to_where_there_is_room(severity: float, between: tuple[float, float], off: float) -> None:
    """By a quarter of what holds it with 95 %."""
    carrier = Carrier(reactor().model, reactor().description)
    ((fault,),) = carrier.off_by_one_sd(sized(severity, between))
    assert fault.severity == pytest.approx(off) and fault.onset_s == STUCK.onset_s
    assert carrier.off_by_one_sd(sized(severity, None)) == carrier.off_by_one_sd(sized(1.0, (1.0, 1.0))) == []
