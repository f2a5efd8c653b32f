"""Links that lie: each misreading, by itself and in time."""

from __future__ import annotations

import math

import pytest

from homeostat.domain.snapshot import Quality, Snapshot
from homeostat.links.errors import LinkError
from tests.contracts.link import equal
from tests.equipment.links.misbehaving.readings import (
    ALL,
    BadReading,
    BrokenReading,
    Freeze,
    Lie,
    Marked,
    Missing,
    NoReadBack,
    NotANumber,
    OldValues,
    Silence,
    StuckClock,
    WrongClock,
)
from tests.links.tank import misbehaving

T = frozenset({"T"})


def both(bad: BadReading, seconds: int = 40) -> tuple[list[Snapshot | None], list[Snapshot]]:
    """Samples of a link with ``bad``, and of one without."""
    wrong, right = misbehaving(bad)[0], misbehaving()[1]
    return [wrong.advance() for _ in range(seconds)], [right.advance() for _ in range(seconds)]


def same(a: Snapshot | None, b: Snapshot) -> bool:
    if a is None or a.values.keys() != b.values.keys():
        return False
    same_values = all(equal(v, b.values[tag]) for tag, v in a.values.items())
    return same_values and (a.at_s, a.bad, a.taken_s, a.accepted) == (b.at_s, b.bad, b.taken_s, b.accepted)


@pytest.mark.parametrize(
    "bad",
    [
        Silence(10.0, 20.0), Freeze(T, 10.0, 20.0), Freeze(ALL, 10.0, 20.0), Lie("T", 5.0, 10.0, 20.0),
        NotANumber(T, 10.0, 20.0), Missing(T, 10.0, 20.0), Marked(T, 10.0, 20.0), OldValues(T, 10.0, 20.0),
        StuckClock(10.0, 20.0), WrongClock(-5.0, 10.0, 20.0), NoReadBack(ALL, 10.0, 20.0),
    ],
)  # fmt: skip
def test_it_holds_from_its_beginning_to_its_end_and_no_longer(bad: BadReading) -> None:
    wrong, right = both(bad)
    assert [same(a, b) for a, b in zip(wrong, right, strict=True)] == [not 10.0 <= s.at_s < 20.0 for s in right]


def during(bad: BadReading) -> tuple[list[Snapshot], list[Snapshot]]:
    """Samples from 10 s on, with and without ``bad``."""
    wrong, right = both(bad)
    return [s for s in wrong[9:] if s is not None], right[9:]


def test_silence_is_the_absence_of_samples_while_time_goes_on() -> None:
    link, _ = misbehaving(Silence(10.0))
    found = [link.advance() for _ in range(40)]
    assert found[8] is not None and found[9:] == [None] * 31 and link.now_s == 40.0


def test_reading_that_breaks_raises_while_time_goes_on() -> None:
    link, _ = misbehaving(BrokenReading(2.0, 3.0))
    link.advance()
    with pytest.raises(LinkError, match=r"t = 2 s"):
        link.advance()
    sample = link.advance()
    assert sample is not None and sample.at_s == 3.0


def test_frozen_values_are_the_last_ones_before() -> None:
    wrong, right = both(Freeze(T, 10.0))
    assert all(s is not None and s.values["T"] == right[8].values["T"] for s in wrong[9:])
    assert all(s is not None and s.values["L"] == r.values["L"] for s, r in zip(wrong, right, strict=True))


def test_what_is_frozen_from_the_start_holds_the_first_sample() -> None:
    wrong, right = both(Freeze(ALL, 0.0))
    assert all(s is not None and s.values["T"] == right[0].values["T"] for s in wrong)


def test_a_lie_is_a_bias() -> None:
    wrong, right = during(Lie("T", 5.0, 10.0))
    assert all(a.values["T"] == b.values["T"] + 5.0 for a, b in zip(wrong, right, strict=True))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_no_number_comes_without_a_mark(value: float) -> None:
    wrong, _ = during(NotANumber(T, 10.0, value=value))
    assert all(equal(s.values["T"], value) and not s.bad for s in wrong)


def test_missing_tags_are_not_there() -> None:
    assert all(set(s.values) == {"L", "L.sp", "cool.man"} for s in during(Missing(T, 10.0))[0])
    assert all(not s.values for s in during(Missing(ALL, 10.0))[0])


def test_marks_leave_the_number_and_give_a_reason() -> None:
    wrong, right = during(Marked(T, 10.0))
    assert all(a.values["T"] == b.values["T"] and a.bad == T for a, b in zip(wrong, right, strict=True))
    assert all(s.reasons == {"T": "sensor failure"} for s in wrong)
    uncertain, _ = during(Marked(T, 10.0, quality=Quality.UNCERTAIN))
    assert all(s.uncertain == T and not s.bad for s in uncertain)


def test_old_values_say_when_they_were_taken() -> None:
    wrong, _ = during(OldValues(T, 10.0))
    assert all(s.taken_s == {"T": 9.0} for s in wrong) and len({s.values["T"] for s in wrong}) == 1
    assert [s.at_s for s in wrong] == [float(t) for t in range(10, 41)]


def test_clocks_stand_still_or_go_astray() -> None:
    assert {s.at_s for s in during(StuckClock(10.0))[0]} == {9.0}
    assert [s.at_s for s in during(WrongClock(-5.0, 10.0))[0]] == [float(t) for t in range(5, 36)]
    assert all(math.isnan(s.at_s) for s in during(WrongClock(math.nan, 10.0))[0])


def test_targets_are_not_read_back() -> None:
    assert all(s.accepted == {"cool.man": None} for s in during(NoReadBack(frozenset({"L.sp"}), 10.0))[0])


def test_misreadings_act_together_in_the_order_of_their_beginning() -> None:
    link, _ = misbehaving(Freeze(T, 12.0), Lie("T", 5.0, 10.0), Lie("T", 7.0, 15.0), WrongClock(-1.0, 16.0))
    found = [link.advance() for _ in range(20)]
    held, last = found[10], found[-1]
    assert held is not None and last is not None
    assert last.values["T"] == held.values["T"] - 5.0 + 7.0, "the lie came before the freeze, which held the truth"
    assert last.at_s == 19.0
