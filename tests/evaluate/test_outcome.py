"""Outcomes: the first that applies, in the order in which they are listed; older records are still understood."""

from __future__ import annotations

import itertools
from dataclasses import fields, replace

import pytest

from homeostat.cli.commands.run import STATUS
from homeostat.domain.outcome import FORMER, Outcome, outcome_named
from homeostat.evaluate.score.outcome import Facts, outcome

NAMES = tuple(f.name for f in fields(Facts))
EVERY = [Facts(*values) for values in itertools.product([True, False], repeat=len(NAMES))]
WELL = Facts(
    avoidable=False, inside_at_end=True, fell_back=False, missed=False, released=True, needless=False, produces=True
)
"""A run that recovered."""


@pytest.mark.parametrize(
    ("changed", "kind"),
    [
        ({}, Outcome.RECOVERED),
        ({"produces": False}, Outcome.HELD),
        ({"needless": True}, Outcome.NEEDLESS_ACTION),
        ({"needless": True, "produces": False}, Outcome.NEEDLESS_ACTION),
        ({"released": False}, Outcome.NO_ACTION),
        ({"released": False, "produces": False}, Outcome.NO_ACTION),
        ({"missed": True}, Outcome.NOT_DETECTED),
        ({"missed": True, "released": False}, Outcome.NOT_DETECTED),
        ({"fell_back": True}, Outcome.FALLBACK),
        ({"fell_back": True, "missed": True}, Outcome.FALLBACK),
        ({"inside_at_end": False}, Outcome.LIMIT_VIOLATED),
        ({"inside_at_end": False, "fell_back": True}, Outcome.LIMIT_VIOLATED),
        ({"avoidable": True}, Outcome.LIMIT_VIOLATED),
        ({"avoidable": True, "fell_back": True}, Outcome.LIMIT_VIOLATED),
    ],
)
def test_what_happened_has_one_name(changed: dict[str, bool], kind: Outcome) -> None:
    assert outcome(replace(WELL, **changed)) is kind


@pytest.mark.parametrize("facts", EVERY)
def test_nothing_bad_is_ever_good(facts: Facts) -> None:
    kind = outcome(facts)
    assert kind.good == (kind in (Outcome.RECOVERED, Outcome.NO_ACTION))
    if kind.good:
        assert facts.inside_at_end and not (facts.avoidable or facts.fell_back or facts.missed)
    if kind is Outcome.RECOVERED:
        assert facts.released and facts.produces and not facts.needless


def test_every_outcome_is_reached_and_has_its_exit_status() -> None:
    assert {outcome(facts) for facts in EVERY} == set(Outcome)
    assert {kind: STATUS[kind] for kind in Outcome} == {
        Outcome.RECOVERED: 0, Outcome.NO_ACTION: 0, Outcome.HELD: 3, Outcome.FALLBACK: 3,
        Outcome.NEEDLESS_ACTION: 4, Outcome.NOT_DETECTED: 4, Outcome.LIMIT_VIOLATED: 5,
    }  # fmt: skip


def test_an_older_record_says_the_same_in_other_words() -> None:
    assert outcome_named(FORMER, fell_back=True) is Outcome.FALLBACK
    assert outcome_named(FORMER, fell_back=False) is Outcome.LIMIT_VIOLATED
    assert all(outcome_named(kind.value, fell_back) is kind for kind in Outcome for fell_back in (True, False))
    with pytest.raises(ValueError, match="won"):
        outcome_named("won", fell_back=False)
