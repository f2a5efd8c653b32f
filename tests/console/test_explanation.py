"""The card in sentences: complete, from the facts of the card and nothing else."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from homeostat.cli.commands.console import opened
from homeostat.console.card.explanation import explained
from homeostat.console.opened import OpenedRun
from homeostat.console.text import to_json
from homeostat.console.view import seen, shown
from tests.console.test_hostile import MARKUP, hostile_run


def moments(run: OpenedRun) -> list[float]:
    return sorted({e.at_s for e in run.entries})


def numbers(text: str) -> list[float]:
    return [float(n) for n in re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.]*\d)", text)]


@pytest.mark.slow
@pytest.mark.parametrize("which", ["recovered", "handed_over_run", "left_alone_run"])
def test_it_says_everything_that_the_card_says(which: str, request: pytest.FixtureRequest) -> None:
    given = request.getfixturevalue(which)
    run = given if isinstance(given, OpenedRun) else opened(given, None)
    checked = 0
    for at_s in moments(run):
        moment = seen(run, at_s)
        if (card := moment.card) is None:
            continue
        text = " ".join(p.text for p in moment.told)
        facts = [card.headline, *(s.text for s in card.seen), *(e.text for e in card.explanations), *card.notes]
        facts += [choice.what for choice in card.choices] + [refused.why for refused in card.refused]
        facts += [acted.strategy for acted in card.acted]
        if card.proposal is not None:
            facts += [m.tag for m in card.proposal.moves] + [m.name for m in card.proposal.margins]
            facts += [f"in member {m.member} of" for m in card.proposal.margins] + [*card.proposal.path]
            facts += [s.guard for s in card.proposal.later] + [*card.proposal.reasons]
        if card.fallen is not None:
            facts += [card.fallen.status, *(m.name for m in card.fallen.margins)]
        if card.proposal is None and card.let_be is not None and not card.acted:
            facts += [f"in member {m.member} of" for m in card.let_be.margins]
            facts += [part for m in card.let_be.margins for part in (m.name, m.term)]
        lacking = [fact for fact in facts if fact not in text]
        assert not lacking, (at_s, lacking)
        checked += len(facts)
    assert checked > 5


def test_it_says_no_number_that_is_not_on_the_card(recovered: OpenedRun) -> None:
    """A number is on the card as it is, rounded, in percent, or as a time after another one."""
    at_s = shown(recovered).decided_s
    assert at_s is not None
    card = seen(recovered, at_s).card
    assert card is not None
    held = numbers(to_json(card))
    told = [f for f in (card.foresight, card.proposal and card.proposal.foresight) if f]
    held += [f.told.from_s + s for f in told if (r := f.told.first) for s in (r.earliest_s, r.middle_s, r.latest_s)]
    for paragraph in explained(card):
        for said in numbers(paragraph.text):
            near = (abs(said - x) <= 0.006 * abs(x) + 0.5 * (abs(x) > 30.0) for x in held)
            share = (abs(said - 100.0 * x) <= 0.51 for x in held)
            assert any(near) or any(share), (said, paragraph)


def test_texts_of_others_stay_texts(tmp_path: Path) -> None:
    run = opened(hostile_run(tmp_path / "run"), None)
    told = seen(run, 7.0).told
    assert MARKUP in " ".join(p.text for p in told) and "What acted" in [p.heading for p in told]


def test_it_grows_with_what_is_known(recovered: OpenedRun) -> None:
    begins_s = shown(recovered).begins_s
    assert begins_s is not None and seen(recovered, begins_s - 1.0).told == ()
    assert "Why it is safe" not in [p.heading for p in seen(recovered, begins_s).told]
    assert "Why it is safe" in [p.heading for p in seen(recovered, recovered.last_s).told]


def test_a_certificate_beside_the_fallback_claims_no_more_than_it_counted(recovered: OpenedRun) -> None:
    """Where a limit is violated whatever is done, what was counted is who does worse than the fallback."""
    card = next(
        c for s in moments(recovered) if (c := seen(recovered, s).card) and c.proposal and c.proposal.certificate
    )
    proposal = card.proposal
    assert proposal is not None and proposal.certificate is not None

    def said(beside: bool) -> str:
        told = replace(proposal, certificate=replace(proposal.certificate, beside=beside))
        return " ".join(p.text for p in explained(replace(card, proposal=told, choices=())))

    assert "draws violate a hard limit: at most" in said(False)
    assert "draws do worse than the fallback, which violates a hard limit as well: at most" in said(True)
    assert "draws violate a hard limit" not in said(True)


@pytest.mark.parametrize(
    ("share", "words"),
    [
        (1.0, "100 %"),
        (0.99999, "> 99.9 %"),
        (0.9994, "99.9 %"),
        (0.997, "99.7 %"),
        (0.99, "99 %"),
        (0.0, "0 %"),
        (0.004, "0.4 %"),
    ],
)
def test_only_what_is_certain_is_a_hundred_percent(recovered: OpenedRun, share: float, words: str) -> None:
    card = next(c for s in moments(recovered) if (c := seen(recovered, s).card) and c.probability)
    assert f", {words} probable" in explained(replace(card, probability=share))[0].text


def test_a_cost_that_nobody_knows_is_said_to_be_none(recovered: OpenedRun) -> None:
    card = next(c for s in moments(recovered) if (c := seen(recovered, s).card) and c.choices)
    told = explained(replace(card, choices=(replace(card.choices[0], cost=float("nan")),)))
    text = next(p.text for p in told if p.heading == "What it costs")
    assert "nan" not in text and "at a cost that is not known" in text


def test_one_of_a_kind_is_said_as_one(recovered: OpenedRun) -> None:
    card = next(c for s in moments(recovered) if (c := seen(recovered, s).card) and c.proposal)
    assert card.proposal is not None
    told = explained(replace(card, proposal=replace(card.proposal, checks=1)))
    assert "1 permissive or target was judged" in next(p.text for p in told if p.heading == "Why it is safe")
