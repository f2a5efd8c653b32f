"""Attacks on the gate: default deny, re-check at release, latch."""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace

import pytest

from homeostat.domain.limits import LimitKind, Limits, Owner
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Approve, Finding, Released, Revise, Verdict
from homeostat.guard.gate import Gate, Refused
from tests.safety.world import ACTIONS, COLD, DRAIN, FEED, HOT, LIMITS, VENT, Bench, Says, guarded, reading, rule

APPROVAL = Approve(ACTIONS.digest, ())
OTHER = ActionSet((Command("T.sp", 306.0, 0.5),), "running")


def finding(margin: float, message: str = "T is too high") -> Finding:
    return Finding("X", Owner.ACTION, margin, "K", 0.0, 0, message)


def release(
    plant: Bench, gate: Gate, actions: ActionSet = ACTIONS, approval: Approve = APPROVAL, seen_s: float = 0.0
) -> Released:
    return asyncio.run(gate.release(actions, approval, seen_s))


def refused(plant: Bench, gate: Gate, actions: ActionSet = ACTIONS, approval: Approve = APPROVAL) -> str:
    """The gate's reason; nothing must have been written meanwhile."""
    before = list(plant.written)
    with pytest.raises(Refused) as refusal:
        release(plant, gate, actions, approval)
    assert plant.written == before
    message = str(refusal.value)
    assert message and "\n" not in message
    return message


def test_what_carries_its_own_approval_is_written_whole_and_in_order() -> None:
    plant, rehearsal = Bench(reading(99.0), reading(100.0)), Says()
    released = release(plant, guarded(plant, LIMITS, DRAIN, rehearsal), seen_s=98.0)
    assert plant.written == [ACTIONS.commands]
    assert released == Released(ACTIONS, 100.0)
    ((fresh, rehearsed),) = rehearsal.asked
    assert [s.at_s for s in fresh] == [99.0, 100.0] and rehearsed == ACTIONS


def test_the_rehearsal_sees_only_what_is_new() -> None:
    plant, rehearsal = Bench(reading(99.0), reading(100.0)), Says()
    release(plant, guarded(plant, LIMITS, DRAIN, rehearsal), seen_s=99.0)
    assert [s.at_s for s in rehearsal.asked[0][0]] == [100.0]


def test_nothing_is_written_before_anything_is_asked() -> None:
    plant = Bench()
    guarded(plant, LIMITS, DRAIN, Says())
    assert plant.written == []


@pytest.mark.parametrize("digest", ["", "x", OTHER.digest, ACTIONS.digest[:-1], ACTIONS.digest.upper() + " "])
def test_another_approval_releases_nothing(digest: str) -> None:
    plant = Bench()
    gate = guarded(plant, LIMITS, DRAIN, Says())
    assert ACTIONS.digest[:12] in refused(plant, gate, approval=Approve(digest, ()))


ALTERED = {
    "value by one unit in the last place": replace(
        ACTIONS, commands=(replace(ACTIONS.commands[0], value=math.nextafter(305.0, 400.0)), ACTIONS.commands[1])
    ),
    "rate": replace(ACTIONS, commands=(replace(ACTIONS.commands[0], rate=0.25), ACTIONS.commands[1])),
    "step for ramp": replace(ACTIONS, commands=(replace(ACTIONS.commands[0], rate=None), ACTIONS.commands[1])),
    "automatic": replace(ACTIONS, commands=(replace(ACTIONS.commands[0], value=None), ACTIONS.commands[1])),
    "tag": replace(ACTIONS, commands=(replace(ACTIONS.commands[0], tag="T"), ACTIONS.commands[1])),
    "order": replace(ACTIONS, commands=ACTIONS.commands[::-1]),
    "one less": replace(ACTIONS, commands=ACTIONS.commands[:1]),
    "one more": replace(ACTIONS, commands=(*ACTIONS.commands, Command("V.man", 1.0, 0.1))),
    "target": replace(ACTIONS, target="still"),
}


