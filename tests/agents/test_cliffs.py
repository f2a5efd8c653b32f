"""Cliffs: where few members violate by much what the search's own members kept, a little more margin is tried."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from homeostat.agents.checks import judge, target_finding, violating
from homeostat.agents.language.situation import margin_text
from homeostat.agents.search.reprompting import CURABLE, FEW, GROWTH, STEP, TRIES, MarginReprompting
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.plant.limits import Owner
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import REPEATED, Finding, Revise, Violating
from homeostat.record.story.wording import worst
from tests.agents.stuck_valve import QUICK, now, search
from tests.agents.test_postponed import hot
from tests.agents.test_search import reduce
from tests.safety.world import ACTIONS, LIMITS, MEMBERS, RUNNING, TAGS, rollout

SCALES = {"K": 2.0}
DEEP = -60.0
"""Thirty scales: it has boiled over [K]."""
REACHED = "TARGET-reduced_load"


def found(
    members: int, margin: float = DEEP, owner: Owner = Owner.ACTION, name: str = "LIM-HOT", share: float | None = None
) -> Finding:
    """A criterion that so many of 24 members violate."""
    told = Violating(members, 24, members / 24 if share is None else share)
    return Finding(name, owner, margin, "K", 90.0, 3, f"{name} by {margin}", None, told)


HELD = {"LIM-HOT": 5.0, "ACC-T": 7.0}
"""Margins that the search's own members had [K]."""


def advise(
    *findings: Finding, before: Advice | None = None, seen: Mapping[str, float] = MappingProxyType({})
) -> Advice:
    attempt = Attempt(1, reduce(), ActionSet((), "reduced_load"), Revise(findings))
    reprompting = MarginReprompting(SCALES, lambda actions: seen)
    return asyncio.run(reprompting.advise(now(), attempt, before or Advice()))


def is_closed(advice: Advice) -> bool:
    assert (advice.keep_path is None) is (advice.refused_paths == (reduce().commanded,))
    return advice.keep_path is None


# --- what is asked for ------------------------------------------------------------------------------------------


def test_one_member_that_falls_keeps_the_path_and_asks_for_a_step_more() -> None:
    advice = advise(found(1))
    assert not is_closed(advice) and advice.tries == 1 and dict(advice.required) == {"LIM-HOT": STEP * 2.0}


def test_it_is_asked_for_beyond_what_the_search_had_already() -> None:
    """Its own members are far from the edge: asking for less than they have gives the same proposal again."""
    first = advise(found(1), seen=HELD)
    assert dict(first.required) == {"LIM-HOT": 5.0 + STEP * 2.0}
    second = advise(found(1), before=first, seen=HELD | {"LIM-HOT": 6.0})
    assert dict(second.required) == {"LIM-HOT": 6.0 + STEP * 2.0 * GROWTH}
    assert dict(advise(found(1), seen={"LIM-HOT": math.inf}).required) == {"LIM-HOT": STEP * 2.0}


def test_each_try_asks_for_twice_as_much_more_until_the_tries_are_over() -> None:
    advice, asked = Advice(), []
    for _ in range(TRIES):
        advice = advise(found(1), before=advice)
        asked.append(dict(advice.required).get("LIM-HOT"))
    assert asked == [pytest.approx(STEP * 2.0 * k) for k in (1, 3, 7, 15)] + [None]
    assert is_closed(advice), "however few they are, there is an end"


def test_what_is_asked_for_does_not_depend_on_how_far_they_fall() -> None:
    assert advise(found(1, -1e9)).required == advise(found(1, -1.0 - 1e-6)).required


def test_a_small_violation_beside_a_cliff_is_asked_for_as_ever() -> None:
    wanted = dict(advise(found(1), found(20, -0.8, name="ACC-T")).required)
    assert wanted == {"LIM-HOT": STEP * 2.0, "ACC-T": pytest.approx(1.3 * 0.8)}


def test_what_only_another_path_cures_is_cured_by_margin_where_few_violate_it() -> None:
    """The product is scalded, and the state is not reached, in the member that boils over."""
    beside = found(1, -1e-3, Owner.PLANNING, "ACC-T"), found(1, -3.0, Owner.PLANNING, REACHED)
    assert not is_closed(advise(found(1), *beside))


# --- what is hopeless is closed at once -------------------------------------------------------------------------

ABOVE = math.nextafter(FEW, 1.0)


@pytest.mark.parametrize(("share", "closed"), [(1 / 24, False), (FEW, False), (ABOVE, True), (0.5, True), (1.0, True)])
def test_what_many_members_violate_by_much_closes_the_path(share: float, closed: bool) -> None:
    """By weight: one member of an explanation that is as good as sure is not few."""
    assert is_closed(advise(found(1, share=share))) is closed


