"""The server that misbehaves in what it answers: each behaviour is what its name says."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.llm.hostile import transport
from tests.llm.hostile.asking import HIGH, KEY, LOW, PROMPT, STEP, VALID, answer, choice, whole
from tests.llm.hostile.behaviours import BEHAVIOURS
from tests.llm.servers import hostile


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with hostile() as address:
        yield address


# --- the status says it -----------------------------------------------------------------------------------------

STATUS = {"unauthorised": 401, "forbidden": 403, "rate_limited": 429, "server_error": 500, "unavailable": 503,
          "no_schema": 400, "redirect": 307, "redirect_loop": 307}  # fmt: skip


@pytest.mark.parametrize("behaviour", STATUS)
def test_the_status_says_it(url: str, behaviour: str) -> None:
    status, headers, body = whole(url, behaviour)
    assert status == STATUS[behaviour]
    if status == 307:
        home = "/v1/chat/completions"
        assert headers["Location"] == {"redirect": f"http://example.invalid{home}", "redirect_loop": home}[behaviour]
        return
    message = json.loads(body)["error"]["message"]
    assert headers.get("Retry-After") == ("3600" if behaviour == "rate_limited" else None)
    assert (KEY in message) is (behaviour == "unauthorised"), "a real server repeats the key there"


def test_limited_twice_and_then_an_answer(url: str) -> None:
    for _ in range(2):
        refused = [whole(url, "rate_limited_twice") for _ in range(2)]
        assert [(status, headers["Retry-After"]) for status, headers, _ in refused] == [(429, "0")] * 2
        assert json.loads(answer(url, "rate_limited_twice")) == VALID


# --- the response says it ---------------------------------------------------------------------------------------


def test_nothing_where_a_response_should_be(url: str) -> None:
    assert whole(url, "empty")[::2] == (200, b"")
    status, headers, body = whole(url, "not_json")
    assert status == 200 and headers["Content-Type"] == "text/html" and body.startswith(b"<html>")
    assert json.loads(whole(url, "no_choices")[2])["choices"] == []


CHOICES: dict[str, tuple[str, str | None]] = {
    "empty_content": ("stop", ""), "null_content": ("stop", None), "content_filter": ("content_filter", ""),
    "refusal": ("stop", None),
}  # fmt: skip


@pytest.mark.parametrize("behaviour", CHOICES)
def test_no_answer_in_the_response(url: str, behaviour: str) -> None:
    said = choice(url, behaviour)
    assert (said["finish_reason"], said["message"]["content"]) == CHOICES[behaviour]
    assert bool(said["message"].get("refusal")) is (behaviour == "refusal")


def test_half_an_answer(url: str) -> None:
    said = choice(url, "truncated")
    assert said["finish_reason"] == "length" and json.dumps(VALID).startswith(said["message"]["content"])
    with pytest.raises(ValueError, match=r"Unterminated|Expecting"):
        json.loads(said["message"]["content"])


def test_another_model_and_impossible_counts(url: str) -> None:
    assert json.loads(whole(url, "wrong_model")[2])["model"] != "wrong_model"
    assert json.loads(answer(url, "wrong_model")) == VALID
    usage = json.loads(whole(url, "absurd_usage")[2])["usage"]
    assert usage["prompt_tokens"] < 0 and usage["completion_tokens"] > 2**64


# --- the answer says it -----------------------------------------------------------------------------------------


def numbers(text: str) -> list[Any]:
    """What stands where numbers were asked for."""
    commands = json.loads(text)["commands"]
    assert commands.keys() == {"T1.sp", "F1.sp"}
    return list(commands.values())


ANSWERS: dict[str, Callable[[str], bool]] = {
    "valid": lambda text: json.loads(text) == VALID,
    "upper_edge": lambda text: numbers(text) == [HIGH, HIGH],
    "out_of_range": lambda text: numbers(text) == [HIGH + STEP] * 2,
    "below_range": lambda text: numbers(text) == [LOW - STEP] * 2,
    "nan": lambda text: all(math.isnan(n) for n in numbers(text)) and "NaN" in text,
    "infinity": lambda text: all(n == -math.inf for n in numbers(text)) and "-Infinity" in text,
    "overflow": lambda text: all(n == -math.inf for n in numbers(text)) and "Infinity" not in text,
    "extreme": lambda text: numbers(text) == [1e308] * 2,
    "many_digits": lambda text: "9" * 5000 in text,
    "wrong_types": lambda text: all(isinstance(n, str) for n in numbers(text)),
    "extra_fields": lambda text: json.loads(text).keys() > VALID.keys(),
    "echo": lambda text: text == PROMPT,
    "key_echo": lambda text: json.loads(text)["reasoning"] == KEY,
}


@pytest.mark.parametrize("behaviour", ANSWERS)
def test_the_answer_says_it(url: str, behaviour: str) -> None:
    assert ANSWERS[behaviour](answer(url, behaviour))


def test_almost_json(url: str) -> None:
    with pytest.raises(ValueError, match="Expecting ':'"):
        json.loads(answer(url, "malformed"))


def test_everything_twice(url: str) -> None:
    pairs: list[tuple[str, Any]] = json.loads(answer(url, "contradictory"), object_pairs_hook=lambda found: found)
    names = [name for name, _ in pairs]
    assert sorted(names) == sorted([*VALID, *VALID])
    first, second = (dict(value) for name, value in pairs if name == "commands")
    assert first == {"T1.sp": LOW, "F1.sp": LOW} and second == {"T1.sp": HIGH, "F1.sp": HIGH}


def test_tricks_with_characters(url: str) -> None:
    text = json.loads(answer(url, "unicode_tricks"))["reasoning"]
    for trick in ("\ud800", "\u202e", "\u200b", "\x00", "\x1b", "\U000e0041"):
        assert trick in text


# --- the server itself ------------------------------------------------------------------------------------------


def test_every_behaviour_is_tested_and_says_what_it_does() -> None:
    tested = {*STATUS, *CHOICES, *ANSWERS, "rate_limited_twice", "empty", "not_json", "no_choices", "truncated",
              "wrong_model", "absurd_usage", "malformed", "contradictory", "unicode_tricks"}  # fmt: skip
    below = {name for name, function in BEHAVIOURS.items() if function.__module__ == transport.__name__}
    assert tested == BEHAVIOURS.keys() - below - {"header_bomb"}, "those have tests of their own"
    assert all(function.__doc__ and "\n" not in function.__doc__ for function in BEHAVIOURS.values())


def test_a_slip_in_a_name_is_no_misbehaviour(url: str) -> None:
    assert whole(url, "hnag")[0] == 404
