"""The estimate of tokens: near the truth on what this project asks, and rather too many than too few."""

from __future__ import annotations

import string

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.llm.tokens import estimate, exact
from tests.agents.language.situations import FAULTS, questions

pytestmark = pytest.mark.filterwarnings("ignore:open_binary is deprecated:DeprecationWarning")  # on importing it
LOW, HIGH = 0.95, 1.20
"""How far the estimate may be off on a prompt of ours."""


def ratio(text: str) -> float:
    count = exact(text)
    assert count is not None, "the tokenizer is installed with the development tools"
    return estimate(text) / count


@pytest.mark.parametrize("fault", FAULTS)
def test_the_estimate_is_near_the_truth_on_every_prompt(fault: str) -> None:
    asked = questions(fault)
    assert {q.agent for q in asked} == {"planning", "action"}
    for question in asked:
        for text in (question.system, question.prompt, f"{question.system}\n{question.prompt}"):
            assert LOW <= ratio(text) <= HIGH
        turtle = question.prompt.partition("# Plant\n")[2].partition("\n# ")[0]
        assert len(turtle) > 1000 and LOW <= ratio(turtle) <= HIGH, "this is what has a budget"


PROSE = st.lists(
    st.sampled_from(
        ["valve", "Temperature", "flow", "is", "at", "T1.sp", "0.0333", "310", "<=", ";", ":tag_V2.man", "\n"]
    ),
    max_size=60,
).map(" ".join)


@given(PROSE, PROSE)
def test_two_texts_have_about_the_tokens_of_both(one: str, two: str) -> None:
    together, apart = estimate(f"{one}\n{two}"), estimate(one) + estimate(two)
    assert max(estimate(one), estimate(two)) <= together <= apart + 1
    assert together >= 0.9 * apart - 3


@given(st.text(), st.text())
def test_more_text_is_not_fewer_tokens(one: str, two: str) -> None:
    """But for a token at the seam: letters that meet become one word."""
    assert estimate(one + two) >= max(estimate(one), estimate(two)) - 1


@given(st.text(st.characters()))
def test_any_text_has_a_number_of_tokens(text: str) -> None:
    assert estimate(text) >= 0
    assert estimate(text) > 0 or not text.strip()


@pytest.mark.parametrize("text", ["", " ", "x" * 100_000, "a\n" * 1000, "9" * 5000, " a" * 20_000])
def test_the_count_is_quick_and_never_below_half(text: str) -> None:
    count = exact(text)
    assert count is not None and estimate(text) >= 0.5 * count - 1


@settings(max_examples=50)
@given(st.text(string.printable, max_size=80))
def test_nothing_that_can_be_typed_is_counted_at_less_than_half(text: str) -> None:
    """A label that is made to look short must not fill a prompt."""
    count = exact(text)
    assert count is not None and estimate(text) >= 0.5 * count - 2


def test_exact_counts_by_the_tokenizer() -> None:
    assert exact("") == 0 and exact("hello world") == 2


def test_exact_takes_a_mark_of_the_tokenizer_for_text() -> None:
    count = exact("before <|endoftext|> after")
    assert count is not None and count > 3


def test_exact_takes_text_that_is_no_unicode() -> None:
    count = exact("half \ud800 character")
    assert count is None or count > 0
