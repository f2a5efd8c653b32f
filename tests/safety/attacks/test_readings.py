"""Readings (S7 to S10): frozen, old, absent, wrong, explained away, and steps that a filter hides."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.safety.attacks.past import Past
from tests.safety.attacks.plant import Attack, Bad, violated_s
from tests.safety.attacks.present import Present

RISES = Attack(start=305.0, heating=0.1, end_s=300.0)
"""Cooling fails: the limit is passed at 81 s."""
BLIND_S = 40.0
"""From here on nothing of use is read [s]."""
LOST = (
    Bad("freeze", BLIND_S), Bad("freeze", BLIND_S, tag="T"), Bad("silence", BLIND_S), Bad("stuck-clock", BLIND_S),
    Bad("old", BLIND_S), Bad("old", BLIND_S, tag="T"), Bad("clock", BLIND_S, by=-50.0), Bad("clock", BLIND_S, by=1e6),
    Bad("clock", BLIND_S, by=float("nan")), Bad("nan", BLIND_S, tag="T"), Bad("missing", BLIND_S, tag="T"),
    Bad("marked", BLIND_S, tag="T"), Bad("celsius", BLIND_S, tag="T"), Bad("offset", BLIND_S, tag="T", by=1e9),
)  # fmt: skip


@pytest.mark.parametrize("bad", LOST, ids=lambda b: f"{b.kind} {b.tag} {b.by}")
def test_s7_blindness_on_a_hard_limit_trips_after_its_grace_time(present: Present, bad: Bad) -> None:
    report = present.supervise(replace(RISES, bad=(bad,)))
    assert BLIND_S + 5.0 <= report.fallbacks[0] <= BLIND_S + 17.0 and report.above_s == 0
    assert report.journal[-1][1] == RISES.end_s, "and supervision goes on"


@pytest.mark.parametrize("bad", [LOST[0], LOST[2], LOST[5], LOST[12]], ids=lambda b: f"{b.kind} {b.tag}")
def test_s7_past_nobody_noticed(past: Past, bad: Bad) -> None:
    report = past.supervise(replace(RISES, bad=(bad,)))
    assert report.fallbacks == [] and report.above_s > 200


HEALTHY = Attack(start=300.0, heating=0.0)
ONE_SECOND = [
    Bad(kind, 50.0, 51.0, tag=tag) for kind in ("nan", "missing", "marked", "celsius", "silence") for tag in ("T", "L")
]


@pytest.mark.parametrize("bad", ONE_SECOND, ids=lambda b: f"{b.kind} {b.tag}")
def test_s8_one_bad_reading_ends_nothing(present: Present, bad: Bad) -> None:
    report = present.supervise(replace(HEALTHY, bad=(bad,)))
    assert report.wire == [] and report.latched is None and report.journal[-1][1] == HEALTHY.end_s


@pytest.mark.parametrize("kind", ["nan", "missing", "marked"])
def test_s8_past_one_bad_reading_shut_the_plant_down(past: Past, kind: str) -> None:
    report = past.supervise(replace(HEALTHY, bad=(Bad(kind, 50.0, 51.0, tag="T"),)))
    assert report.fallbacks == [50.0] and report.latched is not None


EXPLAINED = Attack(start=305.0, heating=0.1, notices_s=(50.0,), error=60.0, jump_s=100.0, jump_K=8.0, end_s=200.0)
"""A diagnosis says that the temperature reads 60 K too high; then it is truly too high."""


@pytest.mark.parametrize("error", [60.0, 5.0, -60.0, float("inf"), float("nan")])
def test_s9_no_diagnosis_disarms_a_limit(present: Present, error: float) -> None:
    report = present.supervise(replace(EXPLAINED, error=error))
    assert report.fallbacks and report.fallbacks[0] <= violated_s(report)


def test_s9_past_a_diagnosis_disarmed_it(past: Past) -> None:
    report = past.supervise(EXPLAINED)
    assert report.fallbacks == [] and report.above_s >= 100 and report.peak > 317.0


STEP = Attack(start=300.0, heating=0.0, jump_s=100.0, jump_K=16.0, end_s=400.0)
"""A step to 3 K over the limit."""


@pytest.mark.parametrize("step_s", [1.0, 5.0])
def test_s10_a_step_of_three_kelvin_over_the_limit_trips_within_ten_seconds(present: Present, step_s: float) -> None:
    report = present.supervise(replace(STEP, step_s=step_s))
    assert report.fallbacks[0] == violated_s(report) <= STEP.jump_s + 10.0


@pytest.mark.parametrize("step_s", [1.0, 5.0])
def test_s10_past_it_took_as_many_samples_whatever_their_time(past: Past, step_s: float) -> None:
    report = past.supervise(replace(STEP, step_s=step_s))
    samples = (report.fallbacks[0] - STEP.jump_s) / step_s
    assert 30 <= samples <= 45
