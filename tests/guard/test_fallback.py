"""The strategies of the fallback: their order, what of each may be written, and why one may not act."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.recovery import Effect
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.fallback.fallback import Chosen, Fallbacks
from tests.guard.vessel import CLOSE, DRAIN, RULES

pytestmark = pytest.mark.quick

ALL = frozenset(RULES.writables)
READY = Snapshot(1.0, {"L": 8.0, "F.sp": 0.0, "X.cmd": 1.0})


def names(fallbacks: Fallbacks) -> list[str]:
    return [s.name for s in fallbacks.ranked]


def test_each_strategy_is_taken_once_in_its_order_until_somebody_begins_again() -> None:
    fallbacks = Fallbacks(RULES)
    assert [fallbacks.take() for _ in range(4)] == [DRAIN, CLOSE, None, None]
    fallbacks.begin()
    assert fallbacks.take() == DRAIN


@pytest.mark.parametrize(
    ("asked", "ranked", "wrong"),
    [
        ((), ["drain", "close"], ()),
        (("close",), ["close", "drain"], ()),
        (("close", "drain"), ["close", "drain"], ()),
        (("close", "close", "drain"), ["close", "drain"], ()),
        (("nonsense", "close"), ["close", "drain"], ("there is no fallback 'nonsense'",)),
    ],
)
def test_who_ranks_some_strategies_loses_none(
    asked: tuple[str, ...], ranked: list[str], wrong: tuple[str, ...]
) -> None:
    fallbacks = Fallbacks(RULES)
    assert fallbacks.arm(asked, READY, ALL) == wrong and names(fallbacks) == ranked
    assert [s.name for s in iter(fallbacks.take, None) if s is not None] == ranked


def test_a_strategy_that_fails_its_checks_now_is_named_and_keeps_its_place() -> None:
    fallbacks = Fallbacks(RULES)
    wrong = fallbacks.arm(("close", "drain"), READY, frozenset({"V.man"}))
    assert wrong == ("close: every tag that it writes is out of service",) and names(fallbacks) == ["close", "drain"]


@pytest.mark.parametrize(
    ("in_service", "forced", "kept"),
    [
        (ALL, frozenset(), ["X.cmd", "F.sp", "V.man"]),
        (frozenset({"F.sp"}), frozenset(), ["F.sp"]),
        (frozenset({"F.sp"}), frozenset({"X.cmd"}), ["X.cmd", "F.sp"]),
        (frozenset(), frozenset({"X.cmd"}), ["X.cmd"]),
        (frozenset({"T.sp"}), frozenset(), []),
    ],
)
def test_a_tag_that_is_out_of_service_is_left_out_unless_the_strategy_forces_it(
    in_service: frozenset[str], forced: frozenset[str], kept: list[str]
) -> None:
    strategy = replace(DRAIN, forced=forced)
    chosen = Fallbacks(RULES).checked(strategy, None, in_service)
    if not kept:
        assert chosen == "every tag that it writes is out of service"
        return
    assert isinstance(chosen, Chosen) and chosen.strategy == strategy
    assert [c.tag for c in chosen.actions.commands] == kept and chosen.actions.target == "shut"


@pytest.mark.parametrize(
    ("error", "why"), [(RuntimeError("it is void"), "it is void"), (RuntimeError(), "RuntimeError")]
)
def test_a_strategy_that_cannot_be_checked_says_why(error: Exception, why: str) -> None:
    class Void(dict[str, Any]):
        def __contains__(self, name: object) -> bool:
            raise error

    odd = replace(CLOSE, waived=Void())
    fed = Snapshot(1.0, {"L": 8.0, "F.sp": 0.03, "X.cmd": 1.0})
    chosen = Fallbacks(RULES).checked(odd, fed, frozenset({"X.cmd"}))  # PRM-OPEN: the feed would go on
    assert chosen == f"it cannot be checked: {why}"


def test_a_strategy_that_is_named_begins_and_the_others_follow_in_their_order() -> None:
    third = replace(CLOSE, name="third")
    fallbacks = Fallbacks(replace(RULES, fallbacks=(DRAIN, CLOSE, third)))
    fallbacks.take()
    fallbacks.begin("third")
    assert [fallbacks.take() for _ in range(4)] == [third, DRAIN, CLOSE, None]
    fallbacks.begin("third", tried=frozenset({"third", "drain"}))
    assert [fallbacks.take() for _ in range(3)] == [third, CLOSE, None]
    fallbacks.begin("nonsense")
    assert fallbacks.take() == DRAIN and names(fallbacks) == ["drain", "close", "third"]


def test_what_brings_most_of_the_limits_back_is_taken_first_and_what_was_spent_never() -> None:
    hot, both = {"LIM-HOT": Effect(5.0)}, {"LIM-HOT": Effect(5.0), "LIM-FULL": Effect(5.0)}
    rules = replace(RULES, fallbacks=(DRAIN, replace(CLOSE, serves=hot), replace(CLOSE, name="third", serves=both)))
    fallbacks = Fallbacks(rules)

    def taken(*limits: str) -> list[str]:
        fallbacks.begin()
        return [s.name for s in iter(lambda: fallbacks.take(frozenset(limits)), None) if s is not None]

    assert taken() == ["drain", "close", "third"] and taken("LIM-OTHER") == ["drain", "close", "third"]
    assert taken("LIM-HOT") == ["close", "third", "drain"]
    assert taken("LIM-HOT", "LIM-FULL") == ["third", "close", "drain"]
    fallbacks.begin()
    assert fallbacks.take(frozenset({"LIM-HOT"}), frozenset({"LIM-FULL"})) == rules.fallbacks[2]
    fallbacks.spend("third")
    fallbacks.spend("drain")
    assert taken("LIM-HOT", "LIM-FULL") == ["close"] and fallbacks.spent == {"drain", "third"}