@pytest.mark.parametrize("change", ALTERED)
def test_a_change_after_the_approval_releases_nothing(change: str) -> None:
    plant, rehearsal = Bench(), Says()
    refused(plant, guarded(plant, LIMITS, DRAIN, rehearsal), ALTERED[change])
    assert rehearsal.asked == []


def test_an_approval_can_be_used_again_only_for_the_same_set() -> None:
    plant = Bench()
    gate = guarded(plant, LIMITS, DRAIN, Says())
    release(plant, gate)
    refused(plant, gate, OTHER)
    release(plant, gate)
    assert plant.written == [ACTIONS.commands, ACTIONS.commands]


def test_a_latched_gate_releases_nothing() -> None:
    plant, rehearsal = Bench(), Says()
    gate = guarded(plant, LIMITS, DRAIN, rehearsal)
    asyncio.run(gate.fall_back("T is too high"))
    assert "T is too high" in refused(plant, gate)
    assert plant.written == [DRAIN.actions.commands] and rehearsal.asked == []


def test_the_permissive_is_judged_on_the_freshest_snapshot() -> None:
    was_bad = Bench(reading(99.0, L=12.0), reading(100.0))
    release(was_bad, guarded(was_bad, LIMITS, DRAIN, Says()))
    is_bad, rehearsal = Bench(reading(99.0), reading(100.0, L=12.0)), Says()
    message = refused(is_bad, guarded(is_bad, LIMITS, DRAIN, rehearsal))
    assert "PRM-FEED" in message and "1 L" in message
    assert rehearsal.asked == [], "what a permissive forbids needs no rehearsal"


def test_every_permissive_counts_wherever_it_stands() -> None:
    second = rule("PRM-SECOND", LimitKind.PERMISSIVE, "T >= 300")
    for limits in (Limits((FEED, HOT, second), ()), Limits((second, FEED), ())):
        plant = Bench(reading(T=299.0))
        assert "PRM-SECOND" in refused(plant, guarded(plant, limits, DRAIN, Says()))


def test_soft_limits_do_not_hold_up_a_release() -> None:
    plant = Bench(reading(T=250.0))
    release(plant, guarded(plant, Limits((COLD, FEED), ()), DRAIN, Says()))
    assert plant.written == [ACTIONS.commands]


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (Revise((finding(-2.0, "small"), finding(-5.0, "large"), finding(3.0, "fine"))), "large"),
        (Revise((finding(-math.inf, "no rollout"), finding(-1.0))), "no rollout"),
        (Revise(()), "no reason"),
        (Revise((finding(1.0),)), "no reason"),
        (Approve(OTHER.digest, ()), "another action set"),
        (Approve("", ()), "another action set"),
        ("approved", "another action set"),
        (True, "another action set"),
    ],
)
def test_only_an_approval_of_this_very_set_passes_the_rehearsal(answer: Verdict, reason: str) -> None:
    plant = Bench()
    assert reason in refused(plant, guarded(plant, LIMITS, DRAIN, Says(answer)))


@pytest.mark.parametrize("error", [RuntimeError("no diagnosis"), ValueError("x"), KeyError("T"), ZeroDivisionError()])
def test_a_rehearsal_that_fails_writes_nothing_and_is_seen(error: Exception) -> None:
    plant = Bench()
    with pytest.raises(type(error)):
        release(plant, guarded(plant, LIMITS, DRAIN, Says(error)))
    assert plant.written == []


class Interrupting:
    """A rehearsal during which the fallback acts."""

    def __init__(self) -> None:
        self.gate: Gate | None = None

    def rehearse(self, fresh: tuple[Snapshot, ...], actions: ActionSet) -> Verdict:
        assert self.gate is not None
        for _ in self.gate.fall_back("an operator pressed stop").__await__():
            raise AssertionError("the bench answers at once")
        return Approve(actions.digest, ())


def test_a_fallback_during_the_rehearsal_wins() -> None:
    plant, rehearsal = Bench(), Interrupting()
    rehearsal.gate = guarded(plant, LIMITS, DRAIN, rehearsal)
    with pytest.raises(Refused, match="an operator pressed stop"):
        release(plant, rehearsal.gate)
    assert plant.written == [DRAIN.actions.commands]


