"""The journal (S13): it fails, hangs or is deaf, and the plant is guarded all the same; nothing is sent before it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.safety.attacks.past import Past
from tests.safety.attacks.plant import FULL, Attack, violated_s
from tests.safety.attacks.present import Present

RECOVERS = Attack(start=305.0, heating=0.1, notices_s=(50.0,), end_s=80.0)
"""A release at 51 s is all that it takes."""
TRIPS = Attack(start=300.0, heating=0.02, jump_s=60.0, jump_K=15.0)


def test_s13_everything_is_in_the_journal_before_it_is_sent(present: Present) -> None:
    for attack in (RECOVERS, TRIPS):
        report = present.supervise(attack)
        assert len(report.wire) == 1 and all(held for *_, held in report.wire)


def test_s13_past_it_was_recorded_after_it_was_written(past: Past) -> None:
    for attack in (RECOVERS, TRIPS):
        report = past.supervise(attack)
        assert len(report.wire) == 1 and not any(held for *_, held in report.wire)


@pytest.mark.parametrize("journal", ["full", "sync", "hang"])
def test_s13_a_journal_that_fails_trips_no_healthy_plant(present: Present, journal: str) -> None:
    report = present.supervise(replace(RECOVERS, heating=0.0, journal=journal, journal_s=40.0))
    assert report.wire == [] and report.latched is None and report.accepted["F.sp"] == FULL


@pytest.mark.parametrize("journal", ["full", "sync"])
def test_s13_a_journal_that_fails_stops_new_releases(present: Present, journal: str) -> None:
    report = present.supervise(replace(RECOVERS, journal=journal, journal_s=40.0))
    assert "journal" in report.alarms
    assert all(["F.sp", 0.015] not in commands for _, commands, _ in report.wire)


def test_s13_a_listener_that_fails_changes_nothing(present: Present) -> None:
    report = present.supervise(replace(RECOVERS, journal="subscriber", journal_s=40.0))
    assert report.fallbacks == [] and report.accepted["F.sp"] == 0.015


@pytest.mark.parametrize("journal", ["full", "sync", "hang"])
def test_s13_a_journal_that_fails_keeps_no_fallback_from_acting(present: Present, journal: str) -> None:
    report = present.supervise(replace(TRIPS, journal=journal, journal_s=40.0))
    assert report.fallbacks[0] == violated_s(report) == TRIPS.jump_s and report.accepted["F.sp"] == 0.0


@pytest.mark.parametrize("journal", ["full", "subscriber"])
def test_s13_past_a_full_disk_tripped_a_healthy_plant(past: Past, journal: str) -> None:
    report = past.supervise(replace(RECOVERS, heating=0.0, journal=journal, journal_s=50.0))
    assert report.fallbacks == [51.0] and report.accepted["F.sp"] != FULL and report.ended.startswith("OSError")
