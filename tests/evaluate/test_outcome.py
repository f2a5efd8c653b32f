"""Outcomes: the first that applies, in the order in which they are listed; older records are still understood."""

from __future__ import annotations

import itertools
from dataclasses import fields, replace

import pytest

from homeostat.cli.commands.run import STATUS
from homeostat.evaluate.score.outcome import FORMER, Facts, OutcomeKind, outcome, outcome_kind

NAMES = tuple(f.name for f in fields(Facts))
EVERY = [Facts(*values) for values in itertools.product([True, False], repeat=len(NAMES))]
WELL = Facts(
    avoidable=False, inside_at_end=True, fell_back=False, missed=False, released=True, needless=False, produces=True
)
"""A run that recovered."""


@pytest.mark.parametrize(
    ("changed", "kind"),
    [
        ({}, OutcomeKind.RECOVERED),
        ({"produces": False}, OutcomeKind.HELD),
        ({"needless": True}, OutcomeKind.NEEDLESS_ACTION),
        ({"needless": True, "produces": False}, OutcomeKind.NEEDLESS_ACTION),
        ({"released": False}, OutcomeKind.NO_ACTION),
        ({"released": False, "produces": False}, OutcomeKind.NO_ACTION),
        ({"missed": True}, OutcomeKind.NOT_DETECTED),
        ({"missed": True, "released": False}, OutcomeKind.NOT_DETECTED),
        ({"fell_back": True}, OutcomeKind.FALLBACK),
        ({"fell_back": True, "missed": True}, OutcomeKind.FALLBACK),
        ({"inside_at_end": False}, OutcomeKind.LIMIT_VIOLATED),
        ({"inside_at_end": False, "fell_back": True}, OutcomeKind.LIMIT_VIOLATED),
        ({"avoidable": True}, OutcomeKind.LIMIT_VIOLATED),
        ({"avoidable": True, "fell_back": True}, OutcomeKind.LIMIT_VIOLATED),
    ],
)
def test_what_happened_has_one_name(changed: dict[str, bool], kind: OutcomeKind) -> None:
    assert outcome(replace(WELL, **changed)) is kind


@pytest.mark.parametrize("facts", EVERY)
def test_nothing_bad_is_ever_good(facts: Facts) -> None:
    kind = outcome(facts)
    assert kind.good == (kind in (OutcomeKind.RECOVERED, OutcomeKind.NO_ACTION))
    if kind.good:
        assert facts.inside_at_end and not (facts.avoidable or facts.fell_back or facts.missed)
    if kind is OutcomeKind.RECOVERED:
        assert facts.released and facts.produces and not facts.needless


def test_every_outcome_is_reached_and_has_its_exit_status() -> None:
    assert {outcome(facts) for facts in EVERY} == set(OutcomeKind)
    assert {kind: STATUS[kind] for kind in OutcomeKind} == {
        OutcomeKind.RECOVERED: 0, OutcomeKind.NO_ACTION: 0, OutcomeKind.HELD: 3, OutcomeKind.FALLBACK: 3,
        OutcomeKind.NEEDLESS_ACTION: 4, OutcomeKind.NOT_DETECTED: 4, OutcomeKind.LIMIT_VIOLATED: 5,
    }  # fmt: skip


def test_an_older_record_says_the_same_in_other_words() -> None:
    assert outcome_kind(FORMER, fell_back=True) is OutcomeKind.FALLBACK
    assert outcome_kind(FORMER, fell_back=False) is OutcomeKind.LIMIT_VIOLATED
    assert all(outcome_kind(kind.value, fell_back) is kind for kind in OutcomeKind for fell_back in (True, False))
    with pytest.raises(ValueError, match="won"):
        outcome_kind("won", fell_back=False)
