"""Margins: whose they are, in what unit, which of them are near; also where the plant is left alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from homeostat.agents.checks import worst
from homeostat.cli.commands.console import opened
from homeostat.console.card.card import PredictedMargin
from homeostat.console.card.explanation import explained
from homeostat.console.card.margins import predicted_margins
from homeostat.console.view import seen
from homeostat.domain.events.recovery import NoActionTaken
from homeostat.domain.plant.limits import Owner
from homeostat.domain.verdict import Finding
from homeostat.plants.plant import load_plant
from tests.cli.command import homeostat
from tests.console.served import served


def found(name: str, margin: float, unit: str) -> Finding:
    return Finding(name, Owner.ACTION, margin, unit, 60.0, 3, "said")


def judged(plant: str, *findings: Finding) -> dict[str, PredictedMargin]:
    return {m.name: m for m in predicted_margins(findings, load_plant(plant).description)}


def test_what_is_as_good_as_it_can_be_is_not_near_and_comes_last() -> None:
    none, idle = found("ACC-OVERFLOW", 0.001, "L"), found("LIM-P101-IDLE", 9.0, "s")
    told = judged("mixing_module", none, idle)
    assert list(told) == ["LIM-P101-IDLE", "ACC-OVERFLOW"]
    assert told["ACC-OVERFLOW"].full and not told["ACC-OVERFLOW"].near and not told["LIM-P101-IDLE"].full
    little = judged("mixing_module", replace(none, margin=0.0004), idle)
    assert list(little) == ["ACC-OVERFLOW", "LIM-P101-IDLE"]
    assert little["ACC-OVERFLOW"].near and not little["ACC-OVERFLOW"].full, "0.6 mL of 1 mL are spilled"
    wear = judged("cstr", found("ACC-WEAR-V1", 0.0, "1/s"))["ACC-WEAR-V1"]
    assert wear.full and not wear.near, "a valve that does not move wears no less"


@pytest.mark.parametrize(("margin", "near"), [(-0.1, False), (0.0, True), (0.4, True), (0.6, False), (30.0, False)])
def test_near_is_less_than_half_of_what_counts(margin: float, near: bool) -> None:
    told = judged("cstr", found("LIM-T-HIGH", margin, "K"))["LIM-T-HIGH"]
    assert (told.near, told.full) == (near, False) and (told.margin, told.unit, told.term) == (margin, "K", "")


def test_where_the_plant_is_left_alone_the_journal_says_whose_margin_it_is(left_alone_run: Path) -> None:
    run = opened(left_alone_run, None)
    left = [e.event for e in run.entries if isinstance(e.event, NoActionTaken)][-1]
    card = seen(run, run.last_s).card
    assert card is not None and card.proposal is None and card.let_be is not None
    by_name = {f.criterion: f for f in left.findings}
    assert left.members > 1 and left.min_margin == min(f.margin for f in left.findings)
    assert len(card.let_be.margins) + card.let_be.checks == len(by_name) and card.let_be.members == left.members
    nearest, told = card.let_be.margins[0], by_name[card.let_be.margins[0].name]
    assert (nearest.margin, nearest.unit, nearest.at_s, nearest.member) == (
        told.margin, told.unit, told.at_s, told.member
    )  # fmt: skip
    assert nearest.name == "LIM-T-HIGH" and "T1 <= 313" in nearest.formula and nearest.unit == "K"
    mixed = next(m for m in card.let_be.margins if m.name == "LIM-L-LOW")
    decides = by_name["LIM-L-LOW"].deciding
    assert decides is not None and (mixed.term, mixed.margin, mixed.unit) == ("L1 >= 2", decides.margin, "L")
    told_in_words = next(p.text for p in explained(card) if p.heading == "Why it is safe")
    assert f"{nearest.margin:+.3g} K at worst, after {nearest.at_s:.0f} s, in member {nearest.member}" in told_in_words
    assert f"{mixed.margin:+.3g} L to 'L1 >= 2' at worst" in told_in_words and "scale" not in told_in_words


@pytest.mark.slow
def test_the_page_and_the_exported_page_say_it_too(page: Any, left_alone_run: Path, tmp_path: Path) -> None:
    run = opened(left_alone_run, None)
    card = seen(run, run.last_s).card
    assert card is not None and card.let_be is not None
    nearest, out = card.let_be.margins[0], tmp_path / "run.html"
    assert homeostat("export-console", str(left_alone_run), "--out", str(out), cwd=tmp_path).status == 0
    size = f"+{float(format(nearest.margin, '.3g')):g} K to spare at worst"
    with served(left_alone_run) as server:
        for address in (server.address, out.as_uri()):
            page.goto(f"{address}#t={run.last_s}")
            page.locator(".answers", has_text="Leave it alone").wait_for()
            answers = page.locator(".answers").inner_text()
            assert size in answers and f"Highest reactor temperature: {nearest.formula}" in answers
            assert f"in member {nearest.member} of {card.let_be.members}" in answers
            table = page.get_by_role("region", name="Margins").inner_text()
            assert all(m.name in table for m in card.let_be.margins)
            assert "\nL1 >= 2" in table and "\nT1 <= 313" in table, "each with what must hold"
            assert "as good as it can be" not in table


def test_a_record_that_does_not_say_whose_it_is_says_that_it_does_not(left_alone_run: Path) -> None:
    run = opened(left_alone_run, None)
    card = seen(run, run.last_s).card
    assert card is not None and card.let_be is not None
    old = replace(card, let_be=replace(card.let_be, margins=(), members=0, checks=0))
    assert "whose it is this record does not say" in " ".join(p.text for p in explained(old))
    scaled = judged("cstr", found("LIM-L-LOW", 1.9, "1"))["LIM-L-LOW"]
    assert (scaled.term, scaled.unit) == ("", "1")
    older = replace(card, let_be=replace(card.let_be, margins=(scaled,)))
    assert "+1.9 times what counts in its units at worst" in " ".join(p.text for p in explained(older))


def test_of_several_comparisons_it_is_told_which_one_it_is() -> None:
    """Levels of four tanks are one criterion; an operator has to know whose level it is."""
    plant = load_plant("mixing_module").description
    level = next(c for c in plant.limits.criteria if c.name == "ACC-LEVEL")
    names = sorted(level.formula.tags)
    signals = {name: np.full((2, 5), 0.1) for name in names}
    signals["B202.level"][1, 3] = 0.207
    told = worst(level, signals, 1.0)
    assert (told.member, told.at_s) == (1, 3.0) and told.margin == pytest.approx(0.006)
    (margin,) = predicted_margins([told], plant)
    assert (margin.term, margin.unit, margin.near) == ("B202.level <= 0.213", "m", False)
    one = next(c for c in plant.limits.criteria if c.name == "ACC-SPILL")
    assert worst(one, {"batch.spilled": np.zeros((2, 5))}, 1.0).deciding is None, "there is no other one"
