"""Trust (S5, S14, S15, S16): requests that are not what they say, altered configurations, forged journals."""

from __future__ import annotations

import pytest

from tests.safety.attacks.past import Past
from tests.safety.attacks.plant import HALF, Ask, Attack
from tests.safety.attacks.present import Present

HEALTHY = Attack(start=300.0, heating=0.0, end_s=80.0)
REQUESTS = {
    "out of range": (Ask(50.0, (("F.sp", 0.5, 0.005),)), "admitted are"),
    "too fast": (Ask(50.0, (("F.sp", HALF, 5.0),)), "limit 0.005"),
    "a step where the rate is limited": (Ask(50.0, (("F.sp", HALF, None),)), "limit 0.005"),
    "not writable": (Ask(50.0, (("T", 300.0, None),)), "not a tag that may be written"),
    "no such tag": (Ask(50.0, (("Q.sp", 1.0, None),)), "not a tag that may be written"),
    "not a number": (Ask(50.0, (("F.sp", float("nan"), 0.005),)), "must be finite"),
    "infinite": (Ask(50.0, (("F.sp", float("inf"), 0.005),)), "must be finite"),
    "self-made": (Ask(50.0, forged="self-made"), "the seal"),
    "old": (Ask(50.0, forged="old"), "old; 0 to"),
    "from the future": (Ask(50.0, forged="future"), "old; 0 to"),
    "no time": (Ask(50.0, forged="nan"), ""),
    "altered": (Ask(50.0, forged="altered"), "the seal"),
    "another configuration": (Ask(50.0, forged="configuration"), "configuration"),
}
UNCHECKED = (
    "out of range", "too fast", "a step where the rate is limited", "not writable", "no such tag", "self-made", "old",
    "from the future", "no time", "another configuration",
)  # fmt: skip
"""What 170fbcd wrote when the twin said yes."""


def asking(name: str) -> Attack:
    """The attack with one bad request."""
    return Attack(start=300.0, heating=0.0, end_s=80.0, asks=(REQUESTS[name][0],))


@pytest.mark.parametrize("name", REQUESTS)
def test_s5_a_bad_request_is_refused_with_its_reason(present: Present, name: str) -> None:
    report = present.request(asking(name))
    assert report.wire == [] and len(report.refused) == 1 and REQUESTS[name][1] in report.refused[0]


@pytest.mark.parametrize("name", UNCHECKED)
def test_s5_past_it_was_written(past: Past, name: str) -> None:
    report = past.request(asking(name))
    assert len(report.wire) == 1 and report.refused == []


def test_s5_a_seal_is_used_once(present: Present) -> None:
    report = present.request(Attack(start=300.0, heating=0.0, end_s=80.0, asks=(Ask(50.0, forged="replayed"),)))
    assert len(report.wire) == 1 and "used once" in report.refused[0]


def test_s5_past_an_approval_was_used_as_often_as_one_liked(past: Past) -> None:
    report = past.request(Attack(start=300.0, heating=0.0, end_s=80.0, asks=(Ask(50.0, forged="replayed"),)))
    assert len(report.wire) == 2 and report.refused == []


@pytest.mark.parametrize("forgery", ["state", "digest", "times"])
def test_s16_a_journal_that_was_made_anew_is_not_vouched_for(present: Present, forgery: str) -> None:
    assert not present.verifies(forgery)


@pytest.mark.parametrize("forgery", ["state", "digest", "times"])
def test_s16_past_it_verified(past: Past, forgery: str) -> None:
    assert past.verifies(forgery)
