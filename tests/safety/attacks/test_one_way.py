"""One way to the plant (S2, S6): what arrives is what the journal intends, and what is not obeyed is noticed."""

from __future__ import annotations

import pytest

from tests.safety.attacks.past import Past
from tests.safety.attacks.plant import FULL, HALF, Ask, Attack, Bad
from tests.safety.attacks.present import Present

BATCH_S = 400.0
"""Far enough for the first steps of the nominal batch [s]."""


def test_s2_every_command_of_a_nominal_batch_is_in_the_journal(present: Present) -> None:
    batch = present.batch(BATCH_S)
    assert len(batch["wire"]) >= 2 and batch["wire"] == batch["intended"] and batch["written"] == len(batch["wire"])


def test_s2_past_the_plant_commanded_itself(past: Past) -> None:
    batch = past.batch(BATCH_S)
    assert len(batch["wire"]) >= 2 and batch["written"] == 0 and batch["intended"] == []


BOTH = (Ask(50.0, (("F.sp", HALF, 0.005), ("V.man", 0.5, 0.2))),)
DONE = {"F.sp": HALF, "V.man": 0.5}


def asked(*bad: Bad) -> Attack:
    """Two commands to a plant whose link misbehaves."""
    return Attack(start=300.0, heating=0.0, asks=BOTH, bad=bad)


@pytest.mark.parametrize("kind", ["half", "raise", "ignore", "hang"])
def test_s6_what_did_not_arrive_is_sent_again_under_an_intention_of_its_own(present: Present, kind: str) -> None:
    report = present.request(asked(Bad(kind, 50.0, 51.0)))
    assert report.accepted == DONE and len(report.wire) == 2 and all(held for *_, held in report.wire)
    assert [k for k, _ in report.journal].count("write-intended") == 2 and report.fallbacks == []


@pytest.mark.parametrize("kind", ["half", "raise", "ignore", "hang"])
def test_s6_what_never_arrives_is_an_alarm(present: Present, kind: str) -> None:
    report = present.request(asked(Bad(kind, 50.0)))
    assert len(report.wire) == 3 and "write:request" in report.alarms and report.journal[-1][1] == 120.0


@pytest.mark.parametrize(
    ("kind", "ended"), [("half", ""), ("raise", "Broken: "), ("ignore", ""), ("hang", "waits for ever")]
)
def test_s6_past_half_stayed_or_it_ended_or_it_waited(past: Past, kind: str, ended: str) -> None:
    report = past.request(asked(Bad(kind, 50.0, 51.0)))
    assert report.ended.startswith(ended) and len(report.wire) == 1 and report.accepted != DONE


@pytest.mark.parametrize("by", [1.0, 2.0])
def test_s6_a_plant_that_obeys_late_is_waited_for(present: Present, by: float) -> None:
    report = present.request(asked(Bad("late", 50.0, 51.0, by=by)))
    assert report.accepted == DONE and len(report.wire) == 1 and report.alarms == []


@pytest.mark.parametrize("kind", ["ignore", "hang", "half"])
def test_s6_a_fallback_is_sent_until_it_stands(present: Present, kind: str) -> None:
    report = present.supervise(
        Attack(start=300.0, heating=0.02, jump_s=60.0, jump_K=15.0, bad=(Bad(kind, 55.0, 100.0),))
    )
    assert report.fallbacks[0] == 60.0 and len(report.fallbacks) > 3
    assert report.accepted["F.sp"] == 0.0 and {"trip:LIM-HOT", "latched"} <= set(report.alarms)


def test_s6_past_a_fallback_was_sent_once(past: Past) -> None:
    report = past.supervise(
        Attack(start=300.0, heating=0.02, jump_s=60.0, jump_K=15.0, bad=(Bad("ignore", 55.0, 100.0),), end_s=200.0)
    )
    assert len(report.fallbacks) == 1 and report.accepted["F.sp"] == FULL and report.above_s > 100
