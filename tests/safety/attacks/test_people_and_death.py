"""People and death (S11, S12, S17): somebody moves a setpoint, the process dies or is stopped, start-up."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.safety.attacks.past import Past
from tests.safety.attacks.plant import Attack, Bad, Hand
from tests.safety.attacks.present import Present

MOVED = Attack(start=305.0, heating=0.1, notices_s=(50.0, 80.0), hands=(Hand(60.0, "F.sp", 0.02),), end_s=150.0)
"""A release brings the feed to half; an operator raises it; monitoring notices again."""


def test_s11_what_a_person_moves_is_noticed_and_respected(present: Present) -> None:
    report = present.supervise(MOVED)
    assert report.accepted["F.sp"] == 0.02 and "moved:F.sp" in report.alarms
    assert ["service-changed", 60.0] in report.journal
    assert [value for _, tag, value in report.arrived if tag == "F.sp"] == [0.015], "released once, before that"


def test_s11_past_it_was_overwritten(past: Past) -> None:
    report = past.supervise(MOVED)
    feeds = [(at_s, value) for at_s, tag, value in report.arrived if tag == "F.sp"]
    assert len(feeds) == 2 and feeds[1][0] <= 90.0 and report.accepted["F.sp"] != 0.02


@pytest.mark.parametrize("value", [0.4, 0.0])
def test_s11_a_manual_output_and_its_mode_are_respected_too(present: Present, value: float) -> None:
    """Taken from automatic by hand: no trip and no release writes it, the rest of a fallback acts."""
    attack = Attack(start=300.0, heating=0.02, hands=(Hand(40.0, "V.man", value),), jump_s=60.0, jump_K=15.0)
    report = present.supervise(attack)
    assert report.accepted == {"F.sp": 0.0, "V.man": value} and "moved:V.man" in report.alarms


DIES = Attack(
    start=300.0, heating=0.0, bad=(Bad("offset", 60.0, 78.0, tag="T", by=40.0),), dies_s=80.0, notices_s=(100.0,),
    end_s=150.0,
)  # fmt: skip
"""A reading trips the plant and comes back; the process is killed at 80 s and started again."""


def test_s12_a_latch_outlives_the_process(present: Present) -> None:
    report = present.supervise(DIES)
    assert report.latched is not None and "released" not in [k for k, _ in report.journal]
    assert report.fallbacks == [60.0], "it is read to stand, and not sent again"


def test_s12_past_it_was_forgotten(past: Past) -> None:
    report = past.supervise(DIES)
    assert 60.0 < report.fallbacks[0] < 80.0 and report.latched is None


TRIPPED = Attack(start=300.0, heating=0.02, jump_s=60.0, jump_K=15.0, dies_s=60.0, end_s=150.0)


def test_s12_a_fallback_that_was_under_way_is_sent_until_it_stands(present: Present) -> None:
    report = present.supervise(TRIPPED)
    assert report.latched is not None and report.accepted["F.sp"] == 0.0


@pytest.mark.parametrize("dies_s", [61.0, 63.0, 80.0])
def test_s12_a_fallback_that_stands_is_not_sent_again_while_its_limit_is_still_violated(
    present: Present, dies_s: float
) -> None:
    report = present.supervise(replace(TRIPPED, dies_s=dies_s))
    assert report.fallbacks == [60.0]


STOPPED = Attack(start=300.0, heating=0.0, stops_s=80.0)


def test_s12_a_wanted_stop_writes_nothing(present: Present) -> None:
    report = present.supervise(STOPPED)
    assert report.ended == "stopped" and report.wire == [] and report.journal[-1][0] == "stopped"


def test_s12_past_a_stop_wrote_the_fallback(past: Past) -> None:
    report = past.supervise(STOPPED)
    assert report.ended == "stopped" and report.fallbacks == [80.0]


STARTS = Attack(start=305.0, heating=0.5, level=4.0, end_s=140.0)
"""It never leaves start-up, in which T <= 350 K holds instead of 313 K."""


def test_s17_start_up_has_limits_of_its_own(present: Present) -> None:
    report = present.supervise(STARTS)
    (acted_s,) = report.fallbacks
    assert 350.0 <= report.truth[int(acted_s) - 1] <= 351.5 and report.peak < 352.0
    assert ["tripped", acted_s] in report.journal


def test_s17_past_nothing_held_and_nothing_was_recorded(past: Past) -> None:
    report = past.supervise(STARTS)
    assert report.fallbacks == [] and report.peak > 370.0 and report.journal == []
