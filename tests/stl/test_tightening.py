"""Tightened rules: every margin is less by what was asked, whatever a rule is made of."""

from __future__ import annotations

import math

import numpy as np
import pytest

from homeostat.domain.plant.tag import Range, Role, Tag
from homeostat.stl.formula import parse
from homeostat.stl.tightening import tightened

pytestmark = pytest.mark.quick

TAGS = {
    "T": Tag("T", Role.PV, "K", Range(270.0, 380.0), 1.0),
    "L": Tag("L", Role.PV, "L", Range(-2.0, 14.0), 0.2),
}
RULES = [
    "T <= 313", "T >= -3", "T < 300 and T > 290", "T <= 313 or T >= 350", "not (T <= 313)", "T == 300",
    "T <= 300 implies T >= 290", "T >= 290 or L <= 3", "not (T >= 310 and L >= 3)", "abs(L) <= 3 - L",
]  # fmt: skip


@pytest.mark.parametrize("text", RULES)
@pytest.mark.parametrize("by", [0.5, 4.0])
def test_every_margin_is_less_by_as_much(text: str, by: float) -> None:
    rule = parse(text, TAGS)
    tight, draw = tightened(rule, by), np.random.default_rng(1)
    for _ in range(50):
        values = {"T": float(draw.uniform(270.0, 380.0)), "L": float(draw.uniform(-2.0, 14.0))}
        assert tight.margin_at(values) == pytest.approx(rule.margin_at(values) - by)
    assert tight.unit == rule.unit and tight.tags == rule.tags


def test_nothing_to_tighten_is_the_rule_itself() -> None:
    rule = parse("T <= 313", TAGS)
    assert tightened(rule, 0.0) is rule


def test_what_is_undecided_or_always_true_stays_so() -> None:
    assert math.isnan(tightened(parse("T <= 313", TAGS), 2.0).margin_at({}))
    assert tightened(parse("true"), 2.0).margin_at({}) == math.inf


def test_a_rule_over_time_is_tightened_at_every_sample() -> None:
    rule = parse("always[0,3] (T <= 313) or eventually[0,2] (T >= 340)", TAGS)
    signals = {"T": np.linspace(300.0, 345.0, 10)[None]}
    assert np.allclose(tightened(rule, 2.0).margins(signals, 1.0), rule.margins(signals, 1.0) - 2.0)
