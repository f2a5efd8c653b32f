"""Readings that jump as no process can: a limit is watched on them as they are, and as if they had not."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.events.guard import Armed, ReadingJumped
from homeostat.domain.events.trips import FallbackActivated, Tripped
from homeostat.domain.mode import Mode, Role, Verb
from homeostat.domain.observation import Arm, Correction
from homeostat.domain.plant.rules import QualityRule
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.watch.jumps import UNSURE, Jumps
from homeostat.guard.watch.trips import TripWatch
from tests.guard.test_trial import killed
from tests.guard.vessel import RULES, World, running

pytestmark = pytest.mark.quick

NOISE = 0.01
RULE = QualityRule("L", 5.0, noise=NOISE, frozen_s=10.0, fastest=0.3, grace_s=5.0)


def jumps(*readings: float) -> Jumps:
    """What has heard these readings, one per second."""
    found = Jumps({"L": RULE})
    for k, value in enumerate(readings):
        found.take("L", value, float(k))
    return found


def error(by: float) -> float:
    """What a reading that has jumped ``by`` may be wrong by at worst."""
    return math.copysign(abs(by) + UNSURE * NOISE, by)


def jumped(**rest: Any) -> World:
    """A vessel of 308 K whose thermometer falls by 8 K within a second."""
    world = running(**rest)
    world.tick(3, T=308.0)
    world.tick(1, T=300.0)
    return world


def warms(world: World) -> None:
    """It warms by 12 K in a minute, 1 K less than to its limit as far as the thermometer says."""
    for k in range(60):
        world.tick(1, T=300.0 + 0.2 * k)


def test_a_jump_lasts_until_the_reading_jumps_back() -> None:
    assert jumps(10.0, 10.0, 8.5, 8.6, 8.7).errors == {"L": pytest.approx(error(-1.5))}
    assert jumps(10.0, 10.0, 8.5, *[8.5 + 0.1 * k for k in range(20)], 11.9).errors == {}
    assert jumps(10.0, 8.5, 8.5, 7.0).errors == {"L": pytest.approx(error(-3.0))}


def test_a_wild_reading_is_no_jump() -> None:
    assert jumps(10.0, 7.0, 10.05, 10.05).errors == {}
    assert jumps(10.0, 7.0, 3.0, 9.9).errors == {}


def test_what_a_frozen_or_missing_reading_has_passed_by_is_no_jump() -> None:
    assert jumps(10.0, *[10.0] * 20, 8.0).errors == {}
    late = jumps(10.0)
    late.take("L", 8.0, 20.0)
    assert late.errors == {}


def test_a_jump_against_an_error_that_is_known_ends_it() -> None:
    found = jumps(9.0)
    found.correct([{"L": 1.0}, {"L": 1.5}])
    found.take("L", 8.05, 1.0)
    assert found.errors == {}
    for said in ([{"L": 1.0}, {}], [{"L": 1.0}, {"L": -1.0}], []):  # one explanation leaves the reading as it is
        found = jumps(9.0)
        found.correct(said)
        found.take("L", 8.0, 1.0)
        assert found.errors == {"L": pytest.approx(error(-1.0))}


@given(st.lists(st.floats(-0.25, 0.25), max_size=40))
def test_what_moves_as_the_process_can_never_jumps(moves: list[float]) -> None:
    level, readings = 10.0, [10.0]
    for move in moves:
        level += move
        readings.append(level)
    assert jumps(*readings).errors == {}


def test_a_limit_is_watched_as_if_the_reading_had_not_jumped() -> None:
    world = jumped()
    assert world.journal.of(ReadingJumped)[-1].by == pytest.approx(-8.0, abs=3.0)
    world.tick(4, T=300.0)
    assert not world.journal.of(Tripped)
    warms(world)  # it is 8 K more if the reading was right before
    tripped = world.journal.of(Tripped)
    assert tripped[0].limit == "LIM-HOT" and "has jumped" in tripped[0].reason


def test_what_trips_by_a_jump_alone_is_answered_in_the_order_of_the_tables() -> None:
    """Whoever ranked the fallbacks did so without it."""
    world = jumped()
    world.guard.mailbox.put(Arm(("close", "drain"), None))
    warms(world)
    assert world.journal.of(FallbackActivated)[0].strategy == RULES.fallbacks[0].name == "drain"


def test_the_order_that_a_jump_took_back_is_not_there_again_after_a_death() -> None:
    world = jumped(mode=Mode.ADVISE)
    world.guard.mailbox.put(Arm(("close", "drain"), None))
    warms(world)
    assert [e.named for e in world.journal.of(Armed)] == [True, False]
    again = killed(world, RULES)
    again.tick(2)
    assert again.guard._latch.fallbacks.armed == ""
    assert again.guard._latch.fallbacks.ranked == RULES.fallbacks


def test_no_diagnosis_lifts_what_a_jump_says() -> None:
    world = jumped()
    world.guard.mailbox.put(Correction(({"T": 5.0},)))
    warms(world)
    assert world.journal.of(Tripped)


def test_a_jump_is_remembered_over_a_death_and_forgotten_with_a_reset() -> None:
    world = jumped()
    world.tick(1)
    again = killed(world, RULES, 5.0)
    again.tick(3, T=300.0)
    warms(again)
    assert again.journal.of(Tripped)
    again.order(Verb.RESET, role=Role.ENGINEER, reason="the thermometer was changed")
    again.tick(3, T=304.0)
    assert again.guard.latched is None
    assert again.guard._parts.jumps.errors == {}


def test_what_trips_by_a_reading_is_answered_as_the_fallbacks_were_ranked() -> None:
    world = running()
    world.guard.mailbox.put(Arm(("close", "drain"), None))
    world.tick(1)
    for k in range(60):
        world.tick(1, T=305.0 + 0.3 * k)
    assert world.journal.of(FallbackActivated)[0].strategy == "close"


def test_what_jumps_while_the_plant_starts_is_forgotten() -> None:
    found = Jumps(RULES.qualities)
    watch = TripWatch(RULES, lambda event, at_s: None, found)
    watch.start_up.enter("waiting", 0.0)
    for at_s, state, left in ((1.0, "waiting", {}), (2.0, "running", {"T": -9.0})):
        found.remember({"T": -9.0})
        watch.judge(at_s, Snapshot(at_s, {"T": 300.0, "Tx": 300.0, "L": 4.0}), state)
        assert {tag: round(by) for tag, by in found.errors.items()} == ({} if not left else {"T": -10.0})
    high = watch.judge(3.0, Snapshot(3.0, {"T": 330.0, "Tx": 300.0, "L": 4.0}), "running")
    assert high and high[0].limit == "LIM-HOT" and not high[0].jumped and "jumped" not in high[0].reason


@pytest.mark.parametrize(("rule", "noise"), [(RULE, 0.08), (RULES.qualities["T"], 2.5)])
@pytest.mark.parametrize("seed", range(3))
def test_an_instrument_that_has_become_noisy_does_not_jump(rule: QualityRule, noise: float, seed: int) -> None:
    found, draw = Jumps({"L": rule}), np.random.default_rng(seed)
    for k in range(3000):
        found.take("L", 10.0 + draw.normal(0.0, (rule.noise or 0.0) if k < 500 else noise), float(k))
    assert found.errors == {}
