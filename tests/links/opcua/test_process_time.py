"""Process time of a link: it never stands and never runs back, whatever the plant's clock says."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.plant.timing import Timing
from homeostat.links.opcua.reading.process_time import ProcessTime

told = (
    st.none()
    | st.floats(-1e9, 1e9)
    | st.sampled_from([float("nan"), float("inf"), -float("inf"), 1e17, -1e17, 1e300, 1.7e308, -1.7e308])
)
ticks = st.lists(st.tuples(st.booleans(), told, st.floats(0.0, 100.0)), min_size=1, max_size=60)


@given(ticks=ticks, pace=st.floats(0.1, 100.0), tick_s=st.sampled_from([0.1, 0.5, 1.0, 10.0]))
def test_time_never_runs_back_and_every_sample_is_later(
    ticks: list[tuple[bool, float | None, float]], pace: float, tick_s: float
) -> None:
    time, at_s = ProcessTime(pace, Timing(tick_s)), 0.0
    before_s = 0.0
    for there, told_s, passed_s in ticks:
        at_s += passed_s
        now_s = time.sample(told_s, at_s) if there else time.absent(at_s)
        if now_s is None:
            assert there, "a sample of a tick that was there already"
            continue
        assert now_s > before_s if there else now_s >= before_s
        assert now_s == time.now_s and abs(now_s / tick_s - round(now_s / tick_s)) < 1e-3
        before_s = now_s


def test_it_is_the_plants_as_long_as_that_goes_on() -> None:
    time = ProcessTime(5.0)
    assert [time.sample(float(t), t / 5.0) for t in range(40, 50)] == [float(t) for t in range(40, 50)]


def test_a_plant_that_begins_again_is_followed_from_there() -> None:
    time = ProcessTime(1.0)
    for t in range(100, 110):
        time.sample(float(t), float(t))
    assert [time.sample(float(t), 110.0 + t) for t in (1, 2, 3)] == [110.0, 111.0, 112.0]


@pytest.mark.parametrize("wild_s", [1e6, 1e9, 1e17, 1e300, 1.7e308])
def test_one_wild_reading_of_the_plants_clock_ends_no_deadline_and_no_time(wild_s: float) -> None:
    time = ProcessTime(1.0)
    found = [time.sample(wild_s if t == 5 else float(t), float(t)) for t in range(1, 10)]
    assert found == [float(t) for t in range(1, 10)]


def test_it_goes_on_by_our_own_clock_while_nothing_comes() -> None:
    time = ProcessTime(5.0)
    assert time.absent(0.0) == 0.0
    time.sample(10.0, 2.0)
    assert [time.absent(2.0 + wait) for wait in (0.1, 0.2, 1.0)] == [10.0, 11.0, 15.0]
    assert time.sample(12.0, 3.1) == 16.0, "later than what was said already"


def test_without_the_plants_clock_ours_counts() -> None:
    time = ProcessTime(2.0)
    found = [time.sample(None, 100.0 + 0.5 * k) for k in range(5)]
    assert all(b - a == pytest.approx(1.0) for a, b in itertools.pairwise(found))


def test_a_plant_that_says_nothing_gives_no_more_samples_than_our_clock_has_ticks() -> None:
    time = ProcessTime(1.0)
    found = [time.sample(None, 0.25 * k) for k in range(41)]
    told = [at_s for at_s in found if at_s is not None]
    assert told == sorted(set(told)) and 10 <= len(told) <= 12 and told[-1] <= 12.0


def test_what_a_network_delays_is_no_tick_more_and_none_less() -> None:
    time, late = ProcessTime(1.0), (0.0, 0.3, -0.3, 0.3, -0.3, 0.2, -0.2, 0.0)
    found = [time.sample(None, 50.0 + k + late[k % 8]) for k in range(200)]
    assert found == [float(k + 1) for k in range(200)]


def test_a_clock_of_the_plant_that_goes_in_quarters_of_a_tick_gives_one_sample_a_tick() -> None:
    time = ProcessTime(1.0)
    found = [time.sample(100.0 + 0.25 * k, 0.25 * k) for k in range(41)]
    told = [at_s for at_s in found if at_s is not None]
    assert told == [100.0 + k for k in range(11)]


def test_a_clock_of_the_plant_that_stands_is_left_for_ours() -> None:
    time = ProcessTime(1.0)
    found = [time.sample(7.0, float(k)) for k in range(12)]
    assert found[0] == 7.0 and found[1] is None
    told = [at_s for at_s in found[2:] if at_s is not None]
    assert len(told) == 10 and told[-1] - told[0] == 9.0


def test_samples_that_came_together_are_told_one_by_one() -> None:
    time = ProcessTime(5.0)
    found = [time.sample(None, 10.0 + publish, 4 - k) for publish in range(3) for k in range(5)]
    told = [at_s for at_s in found if at_s is not None]
    assert told[-10:] == [told[-10] + k for k in range(10)]


def test_what_is_on_its_way_is_not_missing_yet() -> None:
    time = ProcessTime(5.0, publish_s=0.5)
    time.sample(10.0, 2.0)
    assert time.absent(2.4) == 10.0 and time.sample(11.0, 2.5) == 11.0 and time.absent(4.0) == 16.0
