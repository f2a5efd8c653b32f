"""Reach: what the commands of a path can cure together, against an exhaustive search and by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.agents.language.reach import HALF, best_together, curable
from homeostat.domain.advice import Sensitivity
from homeostat.domain.plant.limits import Owner
from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.domain.verdict import Finding
from homeostat.stl.formula import parse
from tests.safety.world import TAGS

TARGET = State(
    "running", "Running", 1, False, True, parse("F.sp >= 0.01", TAGS), frozenset(),
    (SetpointRange("F.sp", 0.0, 0.05, 0.03), SetpointRange("T.sp", 300.0, 320.0, 310.0),
     SetpointRange("V.man", 0.0, 1.0, None)),
)  # fmt: skip
VALUES = {"F.sp": 0.03, "T.sp": 310.0, "V.man": None}
SCALES = {"K": 25.0}


def finding(name: str, margin: float) -> Finding:
    return Finding(name, Owner.ACTION, margin, "K", 10.0, 0, name)


def cured(findings: list[Finding], *slopes: tuple[str, str, float]) -> bool:
    return curable(findings, [Sensitivity(*s) for s in slopes], VALUES, TARGET.open_setpoints, SCALES)


@pytest.mark.parametrize(("tag", "slope", "way"), [("T.sp", 1.0, 10.0), ("F.sp", 100.0, 0.02), ("F.sp", -100.0, 0.03)])
def test_a_command_goes_to_the_end_of_its_range_and_no_farther(tag: str, slope: float, way: float) -> None:
    most = abs(slope) * way / HALF
    assert cured([finding("HOT", -0.95 * most)], ("HOT", tag, slope))
    assert not cured([finding("HOT", -1.05 * most)], ("HOT", tag, slope))


def test_several_commands_add_up() -> None:
    both = ("HOT", "T.sp", 1.0), ("HOT", "F.sp", 100.0)
    assert cured([finding("HOT", -11.9 / HALF)], *both) and not cured([finding("HOT", -12.1 / HALF)], *both)


def test_what_one_margin_wins_another_must_not_lose() -> None:
    """Up for the one, down for the other: each alone is within reach."""
    up, down = finding("COLD", -10.0), finding("HOT", -10.0)
    slopes = ("COLD", "T.sp", 1.0), ("HOT", "T.sp", -1.0)
    assert cured([up], *slopes) and cured([down], *slopes)
    assert not cured([up, down], *slopes)
    assert cured([up, down], *slopes, ("HOT", "F.sp", -500.0)), "unless another command makes up for it"


def test_what_holds_only_just_must_go_on_holding() -> None:
    slopes = ("COLD", "T.sp", 1.0), ("HOT", "T.sp", -1.0)
    assert cured([finding("COLD", -10.0), finding("HOT", 5.1)], *slopes)
    assert not cured([finding("COLD", -10.0), finding("HOT", 4.9)], *slopes)


def test_what_does_not_move_says_nothing() -> None:
    assert cured([finding("HOT", -1.0), finding("STILL", -1.0)], ("HOT", "T.sp", 1.0), ("STILL", "T.sp", 0.0))
    assert not cured([finding("STILL", -1.0)], ("STILL", "T.sp", 0.0))
    assert not cured([finding("STILL", -1.0)])


def test_another_answer_can_cure_a_refusal() -> None:
    assert cured([finding("CHK-ANSWER", -math.inf)])
    assert not cured([finding("CHK-ANSWER", -math.inf), finding("HOT", -1.0)])
    assert not cured([finding("HOT", -math.inf)], ("HOT", "T.sp", 1.0))


def test_large_violations_are_looked_at_one_by_one() -> None:
    """Far from a limit a slope says little about how two margins go together."""
    slopes = ("COLD", "T.sp", 10.0), ("HOT", "T.sp", -10.0)
    assert cured([finding("COLD", -30.0), finding("HOT", -30.0)], *slopes)
    assert not cured([finding("COLD", -20.0), finding("HOT", -20.0)], *slopes)
    assert not cured([finding("COLD", -30.0), finding("HOT", -201.0)], *slopes)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6))
def test_the_ascent_finds_what_an_exhaustive_search_finds(seed: int, count: int) -> None:
    draw = np.random.default_rng(seed)
    margins, slopes = draw.normal(size=count), draw.normal(size=(count, 2)) * 10.0 ** draw.uniform(-1, 1, (count, 1))
    low, high = -draw.uniform(0.0, 1.0, 2), draw.uniform(0.0, 1.0, 2)
    grid = np.stack(np.meshgrid(*(np.linspace(a, b, 401) for a, b in zip(low, high, strict=True))), axis=-1)
    best = float((margins + grid @ slopes.T).min(axis=-1).max())
    found = best_together(margins, slopes, low, high)
    assert best - 0.05 * (1.0 + abs(best)) <= found <= best + 0.05 * (1.0 + float(np.abs(slopes).max())) * 0.5