def test_the_fallback_is_allowed_whatever_happened_before() -> None:
    plant = Bench(reading(T=400.0, L=20.0))
    gate = guarded(plant, LIMITS, DRAIN, Says(RuntimeError("twin is lost")))
    assert gate.watch(reading(T=400.0)) is not None
    assert gate.latched is None, "watching says what is wrong, it does not act"
    assert asyncio.run(gate.fall_back("hot")) == DRAIN
    assert plant.written == [DRAIN.actions.commands] and gate.latched == "hot"


def test_falling_back_twice_keeps_the_first_reason_and_the_same_plant_state() -> None:
    plant = Bench()
    gate = guarded(plant, LIMITS, DRAIN, Says())
    asyncio.run(gate.fall_back("first"))
    state = dict(plant.state)
    asyncio.run(gate.fall_back("second"))
    assert gate.latched == "first" and dict(plant.state) == state
    assert plant.written == [DRAIN.actions.commands]


def test_the_armed_fallback_acts() -> None:
    plant = Bench()
    gate = guarded(plant, LIMITS, DRAIN, Says())
    assert gate.armed == DRAIN
    gate.arm(VENT)
    assert gate.armed == VENT
    assert asyncio.run(gate.fall_back("x")) == VENT
    assert plant.written == [VENT.actions.commands]


def test_a_plant_that_cannot_be_reached_latches_the_gate_all_the_same() -> None:
    plant = Bench(reachable=False)
    gate = guarded(plant, LIMITS, DRAIN, Says())
    with pytest.raises(ConnectionError):
        asyncio.run(gate.fall_back("hot"))
    assert gate.latched == "hot"
    assert "hot" in refused(plant, gate)


def test_a_release_that_cannot_be_written_is_no_release() -> None:
    plant = Bench(reachable=False)
    with pytest.raises(ConnectionError):
        release(plant, guarded(plant, LIMITS, DRAIN, Says()))


def test_watching_says_which_limit_by_how_much_and_in_which_unit() -> None:
    gate = guarded(Bench(), LIMITS, DRAIN, Says())
    assert gate.watch(reading()) is None
    assert guarded(Bench(), LIMITS, DRAIN, Says()).watch(reading(T=315.5)) == "'T <= 313' is broken by 2.5 K (LIM-HOT)"


def test_one_wild_reading_does_not_trip_but_a_lasting_one_does() -> None:
    gate = guarded(Bench(), LIMITS, DRAIN, Says(), filter_s=10.0)
    assert gate.watch(reading(1.0, T=312.0)) is None
    assert gate.watch(reading(2.0, T=320.0)) is None
    assert gate.watch(reading(3.0, T=312.0)) is None
    tripped = [gate.watch(reading(4.0 + k, T=315.0)) is not None for k in range(20)]
    assert not tripped[0] and tripped[-1] and tripped == sorted(tripped)


@pytest.mark.parametrize("filter_s", [2.0, 10.0, 20.0])
def test_the_filter_is_first_order_with_its_time_constant(filter_s: float) -> None:
    """A step from 312 to 314 passes 313 after filter ln 2 seconds: 1 - exp(-t / filter) = 1/2."""
    gate = guarded(Bench(), LIMITS, DRAIN, Says(), filter_s=filter_s)
    gate.watch(reading(0.0, T=312.0))
    seconds = next(k for k in range(1, 200) if gate.watch(reading(float(k), T=314.0)) is not None)
    assert seconds == math.floor(filter_s * math.log(2.0)) + 1


def test_the_usual_filter_follows_within_a_minute() -> None:
    gate = guarded(Bench(), LIMITS, DRAIN, Says())
    gate.watch(reading(0.0, T=310.0))
    seconds = next(k for k in range(1, 200) if gate.watch(reading(float(k), T=316.0)) is not None)
    assert 3 <= seconds <= 60


def test_instrument_errors_replace_the_last_ones() -> None:
    gate = guarded(Bench(), LIMITS, DRAIN, Says())
    gate.correct(({"T": 5.0},))
    assert gate.watch(reading(T=316.0)) is None
    gate.correct(())
    assert gate.watch(reading(T=316.0)) is not None
