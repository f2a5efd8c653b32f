"""Authority: who may order what, how long an order counts, and who is the same person."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.mode import Mode, Role, Verb
from homeostat.guard.requests.authority import Authority
from homeostat.guard.settings import GuardSettings
from tests.guard.test_orders import order, reason
from tests.guard.test_people import tell
from tests.guard.vessel import running


def test_the_last_ten_thousand_orders_are_remembered() -> None:
    authority = Authority(1, 600.0, 60.0)
    authority.remember(f"o{k}" for k in range(10_000))
    assert authority.objection(order(0)) == "order 'o0' was answered already"
    authority.remember(("o10000",))
    assert authority.objection(order(0)) == ""
    assert "already" in authority.objection(order(1)) and "already" in authority.objection(order(10_000))


def test_names_and_reasons_are_as_long_as_they_may_be_and_no_longer() -> None:
    authority = Authority(1, 600.0, 60.0)
    for name, most in {"id": 200, "person": 200, "subject": 200, "digest": 500, "reason": 500}.items():
        assert authority.objection(replace(order(1), **{name: "x" * most})) == ""
        assert authority.objection(replace(order(1), **{name: "x" * (most + 1)})) == (
            "an order has names of at most 200 characters and a reason of at most 500"
        )


@pytest.mark.parametrize(
    ("age_s", "why"),
    [
        (0.0, ""), (0, ""), (0.5, ""), (60.0, ""),
        (60.001, "the order is 60.001 s old and counts for 60 s; give it again"),
        (86400.0, "the order is 86400 s old and counts for 60 s; give it again"),
        (math.inf, "the order is inf s old and counts for 60 s; give it again"),
        (math.nan, "the order is nan s old and counts for 60 s; give it again"),
        (-0.001, "the order was issued 0.001 s in the future; set the clocks and give it again"),
        (-math.inf, "the order was issued inf s in the future; set the clocks and give it again"),
        ("1", "the age of an order is a number of seconds, not of type 'str'"),
        (True, "the age of an order is a number of seconds, not of type 'bool'"),
        (None, "the age of an order is a number of seconds, not of type 'NoneType'"),
    ],
)  # fmt: skip
def test_an_order_counts_for_so_long_and_not_before_it_was_issued(age_s: Any, why: str) -> None:
    assert Authority(1, 600.0, 60.0).objection(replace(order(1), age_s=age_s)) == why
    world = running()
    assert tell(world, Verb.OUT_OF_SERVICE, "T.sp", reason="repair", age_s=age_s).done == (not why)
    assert world.guard.out_of_service == (frozenset() if why else {"T.sp"})


def test_how_long_an_order_counts_is_a_setting() -> None:
    world = running(settings=GuardSettings(order_s=5.0, sync_s=5.0))
    assert reason(world, Verb.OUT_OF_SERVICE, "T.sp", reason="r", age_s=5.1) == (
        "the order is 5.1 s old and counts for 5 s; give it again"
    )
    assert tell(world, Verb.OUT_OF_SERVICE, "T.sp", reason="r", age_s=5.0).done


def test_what_is_no_plain_text_is_named() -> None:
    said = Authority(1, 600.0, 60.0).objection
    given: Any = Mode.OBSERVE
    for name, what in {"id": "identifier", "person": "person", "subject": "subject", "digest": "digest"}.items():
        assert said(replace(order(1), **{name: given})) == f"the {what} of an order is a plain text, not of type 'Mode'"
    assert said(replace(order(1), reason=None)) == "the reason of an order is a plain text, not of type 'NoneType'"  # type: ignore[arg-type]


def test_an_order_is_refused_for_the_first_thing_that_is_wrong_with_it() -> None:
    said = Authority(1, 600.0, 60.0).objection
    assert (
        said(replace(order(1), id=""))
        == said(replace(order(1), person=" "))
        == ("an order needs an identifier and the name of a person")
    )
    for verb in (Verb.RESET, Verb.MODE, Verb.START):
        plain = replace(order(1), verb=verb, subject="observe", role=Role.OPERATOR)
        assert said(plain) == f"only an engineer may order {verb.value!r}"
        assert said(replace(plain, role=Role.ENGINEER)) == ""
    for verb in (Verb.RESET, Verb.REJECT, Verb.OUT_OF_SERVICE, Verb.FALL_BACK):
        assert said(replace(order(1), verb=verb, reason=" ")) == f"{verb.value!r} needs a reason"
    for verb in (Verb.APPROVE, Verb.IN_SERVICE, Verb.ACKNOWLEDGE, Verb.START):
        assert said(replace(order(1), verb=verb, reason="")) == ""
    assert said(replace(order(1), verb=Verb.MODE, subject="manual")) == (
        "there is no mode 'manual'; there are observe, advise, approve, closed-loop"
    )
    assert said(replace(order(1), verb="reset")) == "there is no order 'reset' in role 'engineer'"  # type: ignore[arg-type]
    assert said(replace(order(1), role="boss")) == "there is no order 'reset' in role 'boss'"  # type: ignore[arg-type]


def test_the_word_of_a_person_holds_as_long_as_it_may_and_no_longer() -> None:
    authority = Authority(2, 20.0, 60.0)
    assert authority.agree(order(1, "Ada"), 100.0) == ()
    assert authority.agree(order(2, "Bo"), 120.0) == ("Ada", "Bo")
    assert authority.agree(order(3, "Cy"), 121.0) == ()  # what was agreed is used up
    assert authority.agree(order(4, "Bo"), 141.5) == ()
    assert authority.agree(order(5, "bo "), 150.0) == ()  # said again
    assert authority.agree(order(6, "Ada"), 170.0) == ("bo ", "Ada")


@pytest.mark.parametrize(
    "same",
    ["Ada\u200b", "\u00adAda", "A\u2060da", "Ada\ufeff", "Ada\u202e", "A\x00da", "Ada\u3164", "A\u034fda", "Ada\ufe0f",
     " ADA\t", "A d\u00a0a", "\uff21\uff44\uff41", "Ada\u2028"],
)  # fmt: skip
def test_a_name_with_what_nobody_sees_is_the_same_person(same: str) -> None:
    authority = Authority(2, 20.0, 60.0)
    assert authority.agree(order(1, "Ada"), 100.0) == () == authority.agree(order(2, same), 101.0)
    assert authority.agree(order(3, "Bo"), 102.0) == (same, "Bo")


def test_spellings_of_a_letter_are_the_same_person() -> None:
    authority = Authority(2, 20.0, 60.0)
    for person in ("Ji\u0159\u00ed", "Jir\u030ci\u0301", "JI\u0158I\u0301", "Jir\u034f\u030c\u200di\u0301"):
        assert authority.agree(order(1, person), 100.0) == ()
    assert authority.agree(order(2, "Jiri"), 100.0), "an accent is seen"


@pytest.mark.parametrize("nothing", ["\u200b", "\u00ad \u3164", "\x00", "\t\n"])
def test_a_name_or_a_reason_that_shows_nothing_is_none(nothing: str) -> None:
    said = Authority(1, 600.0, 60.0).objection
    assert said(replace(order(1), person=nothing)) == "an order needs an identifier and the name of a person"
    assert said(replace(order(1), reason=nothing)) == "'reset' needs a reason"


def test_of_the_name_of_a_type_forty_characters_are_said() -> None:
    odd: Any = type("x" * 60, (), {})()
    for spoilt in (replace(order(1), age_s=odd), replace(order(1), reason=odd)):
        assert Authority(1, 600.0, 60.0).objection(spoilt).endswith(f"not of type {'x' * 40!r}")
