"""Alternatives: the cheapest that is admitted, what was refused and why, and leaving alone among them."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.certificates import Course
from homeostat.agents.roles import Approved
from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.certificate import Certificate
from homeostat.domain.cost import PRODUCT, Cost, CostItem
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Approve
from homeostat.recovery.alternatives import Alternatives
from homeostat.recovery.choices import Waiting
from homeostat.recovery.worth_asking import AnswerTimes
from homeostat.twin.twin import Interruption
from tests.recovery.line import HALF, LIMITS, MACHINE, feed, priced

WORTH = 10.0
PRICES = priced(LIMITS)
RELEASE = PRICES.release
"""A release [EUR]."""
HORIZON_S = WORTH / PRICES.worth(1.0)
"""How long the line takes to make that much [s]."""
REDUCE = RecoveryPath(MACHINE, tuple(t for t in MACHINE.transitions if t.name == "reduce"))


def costs(amount: float) -> Cost:
    return Cost((CostItem(PRODUCT, amount),), WORTH)


def found(amount: float, by: str = "search", rate: float = HALF) -> Approved:
    actions = feed(rate, "reduced")
    return Approved(actions, REDUCE, Approve(actions.digest, ()), by, costs(amount))


def left(amount: float, refused: str = "") -> Alternative:
    return Alternative(AlternativeKind.LEAVE, "running", costs(amount), refused)


RESTING = Course(ActionSet((), "running"))
FELL = Alternative(AlternativeKind.FALLBACK, "drain", costs(9.0), "it acts where nothing else may be done")


def listed(*proposals: Approved, given: tuple[Alternative, ...] = ()) -> Alternatives:
    made = Alternatives([(one, RESTING) for one in given], PRICES)
    for one in proposals:
        made.add(one)
    return made


def test_the_cheapest_is_the_best_and_of_equals_the_first() -> None:
    dear, cheap, as_cheap = found(3.0), found(1.0, "second"), found(1.0, "third")
    assert listed(dear, cheap, as_cheap).best is cheap
    assert listed().best is None


@pytest.mark.parametrize(("leaving", "wins"), [(0.9, True), (1.0, True), (1.1, False), (math.inf, False)])
def test_leaving_the_plant_alone_wins_where_it_costs_no_more(leaving: float, wins: bool) -> None:
    assert (listed(found(1.0), given=(left(leaving),)).best is None) is wins


def test_what_may_not_be_left_alone_does_not_win_however_cheap() -> None:
    hot = left(0.0, "'T <= 313' is violated")
    made = listed(found(3.0), given=(hot, FELL))
    assert made.leave is None and made.best is not None


def test_a_fallback_is_no_proposal() -> None:
    cheap = Alternative(AlternativeKind.FALLBACK, "drain", costs(0.0))
    assert listed(given=(cheap,)).best is None and listed(found(5.0), given=(cheap,)).best is not None


def test_what_was_refused_is_followed_by_the_next_best() -> None:
    cheap, next_best, dear = found(1.0), found(2.0, "second"), found(3.0)
    made = listed(dear, cheap, next_best)
    for expected in (cheap, next_best, dear):
        assert made.best is expected
        made.refuse(expected, "not now")
    assert made.best is None


def test_only_that_one_is_refused_even_where_another_one_is_equal() -> None:
    one, same = found(1.0), found(1.0)
    made = listed(one, same)
    made.refuse(one, "not now")
    assert made.best is same


def test_a_wait_that_was_refused_stands_in_the_list_once() -> None:
    ended = Interruption(45.0, ActionSet((), "running"))
    wait = Waiting(45.0, "running > reduced", "w", Approve("w", ()), "search", costs(1.0), ended)
    made = listed(found(2.0))
    made.add(wait)
    made.refuse(wait, "not now")
    made.add(replace(wait))
    assert made.best is not None and not isinstance(made.best, Waiting)
    assert [a.kind for a in made.event("").alternatives].count(AlternativeKind.WAIT) == 1


def test_what_cannot_be_judged_never_wins_over_leaving_alone() -> None:
    assert listed(found(math.inf), given=(left(math.inf),)).best is None
    assert listed(found(math.inf), given=(left(5.0),)).best is None


def test_what_an_answer_may_win_and_what_is_lost_until_it_is_there() -> None:
    """The best costs 3 EUR, leaving alone 7: 4 EUR more over the horizon, and nothing costs less than a release."""
    worth = listed(found(3.0), given=(left(7.0, "too hot"),)).worth()
    assert worth is not None
    assert worth.gain == pytest.approx(3.0 - RELEASE) and worth.lost_per_s * HORIZON_S == pytest.approx(4.0)
    limit_s = HORIZON_S * (3.0 - RELEASE) / 4.0
    assert worth.longest_s == pytest.approx(limit_s)
    assert worth.pays(0.999 * limit_s) and not worth.pays(1.001 * limit_s)


def test_where_nothing_is_approved_any_answer_is_worth_waiting_for() -> None:
    assert listed().worth() is None
    assert listed(found(0.4), given=(left(0.3),)).worth() is None, "it costs more than leaving alone"


def test_what_costs_a_release_and_nothing_else_cannot_be_bettered() -> None:
    worth = listed(found(RELEASE), given=(left(RELEASE - 0.1, "too hot"),)).worth()
    assert worth is not None and not worth.pays(0.0), "although waiting costs nothing"


def test_a_test_move_on_offer_may_win_what_it_is_worth_besides() -> None:
    made = listed(found(RELEASE), given=(left(5.0, "too hot"),))
    worth = made.worth(test=0.1)
    assert worth is not None and worth.gain == pytest.approx(0.1 * WORTH)


@pytest.mark.parametrize("leaving", [math.inf, -math.inf, math.nan])
def test_what_nobody_can_say_of_leaving_alone_ends_nothing(leaving: float) -> None:
    for lines in ((left(leaving, "too hot"),), ()):
        worth = listed(found(3.0), given=lines).worth()
        assert worth is not None and worth.pays(1e9) and worth.longest_s == math.inf


costly, taking = st.floats(0.0, 50.0), st.floats(0.0, 1e4)


@given(st.lists(costly, min_size=1), costly, taking, taking)
def test_whoever_takes_longer_is_never_waited_for_where_a_quicker_one_is_not(
    proposals: list[float], leaving: float, one_s: float, other_s: float
) -> None:
    worth = listed(*map(found, proposals), given=(left(leaving, "too hot"),)).worth()
    assert worth is not None
    quick, slow = sorted((one_s, other_s))
    assert worth.pays(quick) or not worth.pays(slow)
    assert worth.gain <= min(proposals) and worth.gain >= 0.0 and worth.lost_per_s >= 0.0


@given(st.lists(costly, min_size=1), costly, costly, taking)
def test_a_better_one_that_is_found_never_makes_anybody_wait_longer(
    proposals: list[float], another: float, leaving: float, answer_s: float
) -> None:
    alone = (left(leaving, "too hot"),)
    before = listed(*map(found, proposals), given=alone).worth()
    after = listed(*map(found, [*proposals, another]), given=alone).worth()
    assert before is not None and after is not None
    assert before.pays(answer_s) or not after.pays(answer_s)


@given(st.lists(st.tuples(st.sampled_from("ab"), st.floats(0.0, 600.0))))
def test_an_answer_is_expected_to_take_as_long_as_those_of_the_same_proposer_did(
    answers: list[tuple[str, float]],
) -> None:
    times = AnswerTimes()
    for name, seconds in answers:
        times.took(name, seconds)
    for name in "ab":
        own = [seconds for by, seconds in answers if by == name]
        assert times.expected_s(name) == pytest.approx(sum(own) / len(own) if own else 0.0)


def test_the_list_begins_anew_with_what_may_be_done_without_a_proposal() -> None:
    first = listed(found(1.0), given=(left(2.0), FELL))
    anew = first.anew()
    assert anew.best is None and anew.leave == left(2.0) and anew.event("").alternatives == (left(2.0), FELL)
    assert first.best is not None


def test_the_event_has_all_of_it_with_reasons_the_cheapest_first() -> None:
    cheap, dear = found(1.0), found(3.0, "second", HALF / 2)
    made = listed(dear, cheap, given=(left(2.0, "too hot"), FELL))
    made.refuse(cheap, "the valve is out of service")
    event = made.event(dear.actions.digest)
    assert (event.currency, event.chosen) == ("EUR", dear.actions.digest)
    assert [(a.kind, a.proposer, a.cost.total, a.refused) for a in event.alternatives] == [
        (AlternativeKind.RELEASE, "search", 1.0, "the valve is out of service"),
        (AlternativeKind.LEAVE, "", 2.0, "too hot"),
        (AlternativeKind.RELEASE, "second", 3.0, ""),
        (AlternativeKind.FALLBACK, "", 9.0, "it acts where nothing else may be done"),
    ]
    assert [a.name for a in event.alternatives] == ["running > reduced", "running", "running > reduced", "drain"]
    assert event.alternatives[2].digest == dear.actions.digest


def test_each_alternative_is_certified_once() -> None:
    cheap, dear, left_alone = found(1.0), found(3.0, "second", HALF / 2), left(2.0)
    made = listed(dear, given=(left_alone, FELL))
    rest = ActionSet((), "running")
    assert made.uncertified(rest) == [RESTING, RESTING, Course(dear.actions)]
    first = [Certificate(64, k, 0.1 * k, 0.95) for k in (3, 2)]
    made.certify([*first, None])
    made.add(cheap)
    assert made.uncertified(rest) == [Course(dear.actions), Course(cheap.actions)], "what has none is asked for again"
    later = [Certificate(64, k, 0.1 * k, 0.95) for k in (1, 0)]
    made.certify(later)
    assert [a.certificate for a in made.event("").alternatives] == [later[1], first[0], later[0], first[1]]
    made.refuse(cheap, "not now")
    assert made.uncertified(rest) == []
    anew = made.anew()
    assert anew.uncertified(rest) == [RESTING, RESTING], "what was drawn is of where the plant stood"
    assert [a.certificate for a in anew.event("").alternatives] == [None, None]


def test_what_goes_on_by_itself_is_what_goes_on_when_it_is_asked() -> None:
    made = Alternatives([(left(2.0), None), (FELL, RESTING)], PRICES)
    later = feed(HALF, "reduced")
    assert made.uncertified(later) == [Course(later), RESTING]


amounts = st.floats(-5.0, 20.0)


@given(st.lists(st.tuples(amounts, st.booleans())), amounts, st.booleans())
def test_nothing_that_is_admitted_is_ever_cheaper_than_what_is_chosen(
    proposals: list[tuple[float, bool]], leaving: float, may_be_left: bool
) -> None:
    made = listed(given=(left(leaving, "" if may_be_left else "too hot"), FELL))
    for amount, refused in proposals:
        one = found(amount)
        made.add(one)
        if refused:
            made.refuse(one, "not now")
    admitted = [amount for amount, refused in proposals if not refused]
    best = made.best
    if best is not None:
        assert best.cost.total == min(admitted) and not (may_be_left and leaving <= best.cost.total)
    else:
        assert not admitted or (may_be_left and leaving <= min(admitted))
