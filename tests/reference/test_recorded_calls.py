"""Recorded language-model answers, replayed on the published plant under the published rules.

Every record of the file is replayed. The published studies have 90 and 95 calls; where a study's records are
here, all of them must be. The records are not part of this project: without them ``test_published_figures`` replays
four of the runs from figures.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.published_reactor import TAGS, Course, PublishedReactor
from benchmarks.published_rules import Judgement, Replayed, judge, replay
from benchmarks.recorded_calls import FILE, Reason, Setpoints, by_run, read_calls, repeats

pytestmark = pytest.mark.wide
CALLS_OF = {"cstr_20260803_182646": 90, "cstr_20260803_201135": 95}
RECORDED = pytest.mark.reference(
    "the recorded answers of others' models (test_published_figures has some figures)", FILE
)
SHOWN_TEMPERATURE_K = 1e-9
"""Reached: 7.8e-11 K after up to 4806 s of noise; the published integrator is adaptive, this one has fixed steps."""
SHOWN_POSITION = 1e-9
"""Reached: 2.6e-13."""
SHOWN_LEVEL_L = 1e-9
PEAK_TEMPERATURE_K = 1e-9
"""Reached: 1.8e-11 K over rollouts of up to 6137 s."""
PEAK_POSITION = 1e-9


@pytest.fixture(scope="module")
def replayed() -> list[Replayed]:
    return [r for calls in by_run(read_calls()).values() for r in replay(calls)]


@RECORDED
def test_every_record_is_replayed(replayed: list[Replayed]) -> None:
    counts = Counter(r.call.experiment for r in replayed)
    assert counts == {name: CALLS_OF[name] for name in counts}
    assert counts["cstr_20260803_182646"] == 90


@RECORDED
def test_every_verdict_has_the_recorded_reason(replayed: list[Replayed]) -> None:
    assert [r.judgement.reason for r in replayed] == [r.call.reason for r in replayed]
    assert [r.judgement.reason is Reason.PASS for r in replayed] == [r.call.accepted for r in replayed]


@RECORDED
def test_every_first_safe_minute_ends_in_the_recorded_second(replayed: list[Replayed]) -> None:
    assert [r.judgement.time_to_safe_s for r in replayed] == [r.call.time_to_safe_s for r in replayed]


@RECORDED
def test_every_unsafe_second_is_counted(replayed: list[Replayed]) -> None:
    assert [r.judgement.unsafe_s for r in replayed] == [r.call.unsafe_s for r in replayed]
    assert [r.course.seconds for r in replayed] == [r.call.simulated_s for r in replayed]
    assert [r.judgement.unsafe_fraction for r in replayed] == [r.call.unsafe_fraction for r in replayed]


@RECORDED
def test_the_model_was_shown_this_plant(replayed: list[Replayed]) -> None:
    for r in replayed:
        assert r.shown.temperature == pytest.approx(r.call.shown.temperature, abs=SHOWN_TEMPERATURE_K)
        assert r.shown.level == pytest.approx(r.call.shown.level, abs=SHOWN_LEVEL_L)
        assert r.shown.feed_valve == pytest.approx(r.call.shown.feed_valve, abs=SHOWN_POSITION)
        assert r.shown.pump == pytest.approx(r.call.shown.pump, abs=SHOWN_POSITION)
        assert r.shown.cooling_valve == pytest.approx(r.call.shown.cooling_valve, abs=SHOWN_POSITION)


@RECORDED
def test_the_noise_stream_runs_on_from_one_rollout_to_the_next(replayed: list[Replayed]) -> None:
    assert [r.draws for r in replayed] == [r.call.draws for r in replayed]


@RECORDED
def test_every_peak(replayed: list[Replayed]) -> None:
    for r in replayed:
        top = {tag: float(values[1:].max()) for tag, values in r.course.signals.items()}
        assert top["T1"] == pytest.approx(r.call.peaks.temperature, abs=PEAK_TEMPERATURE_K)
        assert top["V1.pos"] == pytest.approx(r.call.peaks.feed_valve, abs=PEAK_POSITION)
        assert top["P1.pos"] == pytest.approx(r.call.peaks.pump, abs=PEAK_POSITION)
        assert top["V2.pos"] == pytest.approx(r.call.peaks.cooling_valve, abs=PEAK_POSITION)


@RECORDED
def test_a_changed_feed_is_a_repeated_one(replayed: list[Replayed]) -> None:
    calls = [r.call for r in replayed]
    again = repeats(calls)
    for call in calls:
        factor = 0.9 if call.nudged else 1.0
        assert call.evaluated.feed == pytest.approx(factor * call.proposed.feed, abs=1e-15)
        assert replace(call.evaluated, feed=call.proposed.feed) == call.proposed
        assert call in again or not call.nudged


def test_the_verdict_depends_on_where_the_stream_stands() -> None:
    """The plant of a recorded run: the valve stuck at 2085 s, and a model was asked at 2134 s."""
    plant = PublishedReactor("cool_stuck_closed", 2085.0)
    plant.advance(2134)
    draws, reasons = plant.draws, []
    for _ in range(3):
        course = plant.roll_out(Setpoints(309.95, 10.0, 0.0255), draws)
        reasons.append(judge(course).reason)
        draws = course.draws
    assert reasons == [Reason.NO_RECOVERY, Reason.SLOW_RECOVERY, Reason.PASS]


def course(seconds: int = 1000, /, **changes: float | np.ndarray) -> Course:
    """A rollout in which nothing happens, but for ``changes`` (dots of tags as underscores); no shut-down."""
    quiet = {"T1": 310.0, "L1": 10.0, "overflow": 0.0, "V1_pos": 0.5, "P1_pos": 0.5, "V2_pos": 0.5}
    ones = np.ones(seconds + 1)
    signals = {tag: ones * (quiet | changes)[tag.replace(".", "_")] for tag in TAGS}
    return Course(0, signals, ones, ones, 0)


def hot_until(second: int, seconds: int = 1000) -> np.ndarray:
    """313.5 K up to and including ``second``, then 310 K."""
    return np.where(np.arange(seconds + 1) <= second, 313.5, 310.0)


def test_a_quiet_rollout_is_safe_after_a_minute_of_grace_and_a_minute() -> None:
    assert judge(course()) == Judgement(Reason.PASS, 119.0, 0, 0.0)


def test_the_minute_of_grace_is_not_judged() -> None:
    assert judge(course(T1=hot_until(59))) == Judgement(Reason.PASS, 119.0, 0, 0.0)
    assert judge(course(T1=hot_until(60))) == Judgement(Reason.PASS, 120.0, 1, 1 / 1000)


def test_the_safe_minute_must_end_within_600_s() -> None:
    assert judge(course(5000, T1=hot_until(540, 5000))).reason is Reason.PASS
    late = judge(course(5000, T1=hot_until(541, 5000)))
    assert (late.reason, late.time_to_safe_s) == (Reason.SLOW_RECOVERY, 601.0)


def test_59_safe_seconds_are_no_recovery() -> None:
    assert judge(course(T1=hot_until(940))).reason is Reason.SLOW_RECOVERY
    assert judge(course(T1=hot_until(941))).reason is Reason.NO_RECOVERY


def test_a_fifth_of_all_seconds_may_be_unsafe() -> None:
    assert judge(course(T1=hot_until(259))).reason is Reason.PASS
    assert judge(course(T1=hot_until(260))).reason is Reason.UNSAFE_FRACTION


@pytest.mark.parametrize(
    "changes",
    [{"T1": 313.1}, {"L1": 1.9}, {"L1": 11.1}, {"overflow": 1e-3}, {"V2_pos": 0.96, "T1": 310.6},
     {"P1_pos": 0.96, "T1": 309.4}, {"V1_pos": 1.0, "T1": 312.0}],
)  # fmt: skip
def test_what_makes_a_second_unsafe(changes: dict[str, float]) -> None:
    found = judge(course(1000, **changes))
    assert (found.reason, found.unsafe_s) == (Reason.NO_RECOVERY, 941)


def test_a_saturated_valve_is_fine_while_310_k_are_held() -> None:
    assert judge(course(V2_pos=1.0, T1=310.4)).reason is Reason.PASS
