"""Band: a plant that is nearer a limit than every member predicts is told; noise, a liar or a gap is not."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.events.deviations import Strayed
from homeostat.domain.snapshot import Snapshot, Trajectory
from homeostat.domain.verdict import Rollout, RolloutResult
from homeostat.recovery.bounds import InterventionBounds
from homeostat.recovery.look.band import FIRST, LONGEST, Band
from tests.safety.world import HOT, TAGS

FAULTY = (Hypothesis((FaultState("fouling", 0.5, 50.0),), 1.0),)
SCALE = TAGS["T"].scale
SCALES = {"K": SCALE}
FURTHER, MEAN_S = 0.5, 30.0
FROM_S, LENGTH = 100.0, 1800


def predicted(*members: Callable[[float], float], hypotheses: tuple[Hypothesis, ...] = FAULTY) -> Rollout:
    """What each of ``members`` says of T, in seconds from :data:`FROM_S` on."""
    signals = {"T": np.array([[member(float(s)) for s in range(LENGTH)] for member in members])}
    weights = tuple(1.0 / len(members) for _ in members)
    return Rollout("digest", Trajectory(FROM_S, 1.0, signals), hypotheses, weights, RolloutResult.COMPLETED)


def band(rollout: Rollout, lying: tuple[str, ...] = ()) -> Band:
    subject = Band((HOT,), SCALES, InterventionBounds(stray=FURTHER, stray_s=MEAN_S))
    subject.expect(rollout, lying)
    return subject


def told(
    subject: Band, read: Callable[[float], float], seconds: int = LENGTH, bad: str = "", uncertain: str = ""
) -> list[float]:
    """Seconds from :data:`FROM_S` on at which a plant that shows ``read`` is told to stray."""
    every = (Snapshot(FROM_S + s, {"T": read(float(s))}, frozenset(bad), frozenset(uncertain)) for s in range(seconds))
    return [seen.at_s - FROM_S for seen in every if subject.strays(seen) is not None]


def between(s: float) -> float:
    return 311.5 + 0.0005 * s


MEMBERS = (lambda s: 311.0 + 0.0005 * s, lambda s: 312.0 + 0.0005 * s)
"""The limit is at 313 K: between 2 and 1 K are left at first."""


def test_a_plant_that_stays_between_the_members_does_not_stray() -> None:
    assert told(band(predicted(*MEMBERS)), between) == []


def test_a_mean_margin_that_is_less_than_every_member_has_is_told_with_what_was_predicted() -> None:
    subject = band(predicted(*MEMBERS))
    found = [subject.strays(Snapshot(FROM_S + s, {"T": between(s) + 0.02 * s})) for s in range(200)]
    first = next(strayed for strayed in found if strayed is not None)
    assert isinstance(first, Strayed) and first.limit == "LIM-HOT"
    assert first.margin < first.least - FURTHER * SCALE and first.least == pytest.approx(1.0, abs=0.1)
    assert "'T <= 313'" in first.reason and "predicted to hold by" in first.reason


def test_a_plant_that_is_farther_from_its_limit_than_predicted_does_not_stray() -> None:
    assert told(band(predicted(*MEMBERS)), lambda s: between(s) - 5.0) == []


def test_far_from_a_limit_a_quarter_of_the_margin_must_be_gone() -> None:
    far = predicted(lambda s: 293.0)  # 20 K are left
    assert told(band(far), lambda s: 297.9, 300) == [] != told(band(far), lambda s: 298.1, 300)


@settings(max_examples=20)
@given(st.floats(-0.9, 0.9))
def test_as_much_as_the_model_may_be_wrong_by_is_no_news(share: float) -> None:
    off = math.copysign(0.5, share) + share * FURTHER * SCALE
    assert told(band(predicted(*MEMBERS)), lambda s: between(s) + off, 200) == []


def test_one_wild_reading_is_no_news() -> None:
    far = 0.5 * FURTHER * SCALE * MEAN_S
    assert told(band(predicted(*MEMBERS)), lambda s: between(s) + (far if s == 80 else 0.0), 300) == []


def test_calls_become_rarer_and_never_cease() -> None:
    at_s = told(band(predicted(*MEMBERS)), lambda s: between(s) + 10.0)
    gaps = np.diff(at_s)
    assert len(at_s) > 2 and gaps[0] >= FIRST * MEAN_S and (np.diff(gaps) >= 0).all()
    assert gaps.max() <= LONGEST * MEAN_S + 1.0


@pytest.mark.parametrize("rollout", [
    predicted(*MEMBERS, hypotheses=(Hypothesis((), 1.0),)),
    Rollout("digest", Trajectory(FROM_S, 1.0, {"T": np.zeros((1, 5))}), FAULTY, (), RolloutResult.BROKE_DOWN),
])  # fmt: skip
def test_where_nothing_is_wrong_or_the_twin_broke_down_nothing_is_expected(rollout: Rollout) -> None:
    assert told(band(rollout), lambda s: 400.0) == []


def test_of_an_instrument_that_may_lie_nothing_is_expected() -> None:
    assert told(band(predicted(*MEMBERS), ("T",)), lambda s: 400.0) == []


def test_readings_that_are_not_good_say_nothing() -> None:
    assert told(band(predicted(*MEMBERS)), lambda s: 400.0, bad="T") == []
    assert told(band(predicted(*MEMBERS)), lambda s: 400.0, uncertain="T") == []
    assert told(band(predicted(*MEMBERS)), lambda s: math.nan) == []


def test_where_a_member_is_undecided_nothing_is_expected() -> None:
    assert told(band(predicted(*MEMBERS, lambda s: math.nan)), lambda s: 400.0) == []


def test_where_the_settings_say_so_nothing_strays() -> None:
    subject = Band((HOT,), SCALES, InterventionBounds())
    subject.expect(predicted(*MEMBERS), ())
    assert told(subject, lambda s: 400.0) == []


def test_after_the_end_of_a_prediction_and_after_a_gap_nothing_is_expected() -> None:
    subject = band(predicted(*MEMBERS))
    assert subject.strays(Snapshot(FROM_S + LENGTH + 1.0, {"T": 400.0})) is None
    assert band(predicted(*MEMBERS)).strays(Snapshot(FROM_S + 500.0, {"T": 400.0})) is None, "one reading is no mean"


def test_what_was_seen_before_the_prediction_is_not_held_against_it() -> None:
    subject = band(predicted(*MEMBERS))
    for s in range(-60, 0):
        assert subject.strays(Snapshot(FROM_S + s, {"T": 400.0})) is None
    assert told(subject, between) == []


def test_a_plant_that_is_moved_on_purpose_does_not_stray() -> None:
    subject = band(predicted(*MEMBERS))
    subject.forget()
    assert told(subject, lambda s: 400.0) == []
