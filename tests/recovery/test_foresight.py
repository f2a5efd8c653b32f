"""What people are told of a rollout: bands that no member leaves, and times that no member beats."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.events.foresight import Foreseen
from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.snapshot import Trajectory
from homeostat.domain.verdict import Rollout, RolloutResult
from homeostat.journal.encode import canonical, encode_fields
from homeostat.record.decode import made_of
from homeostat.recovery.look.foresight import INTERVALS, foreseen
from tests.recovery.desk import DOOMED, late
from tests.recovery.line import GOOD
from tests.safety.world import HOT, LIMITS, rule

WARM = rule("ENV-WARM", LimitKind.ENVELOPE, "T <= 312", hard=False)
FROM_S, DT_S = 100.0, 2.0


def rollout(values: list[list[float]], weights: list[float] | None = None) -> Rollout:
    """Members that show these temperatures, one every :data:`DT_S`."""
    course = Trajectory(FROM_S, DT_S, {"T": np.array(values, dtype=float)})
    worth = tuple(weights or [1.0 / len(values)] * len(values))
    return Rollout("d", course, (Hypothesis((), 1.0),), worth, RolloutResult.COMPLETED)


def test_the_first_limit_has_its_spread_over_the_members_that_reach_it() -> None:
    told = foreseen(rollout([[310, 314, 314], [310, 310, 314], [310, 310, 310]], [0.5, 0.2, 0.3]), Limits((HOT,), ()))
    assert told.first is not None
    assert (told.first.members, told.first.probability) == (2, pytest.approx(0.7))
    assert (told.first.earliest_s, told.first.middle_s, told.first.latest_s) == (2.0, 2.0, 4.0)
    assert (told.from_s, told.length_s, told.members, told.digest) == (FROM_S, 4.0, 3, "")


def test_a_limit_that_has_a_price_is_told_and_is_not_the_first_hard_one() -> None:
    told = foreseen(rollout([[310, 312.5, 312.5]]), Limits((HOT, WARM), ()))
    assert told.first is None and [r.limit for r in told.reached] == ["ENV-WARM"]


def test_a_hard_limit_counts_where_it_trips() -> None:
    early = dataclasses.replace(HOT, lead=1.0)
    assert foreseen(rollout([[310, 312.5]]), Limits((early,), ())).first is not None
    assert foreseen(rollout([[310, 312.5]]), Limits((HOT,), ())).first is None


def test_a_twin_that_cannot_say_says_so() -> None:
    broken = dataclasses.replace(rollout([[310, 310]]), result=RolloutResult.BROKE_DOWN, note="member 3 at 4 s")
    told = foreseen(broken, LIMITS)
    assert (told.members, told.first, told.bands, told.note) == (0, None, (), "member 3 at 4 s")


def test_what_is_undecided_is_reached_and_has_no_band() -> None:
    told = foreseen(rollout([[310, math.nan]]), Limits((HOT,), ()))
    assert told.first is not None and told.first.earliest_s == 2.0 and told.bands == ()


members = st.lists(st.floats(250.0, 400.0), min_size=2, max_size=120)


@given(st.integers(1, 5).flatmap(lambda n: members.flatmap(lambda m: st.just([[v + k for v in m] for k in range(n)]))))
def test_no_member_leaves_its_band_and_none_is_sooner(values: list[list[float]]) -> None:
    told = foreseen(rollout(values), Limits((HOT,), ()))
    (band,) = told.bands
    assert len(band.low) == len(band.high) == len(told.ends_s) <= INTERVALS and told.ends_s[-1] == told.length_s
    for member in values:
        for k, value in enumerate(member):
            interval = next(n for n, end in enumerate(told.ends_s) if k * DT_S <= end)
            assert band.low[interval] - 0.01 <= value <= band.high[interval] + 0.01
    hot = [k * DT_S for member in values for k, value in enumerate(member) if value > 313.0]
    assert (told.first.earliest_s if told.first else math.inf) == min(hot, default=math.inf)


def test_it_comes_back_from_a_journal_as_it_was() -> None:
    told = foreseen(rollout([[310, 314], [310, 310]]), Limits((HOT, WARM), ()), "digest")
    fields = json.loads(canonical(encode_fields(told, "foreseen")))
    assert made_of(Foreseen, fields) == told


def test_it_is_told_before_anything_is_asked_of_a_person() -> None:
    done = late(DOOMED).run()
    assert [f.digest for f in done.trace.of(Foreseen)] == ["", GOOD.digest]
    assert done.kinds.index("released") > max(n for n, kind in enumerate(done.kinds) if kind == "foreseen")
