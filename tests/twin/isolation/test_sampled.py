"""An analyser shows each sample for some time: that is no stuck instrument, and one that is stuck is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.snapshot import Snapshot
from homeostat.twin.calibration import Posterior
from homeostat.twin.carried import Carrier
from homeostat.twin.history import History, Window
from homeostat.twin.isolation.evidence import Accuracy, Evidence
from homeostat.twin.isolation.prechecks import What, flat_lines, noise_ratios
from tests.twin.followed import follow, reactor, readings

END_S = 1200
TAG = "T1"


def sampled(every: int) -> PlantDescription:
    """The reactor, with a thermometer that shows something new every so many seconds."""
    d = reactor().description
    rule = replace(d.qualities[TAG], every_s=float(every), frozen_s=3.0 * every, fastest=None)
    return replace(d, qualities={**d.qualities, TAG: rule})


def seen(every: int, stuck_s: float, last: int, known: bool = True) -> Window:
    """The last readings of one that is stuck from a time on; ``known``: its samples are."""
    d = sampled(every)
    history = History(d.variables, reactor().model.inputs, sampled=d.sampled if known else None)
    shown = 0.0
    for k, snapshot in enumerate(readings(5, END_S)):
        if k % every == 0 and snapshot.at_s < stuck_s:
            shown = snapshot.values[TAG]
        history.append(Snapshot(snapshot.at_s, {**snapshot.values, TAG: shown}))
    return history.window(last)


@settings(max_examples=10)
@given(st.integers(2, 90), st.integers(60, END_S))
def test_a_sound_one_is_never_stuck_nor_noisy(every: int, last: int) -> None:
    window = seen(every, END_S + 1.0, last)
    assert flat_lines(window, sampled(every)) == ()
    assert TAG not in {f.tag for f in noise_ratios(window, sampled(every), reactor().model)}


@settings(max_examples=10)
@given(st.integers(2, 90), st.integers(60, END_S))
def test_one_that_is_stuck_for_more_than_three_samples_is_found(every: int, last: int) -> None:
    stuck_s = END_S - 4.0 * every
    (found,) = flat_lines(seen(every, stuck_s, last), sampled(every))
    assert (found.tag, found.what, found.limit) == (TAG, What.FROZEN, 3.0 * every)
    assert stuck_s - every <= found.since_s <= stuck_s + 1.0


def test_one_that_is_stuck_for_less_is_not() -> None:
    assert flat_lines(seen(30, END_S - 60.0, 600), sampled(30)) == ()


@pytest.mark.parametrize("known", [True, False])
def test_it_was_lively_before_only_where_its_samples_are_counted(known: bool) -> None:
    """Of a window in which it is stuck throughout, what was before says that it is no coarse one."""
    window = seen(30, 900.0, 250, known)
    assert [f.tag for f in flat_lines(window, sampled(30))] == [TAG] * known


@given(st.integers(2, 90))
def test_readings_that_show_one_sample_count_as_one(every: int) -> None:
    plant, twin = reactor(), follow(readings(4, 900), 4)
    window, carrier = twin._history.window(400), Carrier(plant.model, plant.description)
    certain = Posterior(twin._posterior.mean, np.zeros((len(twin._posterior.mean), 0)))
    noise = Accuracy({"T1": (plant.twin.errors["T1"][0], 0.0)}, 0.0)
    shown = Evidence(plant.model, carrier, window, certain, noise)
    sampled_once = Evidence(plant.model, carrier, replace(window, per_sample={"T1": every}), certain, noise)
    wild = np.vstack([shown.residuals([()]), 100.0 * np.ones((1, 399))])
    assert sampled_once.losses(wild / np.sqrt(every)) == pytest.approx(shown.losses(wild) / every)
    lie = (FaultState("temp_bias", 4.0, 600.0),)
    apart, once = (np.ptp(each.likelihoods([(), lie])) for each in (shown, sampled_once))
    assert once == pytest.approx(apart / every)
    fit, seldom = shown.fit_of(lie), sampled_once.fit_of(lie)
    assert (seldom.mean_square, seldom.worst_block) == pytest.approx((fit.mean_square, fit.worst_block))
    assert seldom.unexplained == pytest.approx(fit.unexplained / every)


@pytest.mark.slow
@given(st.integers(2, 90))
def test_a_constant_error_is_as_large_of_an_analyser_as_of_anything_else(every: int) -> None:
    plant, twin = reactor(), follow(readings(4, 900), 4)
    window, carrier = twin._history.window(400), Carrier(plant.model, plant.description)
    certain = Posterior(twin._posterior.mean, np.zeros((len(twin._posterior.mean), 0)))
    noise, error = 0.5, 0.1
    seldom = replace(window, per_sample={"T1": every})
    evidence = Evidence(plant.model, carrier, seldom, certain, Accuracy({"T1": (noise, error)}, 0.0))
    off = evidence.whiten(np.full((1, 399, 1), error))  # one standard deviation of it
    count = 399 / every * (error / noise) ** 2  # what the samples would have against it, were it none
    assert evidence.losses(off)[0] == pytest.approx(count / (1.0 + count), rel=0.05)


def test_a_history_says_which_readings_show_one_sample_also_of_parts_of_them() -> None:
    window = seen(30, END_S + 1.0, 600)
    assert window.per_sample == window.part(10, 90).per_sample == {"T1": 30}
    assert seen(30, END_S + 1.0, 600, known=False).per_sample == {}
