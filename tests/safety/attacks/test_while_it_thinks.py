"""While it thinks (S1, S3, S4): a limit that is crossed, a fallback during a release, two releases at once."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.safety.attacks.past import Past
from tests.safety.attacks.plant import FULL, HALF, Ask, Attack, Bad, violated_s
from tests.safety.attacks.present import Present

CROSSES = Attack(start=305.0, heating=0.1, notices_s=(50.0,), thinking_s=60.0, end_s=200.0)
"""The limit is passed at 81 s, while recovery thinks from 50 s to 110 s and later."""
JUMPS = Attack(start=300.0, heating=0.02, notices_s=(50.0,), jump_s=60.0, jump_K=15.0)
"""Nobody can foresee it."""


def test_s1_the_fallback_acts_while_it_thinks(present: Present) -> None:
    report = present.supervise(CROSSES)
    assert report.fallbacks == [violated_s(report)] and report.peak < 313.5


def test_s1_past(past: Past) -> None:
    """The limit was watched between two thoughts only."""
    report = past.supervise(CROSSES)
    late_s = (report.fallbacks or [CROSSES.end_s])[0] - report.crossed_s
    assert late_s >= 19.0 and report.peak >= 315.0


@pytest.mark.parametrize("hangs", ["diagnosis", "planning", "action"])
def test_s1_the_fallback_acts_while_a_part_of_recovery_never_answers(present: Present, hangs: str) -> None:
    report = present.supervise(replace(JUMPS, hangs=hangs))
    assert report.fallbacks == [violated_s(report)] == [JUMPS.jump_s]


@pytest.mark.parametrize("hangs", ["planning", "action"])
def test_s1_what_never_answers_has_no_time_beyond_what_physics_leaves(present: Present, hangs: str) -> None:
    report = present.supervise(replace(CROSSES, hangs=hangs))
    assert len(report.fallbacks) == 1 and report.peak < 313.0, "the fallback acts before the limit is reached"


SLOW = Attack(
    start=300.0, heating=0.0, bad=(Bad("slow", 50.0, 52.0, by=3.0),),
    asks=(Ask(50.0, (("V.man", 0.5, 0.2), ("F.sp", 0.02, 0.005))),), trip_s=51.0,
)  # fmt: skip
"""A release takes three seconds per command; the fallback is ordered in between."""


def test_s3_nothing_of_a_release_outlives_a_fallback(present: Present) -> None:
    """What was on its way arrives all the same; it is noticed, and the fallback stands in the end."""
    report = present.request(SLOW)
    assert report.latched is not None and report.accepted == {"F.sp": 0.0, "V.man": 1.0}
    assert [at_s for at_s, commands, _ in report.wire if ["F.sp", 0.02] in commands] == [50.0]


def test_s3_past(past: Past) -> None:
    """Commands of the release landed after the fallback's and stayed."""
    report = past.request(SLOW)
    assert report.latched == "ordered" and report.accepted["F.sp"] == 0.02


TWO = Attack(
    start=300.0, heating=0.0, bad=(Bad("slow", 50.0, 60.0, by=3.0),),
    asks=(Ask(50.0, (("F.sp", 0.02, 0.005), ("V.man", 0.2, 0.2))), Ask(51.0, (("F.sp", HALF, 0.005),))),
)  # fmt: skip
"""Two releases, the second while the first is being written."""


def test_s4_one_write_at_a_time(present: Present) -> None:
    report = present.request(TWO)
    assert len(report.wire) == 1 and report.accepted == {"F.sp": 0.02, "V.man": 0.2}
    assert report.refused and "'reduced'" in report.refused[0], "the state it was made for has gone"


def test_s4_past_writes_were_interleaved(past: Past) -> None:
    report = past.request(TWO)
    assert [at_s for at_s, _, _ in report.wire] == [50.0, 51.0] and report.refused == []
    assert [tag for _, tag, _ in report.arrived] == ["F.sp", "F.sp", "V.man"]


FILLS = Attack(start=300.0, heating=0.0, level=8.0, filling=0.05, asks=(Ask(56.0, forged="delayed"),))
"""The permissive L <= 11 L holds at 56 s, when the request is made, and not any more when it is written."""


def test_s4_a_permissive_is_judged_on_the_reading_of_the_write(present: Present) -> None:
    report = present.request(FILLS)
    assert report.wire == [] and "PRM-FEED" in report.refused[0] and report.accepted["F.sp"] == FULL


def test_s4_past_it_was_judged_half_a_minute_before(past: Past) -> None:
    report = past.request(FILLS)
    assert [at_s for at_s, _, _ in report.wire] == [81.0] and report.refused == []
