"""Trip limits: cumulative sums by hand, no false trips, and no diagnosis that disarms a limit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.events.trips import TripLifted
from homeostat.domain.plant.limits import Limit, LimitKind, Limits
from homeostat.domain.plant.rules import GuardRules, QualityRule, StartUp, TripRule
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.watch.quality import QualityWatch
from homeostat.guard.watch.trips import TripWatch
from homeostat.stl.formula import parse
from tests.guard.vessel import HOT, RULES, TAGS, limit, running

pytestmark = pytest.mark.quick

LIMIT = limit("LIM-HOT", LimitKind.TRIP_LIMIT, "T <= 313", hard=True)
RULE = TripRule("LIM-HOT", 8.0, 6.0, parse("Tx <= 311.5", TAGS), lift=10.0, lift_s=20.0)


HOT_BY_BALANCE = 312.0
"""What the carrier reads where it does not carry."""


class Watch:
    """A trip watch, ticked once per second, and what it has noted."""

    def __init__(self, rule: TripRule | None = RULE, **rules: Any) -> None:
        trips: Mapping[str, TripRule] = {} if rule is None else {rule.limit: rule}
        stated = {"limits": Limits((LIMIT,), ()), "trips": trips, "start_up": StartUp()} | rules
        self.noted: list[Any] = []
        self.rules: GuardRules = replace(RULES, **stated)
        self.watch = TripWatch(self.rules, lambda event, at_s: self.noted.append((at_s, event)))
        self.now_s = 0.0

    def judge(
        self, values: Mapping[str, float] | None, state: str = "running", uncertain: str = "", dt_s: float = 1.0
    ) -> tuple[str, ...]:
        self.now_s += dt_s
        self.last = None if values is None else Snapshot(self.now_s, values, uncertain=frozenset(uncertain.split()))
        return tuple(v.limit for v in self.watch.judge(self.now_s, self.last, state))


def hot(t: float, tx: float = 305.0) -> dict[str, float]:
    return {"T": t, "Tx": tx, "L": 8.0}


def filling(t: float) -> dict[str, float]:
    return hot(t) | {"L": 4.0}


def test_the_sum_of_violation_over_time_trips_at_what_the_table_allows() -> None:
    w = Watch()
    assert [w.judge(hot(315.0)) for _ in range(4)] == [()] * 4  # 2, 4, 6, 8 K s
    assert w.judge(hot(313.1)) == ("LIM-HOT",)


def test_time_inside_is_set_off_against_time_outside() -> None:
    w = Watch()
    for _ in range(20):
        assert w.judge(hot(316.0)) == w.judge(hot(316.0)) == w.judge(hot(307.0)) == ()
    assert w.judge(hot(317.0)) == w.judge(hot(317.0)) == ()
    assert w.judge(hot(313.1)) == ("LIM-HOT",)


@pytest.mark.parametrize(("dt_s", "ticks"), [(0.5, 9), (1.0, 5), (2.0, 3)])
def test_the_sum_counts_seconds_not_samples(dt_s: float, ticks: int) -> None:
    w = Watch()
    w.judge(hot(300.0), dt_s=dt_s)
    found = [w.judge(hot(315.0), dt_s=dt_s) for _ in range(ticks)]
    assert found == [()] * (ticks - 1) + [("LIM-HOT",)]


def test_one_reading_counts_for_five_seconds_at_most() -> None:
    w = Watch()
    w.judge(hot(300.0))
    assert w.judge(hot(314.0), dt_s=1000.0) == ()
    assert w.judge(hot(314.0), dt_s=1000.0) == ("LIM-HOT",)


def test_a_limit_without_allowance_or_without_rule_trips_at_once() -> None:
    for rule in (TripRule("LIM-HOT", 0.0, 0.0), None):
        w = Watch(rule)
        assert w.judge(hot(313.0)) == ()
        assert w.judge(hot(313.01)) == ("LIM-HOT",)
        assert w.judge(hot(312.0)) == w.judge(hot(312.0)) == ()


def test_a_violation_lasts_until_its_sum_is_gone() -> None:
    w = Watch()
    for _ in range(20):
        w.judge(hot(323.0))
    assert w.judge(hot(309.0)) == ("LIM-HOT",)  # the sum is at most 16: 12, 8, 4, 0
    assert [w.judge(hot(309.0)) for _ in range(3)] == [("LIM-HOT",), ("LIM-HOT",), ()]
    assert [w.judge(hot(315.0)) for _ in range(5)] == [()] * 4 + [("LIM-HOT",)]


def test_an_infinite_margin_trips_and_is_forgotten_again() -> None:
    never = Limit("LIM-HOT", LimitKind.TRIP_LIMIT, parse("false", TAGS), True, "", "")
    w = Watch(TripRule("LIM-HOT", 8.0, 6.0), limits=Limits((never,), ()))
    assert w.judge(hot(300.0)) == ("LIM-HOT",)
    ever = Limit("LIM-HOT", LimitKind.TRIP_LIMIT, parse("true", TAGS), True, "", "")
    w = Watch(TripRule("LIM-HOT", 8.0, 6.0), limits=Limits((ever,), ()))
    assert w.judge(hot(300.0)) == ()


@pytest.mark.parametrize("base", [290.0, 305.0, 311.0, 312.7])
@pytest.mark.parametrize("seed", range(5))
def test_a_step_of_three_kelvin_over_the_limit_trips_within_ten_seconds(base: float, seed: int) -> None:
    draw = np.random.default_rng(seed)
    quality = QualityWatch(
        {"T": QualityRule("T", 5.0, noise=0.5, frozen_s=10.0, fastest=0.5, grace_s=5.0), "Tx": QualityRule("Tx", 5.0)},
        TAGS, lambda event, at_s: None,
    )  # fmt: skip
    w = Watch()
    for n in range(1, 41):
        true = base if n <= 30 else 316.0
        w.now_s = n - 1.0
        seen = quality.assess(float(n), Snapshot(float(n), hot(true + draw.normal(0.0, 0.5))))
        assert seen is not None
        found = w.watch.judge(float(n), seen, "running")
        if found:
            assert n > 30
            return
    raise AssertionError("no trip within ten seconds")


def test_noise_below_the_limit_never_trips() -> None:
    """100 runs of 6000 s, the true value 0.3 K below the limit, noise 0.5 K: sums by hand, the watch on the worst."""
    readings = 312.7 + np.random.default_rng(1).normal(0.0, 0.5, (6000, 100))
    sums = np.zeros(100)
    worst = np.zeros(100)
    for row in readings:
        sums = np.maximum(0.0, sums + row - 313.0)
        worst = np.maximum(worst, sums)
    assert worst.max() < 8.0
    for run in np.argsort(worst)[-3:]:
        w = Watch()
        assert not any(w.judge(hot(t)) for t in readings[:, run])
        assert max(w.watch._watched["LIM-HOT"].raw, worst[run]) < 8.0


def test_blindness_trips_after_its_grace_and_not_before() -> None:
    w = Watch(replace(RULE, carrier=None))
    w.judge(hot(300.0))
    found = [w.judge(hot(math.nan)) for _ in range(8)]
    assert found == [()] * 6 + [("LIM-HOT",)] * 2
    assert w.judge(hot(300.0)) == ()
    assert [w.judge({"L": 8.0}) for _ in range(7)][-1] == ("LIM-HOT",)


def test_without_any_sample_a_limit_is_blind() -> None:
    w = Watch()
    assert [w.judge(None) for _ in range(7)] == [()] * 6 + [("LIM-HOT",)]


def test_blindness_is_counted_though_the_clock_stands() -> None:
    w = Watch()
    found = [w.judge(None, dt_s=0.0) for _ in range(7)]
    assert found == [()] * 6 + [("LIM-HOT",)]


def test_a_formula_that_is_none_for_a_point_makes_its_own_limit_blind_only() -> None:
    ahead = Limit("LIM-ODD", LimitKind.TRIP_LIMIT, parse("always[0,5](T <= 313)", TAGS), True, "", "")
    w = Watch(
        RULE, limits=Limits((ahead, LIMIT), ()), trips={"LIM-HOT": RULE, "LIM-ODD": TripRule("LIM-ODD", 1.0, 2.0)}
    )
    found = [w.judge(hot(316.0)) for _ in range(3)]
    assert found == [(), (), ("LIM-ODD", "LIM-HOT")]


def test_the_carrier_watches_while_a_reading_is_uncertain() -> None:
    w = Watch()
    for _ in range(6):
        assert w.judge(hot(340.0), uncertain="T") == ()
    assert w.judge(hot(340.0)) == ("LIM-HOT",)
    w = Watch()
    found = [w.judge(hot(300.0, tx=314.5), uncertain="T") for _ in range(3)]
    assert found == [(), (), ("LIM-HOT",)]


def test_what_carries_a_limit_trips_by_the_sum_that_the_limit_itself_would_trip_by() -> None:
    """The sum is 7, 0, 7, 0 K s where 8 are allowed; with one violation more in a row it is 14."""
    w = Watch()
    for k in range(6):
        assert w.judge(hot(312.0, 311.5 + (7.0 if k % 2 == 0 else -9.0)), uncertain="T") == ()
    w = Watch()
    assert w.judge(hot(312.0, 318.5), uncertain="T") == ()
    assert w.judge(hot(312.0, 318.5), uncertain="T") == ("LIM-HOT",)


def test_what_carries_a_limit_takes_back_what_it_has_shown_and_nothing_that_the_reading_has() -> None:
    w = Watch()
    assert w.judge(hot(318.0, 300.0)) == (), "the reading has shown 5 K s"
    assert w.judge(hot(318.0, 313.5), uncertain="T") == (), "and what carries it 2 more"
    assert w.judge(hot(318.0, 300.0), uncertain="T") == (), "which it takes back"
    assert w.judge(hot(318.0, 314.0), uncertain="T") == (), "5 + 2.5"
    assert w.judge(hot(318.0, 310.5), uncertain="T") == (), "5 + 1.5"
    assert w.judge(hot(318.0, 313.5), uncertain="T") == ("LIM-HOT",), "5 + 3.5"


def test_what_carries_a_limit_ends_no_trip() -> None:
    w = Watch()
    assert w.judge(hot(322.0)) == ("LIM-HOT",), "9 K s"
    for _ in range(5):
        assert w.judge(hot(322.0, 300.0), uncertain="T") == ("LIM-HOT",), "nobody has seen that it is over"
    assert w.judge(hot(309.0)) == ("LIM-HOT",) and w.judge(hot(307.0)) == (), "9 - 4 - 6"


@given(st.lists(st.floats(-12.0, 12.0), min_size=1, max_size=6))
def test_while_a_reading_is_not_believed_the_sum_is_that_of_what_carries_it(margins: list[float]) -> None:
    w, total = Watch(), 0.0
    for margin in margins:
        total = max(0.0, total - margin)
        tripped = w.judge(hot(312.0, 311.5 - margin), uncertain="T")
        assert abs(total - 8.0) < 1e-6 or bool(tripped) is (total > 8.0)
        if tripped:
            break


def test_a_carrier_that_good_readings_have_refuted_for_long_trips_nothing() -> None:
    w = Watch()
    for _ in range(61):
        assert w.judge(hot(300.0, tx=320.0)) == ()
    for _ in range(5):
        assert w.judge(hot(300.0, tx=320.0), uncertain="T") == ()
    for _ in range(61):  # it agrees with the readings again
        assert w.judge(hot(300.0, tx=300.0)) == ()
    assert [w.judge(hot(300.0, tx=320.0), uncertain="T") for _ in range(3)][-1] == ("LIM-HOT",)


def test_a_carrier_that_was_refuted_for_a_moment_still_watches() -> None:
    w = Watch()
    for _ in range(59):
        assert w.judge(hot(300.0, tx=320.0)) == ()
    assert [w.judge(hot(300.0, tx=320.0), uncertain="T") for _ in range(3)][-1] == ("LIM-HOT",)


def test_what_is_blind_with_a_refuted_carrier_trips_after_its_grace_time() -> None:
    w = Watch()
    for _ in range(100):
        w.judge(hot(300.0, tx=320.0))
    assert [w.judge(hot(math.nan, tx=320.0)) for _ in range(7)] == [()] * 6 + [("LIM-HOT",)]


@pytest.mark.parametrize("uncertain", ["T Tx", "T"])
def test_an_uncertain_reading_counts_where_nothing_carries_its_limit(uncertain: str) -> None:
    w = Watch() if "Tx" in uncertain else Watch(replace(RULE, carrier=None))
    found = [w.judge(hot(316.0), uncertain=uncertain) for _ in range(3)]
    assert found == [(), (), ("LIM-HOT",)]
    w = Watch()
    assert [w.judge(hot(316.0, tx=math.nan), uncertain="T") for _ in range(3)][-1] == ("LIM-HOT",)


def test_the_carrier_watches_while_a_limit_is_blind() -> None:
    w = Watch()
    assert [w.judge(hot(math.nan, tx=316.0)) for _ in range(2)] == [(), ("LIM-HOT",)]
    w = Watch()
    assert [w.judge(hot(math.nan)) for _ in range(7)][-1] == ("LIM-HOT",)


def test_a_correction_may_always_add_caution() -> None:
    w = Watch()
    w.watch.correct(({"T": -5.0}, {}))
    assert w.judge(hot(307.0, HOT_BY_BALANCE)) == ()
    assert [w.judge(hot(311.0, HOT_BY_BALANCE)) for _ in range(3)] == [(), (), ("LIM-HOT",)]
    w = Watch()
    w.watch.correct(({"T": math.nan}, {"T": math.inf}))
    assert [w.judge(hot(311.0)) for _ in range(10)] == [()] * 10


def lifted(w: Watch, ticks: int = 10, t: float = 320.0, tx: float = 305.0) -> list[tuple[str, ...]]:
    return [w.judge(hot(t, tx)) for _ in range(ticks)]


def test_a_correction_lifts_a_trip_where_the_carrier_carries_it() -> None:
    w = Watch()
    w.watch.correct(({"T": 8.0}, {"T": 9.0}))
    assert lifted(w) == [()] * 10
    assert [(at_s, e.limit, e.carrier) for at_s, e in w.noted] == [(2.0, "LIM-HOT", "Tx <= 311.5")]
    assert isinstance(w.noted[0][1], TripLifted) and w.noted[0][1].until_s == 22.0


def test_lifting_is_one_event_however_the_reading_wanders() -> None:
    w = Watch()
    w.watch.correct(({"T": 8.0},))
    for _ in range(6):
        assert lifted(w, 2) == [(), ()] and lifted(w, 1, t=312.9) == [()]
    assert len(w.noted) == 1


@pytest.mark.parametrize(
    ("errors", "tx"),
    [
        (({"T": 8.0}, {}), 305.0),  # the reading may be right
        (({"T": 8.0}, {"T": 1.0}), 305.0),  # under one explanation it violates all the same
        (({"T": 8.0}, {"T": 10.1}), 305.0),  # a larger correction than the table allows
        (({"T": 8.0},), 312.0),  # the carrier says that it is hot
        (({"T": 8.0},), math.nan),  # nothing carries it
        (({"T": 8.0, "Tx": -7.0},), 305.0),  # what carries it is doubted by the same diagnosis
        (({"L": 8.0},), 305.0),  # another instrument
    ],
)
def test_a_correction_lifts_nothing_where_it_should_not(errors: Any, tx: float) -> None:
    w = Watch()
    w.watch.correct(errors)
    assert lifted(w, 3, tx=tx)[-1] == ("LIM-HOT",)
    assert w.noted == []


def test_a_correction_at_its_bounds_lifts() -> None:
    w = Watch()
    w.watch.correct(({"T": 10.0},))
    assert lifted(w, 3, tx=311.5) == [()] * 3
    w = Watch(replace(RULE, carrier=None))
    w.watch.correct(({"T": 10.0},))
    assert lifted(w, 3)[-1] == ("LIM-HOT",)


def test_lifting_ends_after_the_time_of_the_table_also_with_breaks() -> None:
    w = Watch()
    w.watch.correct(({"T": 8.0},))
    found = lifted(w, 30)
    assert found.index(("LIM-HOT",)) == 21  # the second tick lifts first, and 20 s are allowed
    w = Watch()
    w.watch.correct(({"T": 8.0},))
    lifted(w, 12)
    lifted(w, 30, t=305.0)
    found = lifted(w, 12)
    assert found.index(("LIM-HOT",)) == 10
    assert [(at_s, e.kind) for at_s, e in w.noted] == [
        (2.0, "trip-lifted"), (14.0, "trip-lift-ended"), (44.0, "trip-lifted"),
    ]  # fmt: skip
    assert w.noted[1][1].used_s == 11.0


def test_too_many_explanations_are_turned_away() -> None:
    w = Watch()
    with pytest.raises(ValueError, match="101 explanations; at most 100"):
        w.watch.correct(({"T": 1.0},) * 101)
    w.watch.correct(({"T": 1.0},) * 100)
    w.watch.correct(())
    assert w.watch._errors == ({},)
    w.watch.correct((dict.fromkeys(TAGS, 1.0),))
    with pytest.raises(ValueError, match=r"more readings than there are tags \(7\)"):
        w.watch.correct(({}, dict.fromkeys([*TAGS, "Q"], 1.0)))


START = StartUp(frozenset({"waiting"}), {"LIM-HOT": limit("LIM-HOT", LimitKind.TRIP_LIMIT, "T <= 350", hard=True)})


def test_start_up_has_limits_of_its_own_and_only_there() -> None:
    w = Watch(start_up=START)
    assert [w.judge(filling(345.0), "waiting") for _ in range(9)] == [()] * 9
    assert [w.judge(filling(354.0), "waiting") for _ in range(3)] == [(), (), ("LIM-HOT",)]
    assert w.judge(hot(316.0), "running") == ()
    assert [w.judge(hot(316.0), "running") for _ in range(2)] == [(), ("LIM-HOT",)]


def test_start_up_forgets_no_sum_of_a_limit_that_is_the_same_in_it() -> None:
    w = Watch(start_up=StartUp(frozenset({"waiting"})))
    w.judge(hot(316.0), "waiting")
    w.judge(hot(316.0), "waiting")
    assert w.judge(hot(316.0), "running") == ("LIM-HOT",)


def test_the_carrier_of_the_limit_does_not_carry_that_of_start_up() -> None:
    w = Watch(start_up=START)
    assert [w.judge(filling(354.0), "waiting", uncertain="T") for _ in range(3)][-1] == ("LIM-HOT",)


def test_what_is_near_forbids_a_release_and_what_is_above_delays_it() -> None:
    w = Watch()
    w.judge(hot(313.5))
    assert w.last is not None and w.watch.near(w.last) == ()
    assert [v.margin for v in w.watch.above(w.last)] == [-0.5]
    w.judge(hot(316.5))  # 4 K s: half of what is allowed
    assert w.watch.near(w.last) == ()
    w.judge(hot(313.1))
    assert [v.limit for v in w.watch.near(w.last)] == ["LIM-HOT"]
    w.judge(hot(300.0))
    assert w.watch.near(w.last) == w.watch.above(w.last) == ()
    w.judge(hot(math.nan))
    assert "cannot be judged" in w.watch.near(w.last)[0].reason
    w.watch.correct(({"T": -5.0},))
    w.judge(hot(300.0))
    w.judge(hot(309.0))
    assert [v.limit for v in w.watch.above(w.last)] == ["LIM-HOT"]


def test_what_is_lifted_is_neither_near_nor_above() -> None:
    w = Watch()
    w.watch.correct(({"T": 8.0},))
    lifted(w, 4)
    assert w.last is not None and w.watch.near(w.last) == w.watch.above(w.last) == ()


def test_a_sentence_names_the_limit_the_margin_and_the_unit() -> None:
    w = Watch()
    for _ in range(5):
        w.judge(hot(315.0))
    (violation,) = w.watch.judge(6.0, Snapshot(6.0, hot(315.0)), "running")
    assert violation.margin == -2.0
    assert violation.reason == "What LIM-HOT protects: 'T <= 313' is violated by 2 K (LIM-HOT)"
    (violation,) = w.watch.judge(7.0, Snapshot(7.0, hot(312.0)), "running")
    assert violation.reason == "What LIM-HOT protects: 'T <= 313' was violated and holds by no more than 1 K (LIM-HOT)"
    assert HOT.name == violation.limit and violation.unit == "K"


def test_a_reading_that_is_uncertain_for_good_counts_after_the_grace_of_its_limit() -> None:
    world = running()
    for _ in range(30):
        sample = world.vessel.sample()
        hot = {**sample.values, "T": 330.0 + 0.01 * sample.at_s}
        doubted = Snapshot(
            sample.at_s, hot, uncertain=frozenset({"T"}), reasons={"T": "maintenance"}, accepted=sample.accepted
        )
        world.seen.append(world.guard.tick(sample.at_s, doubted))
    assert world.guard.latched is not None and "LIM-HOT" in world.guard.latched


@pytest.mark.parametrize(
    ("t", "tx", "refuted"),
    [
        (313.0, 313.0, False),  # a reading at its limit contradicts nothing
        (312.5, 313.0, True),
        (300.0, 311.2, False),  # a carrier within its limit is contradicted by nothing
        (300.0, 312.0, True),
    ],
)
def test_a_carrier_is_refuted_where_it_alone_says_that_the_limit_is_violated(
    t: float, tx: float, refuted: bool
) -> None:
    w = Watch()
    assert [w.judge(hot(t, tx)) for _ in range(70)] == [()] * 70
    assert w.judge(hot(math.nan, 321.0)) == (() if refuted else ("LIM-HOT",))


def being_lifted(w: Watch) -> Watch:
    """The reading is 5 K high, which a diagnosis says; its trip is lifted from the fifth tick on."""
    w.watch.correct(({"T": 5.0},))
    assert [w.judge(hot(315.0)) for _ in range(6)] == [()] * 6
    return w


def test_while_a_trip_is_lifted_what_carries_it_may_be_blind_for_the_grace_time() -> None:
    w = being_lifted(Watch())
    assert [w.judge(hot(315.0), uncertain="Tx") for _ in range(7)] == [()] * 6 + [("LIM-HOT",)]


def test_the_time_in_which_it_may_be_blind_comes_back_no_faster_than_it_was_used() -> None:
    w = being_lifted(Watch())
    assert [w.judge(hot(315.0), uncertain="Tx") for _ in range(4)] == [()] * 4
    assert [w.judge(hot(315.0)) for _ in range(2)] == [()] * 2
    assert [w.judge(hot(315.0), uncertain="Tx") for _ in range(5)] == [()] * 4 + [("LIM-HOT",)]


def test_what_is_blind_lifts_nothing() -> None:
    w = Watch()
    w.watch.correct(({"T": 5.0},))
    assert [w.judge(hot(315.0), uncertain="Tx") for _ in range(5)] == [()] * 4 + [("LIM-HOT",)]


def test_what_carries_a_lifted_limit_ends_that_as_the_limit_itself_would_trip() -> None:
    """It is violated by 0.5 K, 8 K s are allowed: by hand, the 17th tick trips. 5 K take two."""
    for tx, ticks in ((HOT_BY_BALANCE, 17), (316.5, 2)):
        w = being_lifted(Watch())
        assert [w.judge(hot(315.0, tx)) for _ in range(ticks)] == [()] * (ticks - 1) + [("LIM-HOT",)]


def test_one_noisy_reading_of_what_carries_a_lifted_limit_ends_nothing() -> None:
    w = being_lifted(Watch())
    for k in range(12):
        assert w.judge(hot(315.0, 312.5 if k % 3 == 0 else 311.0)) == ()


def test_time_that_was_blind_before_a_lift_is_not_used_up() -> None:
    w = Watch()
    for _ in range(20):
        w.judge(hot(310.0), uncertain="Tx")
    w = being_lifted(w)
    assert [w.judge(hot(315.0), uncertain="Tx") for _ in range(7)] == [()] * 6 + [("LIM-HOT",)]


def test_one_noisy_reading_of_a_lifted_limit_ends_nothing() -> None:
    """Corrected by 5 K it is violated by 1 K every other tick, and holds by 1 K between them: nothing adds up."""
    w = being_lifted(Watch())
    assert [w.judge(hot(319.0 if k % 2 else 317.0)) for k in range(12)] == [()] * 12


@pytest.mark.parametrize(("t", "ticks"), [(320.0, 5), (319.0, 9), (322.1, 2)])
def test_a_limit_that_is_violated_as_it_is_corrected_trips_by_its_own_sum(t: float, ticks: int) -> None:
    """By hand: of 8 K s that are allowed, 2 K use 2 in a second, so that the fifth trips."""
    w = being_lifted(Watch())
    assert [w.judge(hot(t)) for _ in range(ticks)] == [()] * (ticks - 1) + [("LIM-HOT",)]


@pytest.mark.parametrize("errors", [({"L": 8.0},), ({"T": 8.0}, {"L": 8.0}), ({"T": -1.0},)])
def test_what_corrects_no_reading_of_a_limit_lifts_nothing_of_it(errors: Any) -> None:
    """A violation that was doubted counts as a whole once it is believed; no sum that begins then may hide that."""
    w = Watch()
    assert [w.judge(hot(315.0), uncertain="T") for _ in range(6)] == [()] * 6
    w.watch.correct(errors)
    assert w.judge(hot(315.0)) == ("LIM-HOT",)
    assert w.noted == []