@pytest.mark.parametrize(
    "findings",
    [
        (found(24),),
        (found(1), found(24, name="ACC-T")),
        (found(1), found(24, -1e-3, Owner.PLANNING)),
        (found(1, -math.inf),),
        (replace(found(1), violating=None),),
        (found(1, -3.0, Owner.PLANNING, REACHED),),
    ],
    ids=["all", "all of another one", "another path cures it", "undecided", "nobody knows who", "not reached alone"],
)
def test_what_no_margin_cures_closes_the_path_at_once(findings: tuple[Finding, ...]) -> None:
    assert is_closed(advise(*findings)) and advise(*findings).required == ()


def test_what_the_search_saw_itself_closes_the_path() -> None:
    """It looked for something better among all that the path admits, and there was nothing."""
    for bad in (-1e-9, -math.inf, math.nan):
        assert is_closed(advise(found(1), seen=HELD | {"ACC-T": bad}))
    small = found(1, -CURABLE)
    assert not is_closed(advise(small, seen=HELD | {"LIM-HOT": -0.1})), "a small violation is asked for as ever"


def test_a_search_that_has_nothing_else_to_say_closes_the_path() -> None:
    asked, again = advise(found(1), seen=HELD), found(0, -math.inf, name=REPEATED)
    assert is_closed(advise(again, before=asked, seen=HELD))
    assert not is_closed(advise(again, before=advise(found(1, -0.1)))), "a small violation is asked for as ever"


def test_a_path_that_leaves_nothing_open_is_closed() -> None:
    machine = reduce().machine
    states = tuple(replace(s, setpoints=tuple(r for r in s.setpoints if r.low == r.high)) for s in machine.states)
    fixed = RecoveryPath(replace(machine, states=states), reduce().transitions)
    attempt = Attempt(1, fixed, ActionSet((), "reduced_load"), Revise((found(1),)))
    advice = asyncio.run(MarginReprompting(SCALES).advise(now(), attempt, Advice()))
    assert advice.keep_path is None and advice.refused_paths == (fixed.commanded,)


# --- a valve that is to be opened far enough --------------------------------------------------------------------

NEEDS = np.append(np.linspace(0.40, 0.5, 23), 0.51)
"""Opening at which each member does not boil over; the search sees all but the last one."""


def attempts(needs: np.ndarray[tuple[int], np.dtype[np.float64]], seen: int = 23) -> tuple[int, float | None]:
    """Attempts until the verdict is an approval or the path is closed, and the opening that is approved.

    A margin of one scale, 2 K, is an opening of 0.1 beyond what a member needs; below that it boils over.
    """
    advice, number = Advice(), 0
    while True:
        number += 1
        wanted = 0.08 + dict(advice.required).get("LIM-HOT", 0.0) / 2.0
        opening = min(float(needs[:seen].max()) + 0.1 * wanted, 1.0)
        falls = needs > opening
        if not falls.any():
            return number, opening
        told = Violating(int(falls.sum()), len(needs), float(falls.mean()))
        had = {"LIM-HOT": DEEP if falls[:seen].any() else 20.0 * (opening - float(needs[:seen].max()))}
        advice = advise(replace(found(1), violating=told), before=advice, seen=had)
        if is_closed(advice):
            return number, None


def test_a_valve_is_opened_a_little_further_where_one_member_of_many_boils_over() -> None:
    number, opening = attempts(NEEDS)
    assert number == 2 and opening == pytest.approx(0.531, abs=1e-3)
    assert attempts(np.append(NEEDS[:-1], 0.56))[0] == 3


def test_a_path_on_which_everybody_boils_over_costs_one_attempt() -> None:
    assert attempts(np.full(24, 2.0)) == (1, None)
    assert attempts(np.append(np.full(12, 0.4), np.full(12, 2.0)), seen=12) == (1, None)


def test_a_member_that_no_opening_helps_costs_the_tries_and_no_more() -> None:
    assert attempts(np.append(NEEDS[:-1], 2.0)) == (TRIES, None)


# --- who violates it --------------------------------------------------------------------------------------------


def test_members_are_counted_by_number_and_by_weight() -> None:
    margins = np.array([[1.0, 1.0], [1.0, -1.0], [math.nan, 1.0], [0.0, 0.0]])
    some = violating(margins, (0.7, 0.1, 0.1, 0.1))
    assert some is not None and (some.members, some.of) == (2, 4) and some.share == pytest.approx(0.2)
    assert violating(margins[:, 0], (2.0, 2.0, 2.0, 2.0)) == Violating(1, 4, 0.25), "weights need not add up to 1"


