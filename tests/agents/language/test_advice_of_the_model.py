"""The model's own advice: asked for only where no rule fits, and its failure costs nothing but time."""

from __future__ import annotations

import math
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.language.prompt_files import PROMPTS
from homeostat.agents.language.reprompting import known_hint
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.plant.limits import Owner
from homeostat.domain.verdict import Revise
from homeostat.llm.model import Failure, ModelError
from tests.agents.language.test_reprompting import ACTIONS, PATH, Desk, attempt, feed, finding, keeps

HINTS = tomllib.loads(PROMPTS.joinpath("hints.toml").read_text("utf-8"))
BROKE_DOWN = Attempt(1, PATH, ACTIONS, Revise((finding(-math.inf, "CHK-ROLLOUT", unit="1"),)), 0)
"""The twin left the physical world: nothing to compute a sensitivity from, and no rule of thumb."""


@pytest.mark.parametrize("name", HINTS)
def test_a_finding_that_has_a_rule_gets_its_hint(name: str) -> None:
    exact = name.removesuffix("-") + ("-whatever" if name.endswith("-") else "")
    assert known_hint((finding(-1.0, exact),)) == HINTS[name]
    assert known_hint((finding(-1.0, "ACC-T-HIGH"), finding(-1.0, exact))) == HINTS[name]
    assert known_hint((finding(-1.0, f"X{exact}"),)) == ""


def test_the_first_finding_with_a_rule_counts() -> None:
    assert known_hint((finding(-1.0, "PRM-FEED"), finding(-1.0, "CHK-RANGE"))) == HINTS["PRM-"]
    assert known_hint(()) == "" and known_hint((finding(-1.0),)) == ""


@pytest.mark.parametrize("name", ["CHK-RANGE", "CHK-RATE", "TARGET-reduced_load", "PRM-COOL", "CHK-ANSWER"])
def test_where_a_rule_fits_the_model_is_not_asked(name: str) -> None:
    desk = Desk()
    advice = desk.advise(attempt(finding(-0.1, name)))
    assert advice.hint and desk.model.asked == []


def test_where_a_command_moves_the_margin_the_model_is_not_asked() -> None:
    desk = Desk(feed(-1e-9))
    assert desk.advise(attempt(finding(-1.0))).hint == "" and desk.model.asked == []


@pytest.mark.parametrize("desk", [Desk(), Desk(feed(0.0))], ids=["no slope", "a slope of zero"])
def test_where_no_rule_fits_the_model_is_asked_once(desk: Desk) -> None:
    advice = desk.advise(attempt(finding(-1.0)))
    (question,) = desk.model.asked
    assert question.agent == "reprompting" and "ACC-T-HIGH -1 K" in question.prompt
    assert "F1.sp=0.03" in question.prompt, "it sees the attempt that it is asked about"
    assert advice.hint == "move the command with the largest effect"


def test_the_model_s_hint_and_route_are_taken() -> None:
    for route, kept in (("action", True), ("planning", False)):
        advice = Desk(answer=f'{{"route": "{route}", "hint": "colder"}}').advise(BROKE_DOWN)
        assert keeps(advice) is kept and advice.hint == "colder"


def test_the_model_cannot_keep_a_path_that_the_rules_give_up() -> None:
    desk = Desk(answer='{"route": "action", "hint": "again"}')
    for after, before in (
        (attempt(finding(-1.0, owner=Owner.PLANNING)), Advice()),
        (BROKE_DOWN, Advice(tries=3)),
        (attempt(finding(-1.0)), Advice()),
    ):
        assert not keeps(desk.advise(after, before))
    assert len(desk.model.asked) == 3


@pytest.mark.parametrize("failure", list(Failure))
def test_where_the_model_fails_the_rules_decide(failure: Failure) -> None:
    advice = Desk(answer=ModelError(failure)).advise(BROKE_DOWN)
    assert keeps(advice) and advice.hint == "" and advice.findings == BROKE_DOWN.verdict.findings
    assert not keeps(Desk(answer=ModelError(failure)).advise(attempt(finding(-1.0))))


@given(st.text(max_size=60) | st.sampled_from(
    ["", "{}", "null", '{"route": "gate", "hint": ""}', '{"route": "action"}', '{"route": "action", "hint": 1}',
     '{"route": "action", "hint": "' + "x" * 300 + '"}']
))  # fmt: skip
def test_whatever_the_model_says_instead_the_rules_decide(answer: str) -> None:
    advice = Desk(answer=answer).advise(BROKE_DOWN)
    assert keeps(advice) and advice.hint == ""