def test_where_nobody_violates_it_or_nobody_knows_their_weights_nothing_is_said() -> None:
    assert violating(np.array([0.0, 1.0]), (0.5, 0.5)) is None
    assert violating(np.array([-1.0, 1.0]), ()) is None


def test_what_reads_commands_alone_is_the_same_in_every_member() -> None:
    assert violating(np.array([[-1.0]]), (0.2, 0.8)) == Violating(2, 2, 1.0)


def test_a_judgement_says_in_how_many_members_each_limit_is_violated() -> None:
    verdict = judge(ACTIONS, hot(ACTIONS, (1, 0), (1, 4), kelvin=340.0), LIMITS, RUNNING, TAGS)
    assert isinstance(verdict, Revise)
    told = {f.criterion: f.violating for f in verdict.findings}
    one = Violating(1, MEMBERS, 1 / 3)
    assert told == {"LIM-HOT": one, "ACC-CALM": one, "PRM-FEED": None, "TARGET-running": None}
    assert any("by 27 K at 0 s in 1 of 3 members (LIM-HOT)" in f.message for f in verdict.violated)


def test_members_that_do_not_take_every_step_are_counted() -> None:
    late = replace(rollout(), steps_left=(0, 2, 1))
    assert target_finding(late, RUNNING).violating == Violating(2, 3, 2 / 3)
    astray = rollout(at=(2, 11), F_sp=0.0)
    assert target_finding(astray, RUNNING).violating == Violating(1, 3, 1 / 3)


# --- how it is told ---------------------------------------------------------------------------------------------


def test_a_model_reads_in_how_many_members_it_is_where_some_hold() -> None:
    assert margin_text(found(1)) == "LIM-HOT -60 K at 90 s in 1 of 24 members"
    assert margin_text(found(24)) == "LIM-HOT -60 K at 90 s"
    assert margin_text(replace(found(1), violating=None)) == "LIM-HOT -60 K at 90 s", "as in older journals"


def test_so_does_a_person() -> None:
    assert worst((found(1),), SCALES) == "worst margin -60 K in 1 of 24 members (LIM-HOT)"
    assert worst((replace(found(1), violating=None),), SCALES) == "worst margin -60 K (LIM-HOT)"


# --- what the search knows of its own members -------------------------------------------------------------------


def test_the_search_knows_what_margins_its_own_members_had() -> None:
    """A valve that is stuck nearly closed is not compensated for by any setpoint, and is held elsewhere than tried."""
    machine, action = reduce().machine, search(QUICK)
    hopeless = RecoveryPath(machine, (next(t for t in machine.transitions if t.name == "t_compensate"),))
    kept, violated = (asyncio.run(action.act(now(), path, Advice())) for path in (reduce(), hopeless))
    seen = action.margins(violated)
    assert seen["ACC-T-HIGH"] < 0.0
    asyncio.run(action.act(now(), reduce(), Advice()))
    assert min(action.margins(kept).values()) >= 0.0 and action.margins(kept).keys() == seen.keys()
    assert action.margins(replace(kept, target="holding")) == {}, "nobody tried that"


@pytest.mark.parametrize(("had", "before"), [(0.7, 0.0), (0.7, 0.4), (0.1, 0.5), (-math.inf, 0.5), (math.nan, 0.5)])
def test_what_is_missing_a_little_is_asked_for_beyond_what_the_search_s_own_members_had(
    had: float, before: float
) -> None:
    """Of 128 members one is 0.4 K too hot, and the search's own had 0.7 K: asking for 0.52 K gives the same again."""
    asked = Advice(required=(("LIM-HOT", before),))
    wanted = dict(advise(found(1, -0.4), before=asked, seen={"LIM-HOT": had}).required)["LIM-HOT"]
    assert wanted == pytest.approx(max(before, had if math.isfinite(had) else 0.0) + 1.3 * 0.4)


@pytest.mark.parametrize(("second", "wanted"), [(-40.0, 9.0 + 1.3 * 40.0), (-58.5, 9.0 + 0.6), (-70.0, 9.0 + 0.6)])
def test_a_fall_that_becomes_less_by_what_was_given_is_no_cliff(second: float, wanted: float) -> None:
    """5 K were had and 0.3 K more asked for; 9 K came, and 4 K more keep the worst by 20 K, by 1.5 K, or not at all."""
    first = advise(found(1, DEEP), seen={"LIM-HOT": 5.0})
    assert dict(first.required)["LIM-HOT"] == pytest.approx(5.3)
    then = advise(found(1, second), before=first, seen={"LIM-HOT": 9.0})
    assert dict(then.required)["LIM-HOT"] == pytest.approx(wanted)
