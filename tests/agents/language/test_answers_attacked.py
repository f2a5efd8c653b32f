"""Answers that nobody asked for: whatever a model says, what comes out is an answer of the schema or findings."""

from __future__ import annotations

import json
import math
import string
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel

from homeostat.agents.checks import command_findings
from homeostat.agents.language.answers import (
    ANSWER,
    MOST_ANSWER,
    NONE,
    AnswerType,
    Unusable,
    action_type,
    planning_type,
    read,
    reprompting_type,
)
from tests.agents.language.answering import STATES, TAGS, taken, text, values_of

REDUCED = next(s for s in STATES if s.name == "reduced_load")
ACTION = action_type(REDUCED.open_setpoints, TAGS)
PATHS = ("normal > reduced_load", "normal > holding")
KINDS = (ACTION, planning_type(PATHS), reprompting_type())


def judged(kind: AnswerType, answer: str) -> BaseModel | Unusable:
    """What ``answer`` is taken for; asserts that it is fit for use, or a finding in one line."""
    found = read(kind, answer)
    if isinstance(found, Unusable):
        assert 1 <= len(found.findings) <= 4
        for finding in found.findings:
            assert finding.criterion == ANSWER and finding.margin == -math.inf
            assert finding.message
    elif kind is ACTION:
        assert command_findings(taken(found, REDUCED), REDUCED, TAGS) == ()
    else:
        given_ = found.model_dump()
        assert given_.get("path", NONE) in (*PATHS, NONE) and given_.get("route", "action") in ("action", "planning")
    return found


def refused(kind: AnswerType, answer: str) -> None:
    assert isinstance(judged(kind, answer), Unusable), answer[:200]


@given(st.text(st.characters()))
def test_any_text(answer: str) -> None:
    for kind in KINDS:
        refused(kind, answer)


@given(st.text('{}[]":,.-+eE0123456789 \n\tnulltrefasNIiy`\\u', max_size=60))
def test_any_text_with_the_letters_of_json(answer: str) -> None:
    for kind in KINDS:
        refused(kind, answer)


SCALARS = st.none() | st.booleans() | st.floats() | st.integers() | st.text(st.characters(), max_size=10)
KEYS = st.sampled_from(["reasoning", "commands", "path", "route", "hint", "T1.sp", "F1.sp", "XV1.cmd", ""]) | st.text()
ANYTHING = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=4), max_leaves=12
)


@given(ANYTHING)
def test_any_json(value: object) -> None:
    for kind in KINDS:
        judged(kind, json.dumps(value))


@given(st.dictionaries(KEYS, ANYTHING, max_size=3), st.sampled_from(["merge", "inside"]))
def test_anything_beside_what_was_asked_for(extra: dict[str, object], where: str) -> None:
    answer: Any = json.loads(text(REDUCED))
    target = answer if where == "merge" else answer["commands"]
    before = dict(target)
    target |= extra
    if target != before:
        judged(ACTION, json.dumps(answer))
    if set(target) - set(before):
        refused(ACTION, json.dumps(answer))


VALUES = [
    "NaN", "Infinity", "-Infinity", "1e308", "-1e308", "1e309", "1e400", "-1e400", "1e-8", "9" * 400,
    "9" * 5000, "-" + "9" * 400, "1" + "0" * 30, "true", "false", '"310"', '"0.5"', '" 0.5 "', '"1_0"', '"NaN"', '""',
    '"automatic"', "[]", "[0.5]", "{}", '{"value": 0.5}', "null", "0.505", "1.01", "-0.01", "2", "0x10", "1.", ".5",
    "+1", "01", "1e", "--1", "0.5 K", "'0.5'", "nan", "None", "undefined", "", "1,5",
]  # fmt: skip


@pytest.mark.parametrize("value", VALUES, ids=lambda v: v[:12])
@pytest.mark.parametrize("tag", ["F1.sp", "T1.sp", "V2.man"])
def test_values_that_are_no_admissible_number(tag: str, value: str) -> None:
    answer = text(REDUCED, {tag: value})
    if tag == "V2.man" and value == "null":
        assert not isinstance(judged(ACTION, answer), Unusable)
    else:
        refused(ACTION, answer)


@given(st.floats() | st.integers() | st.fractions(max_denominator=10**6).map(float))
def test_any_number(value: float) -> None:
    """Accepted is only what is a whole multiple inside the bounds, but for what rounding does to the last digits."""
    for tag in ("F1.sp", "T1.sp", "V2.man", "L1.sp"):
        if not isinstance(judged(ACTION, text(REDUCED, {tag: json.dumps(value)})), Unusable):
            nearest = min((float(v) for v in values_of(REDUCED, tag)), key=lambda v: abs(v - value))
            assert value == pytest.approx(nearest, rel=1e-8, abs=1e-8)


@pytest.mark.parametrize(
    "tag", ["XV1.cmd", "V1.man", "P1.man", "T1", "T1.SP", "t1.sp", " T1.sp", "T1.sp ", "Т1.sp", "*"]
)
def test_commands_that_the_state_does_not_leave_free(tag: str) -> None:
    refused(ACTION, text(REDUCED, {tag: "1"}))


@pytest.mark.parametrize("tag", ["F1.sp", "T1.sp", "L1.sp", "V2.man"])
def test_a_command_that_is_missing(tag: str) -> None:
    answer: Any = json.loads(text(REDUCED))
    del answer["commands"][tag]
    refused(ACTION, json.dumps(answer))


@pytest.mark.parametrize("name", ["command_0", "command_3", "model_config", "__class__", "__dict__"])
def test_names_of_the_implementation(name: str) -> None:
    answer: Any = json.loads(text(REDUCED))
    answer["commands"] = {name if tag == "F1.sp" else tag: v for tag, v in answer["commands"].items()}
    refused(ACTION, json.dumps(answer))
    refused(ACTION, text(REDUCED, {name: "0.02"}))


def test_keys_that_stand_twice() -> None:
    fine = text(REDUCED)
    for twice in (
        fine.replace('"F1.sp": 0.0020', '"F1.sp": 0.0020, "F1.sp": 0.0330'),
        fine.replace('"reasoning": "because"', '"reasoning": "because", "reasoning": "because"'),
        fine[:-1] + ', "commands": {"F1.sp": 0.033}}',
        '{"reasoning": "x", "path": "none", "path": "normal > holding"}',
    ):
        assert twice != fine
        for kind in KINDS:
            refused(kind, twice)


@pytest.mark.parametrize("depth", [100, 5_000, 9_999])
@pytest.mark.parametrize(("opened", "closed"), [("[", "]"), ('{"a":', "}"), ('{"commands":', "}"), ("[[", "]]")])
def test_nesting_without_end(depth: int, opened: str, closed: str) -> None:
    for inner in ("", "1"):
        answer = opened * depth + inner + closed * depth
        for kind in KINDS:
            refused(kind, answer[:MOST_ANSWER])
            refused(kind, answer)
    refused(ACTION, text(REDUCED, {"T1.sp": opened * (depth // 4) + "310" + closed * (depth // 4)}))


@pytest.mark.parametrize("answer", ["x" * 1_000_000, " " * 1_000_000, '"' + "x" * 30_000 + '"', "[" * 10_000_000])
def test_texts_without_end(answer: str) -> None:
    for kind in KINDS:
        refused(kind, answer)


def test_a_name_without_end_makes_no_finding_without_end() -> None:
    found = judged(ACTION, text(REDUCED, {"k" * 15_000: "1"}))
    assert isinstance(found, Unusable)
    assert sum(len(f.message) for f in found.findings) < 2_000


@pytest.mark.parametrize("name", ["a\nb", "\x1b[2J", "\u2028# Situation"])
def test_a_name_that_breaks_lines_breaks_no_finding(name: str) -> None:
    found = judged(ACTION, text(REDUCED, {name: "1"}))
    assert isinstance(found, Unusable)
    assert all(f.message.isprintable() for f in found.findings)


@pytest.mark.parametrize(
    "answer",
    ["I would lower the feed.", 'Sure! {"reasoning": "x"}', "```json\n```", "```", "``````", "null", "[]", "true", "1",
     '"reasoning"', "{}", '{"reasoning": "x"}', '{"commands": {}}', '{"reasoning": "x", "commands": []}',
     '{"reasoning": "x", "commands": null}', '{"reasoning": null, "commands": {}}', '{"reasoning": 1, "path": "none"}',
     '{"reasoning": ["x"], "path": "none"}', "{'reasoning': 'x'}", '{"reasoning": "x", "path": "none",}',
     "\x00", "\ud800",
     '{"reasoning": "x", "path": "none"}{"reasoning": "x", "path": "none"}', '[{"reasoning": "x", "path": "none"}]',
     '{"reasoning": "\n", "path": "none"}', '{"reasoning": "\x00", "path": "none"}'],
)  # fmt: skip
def test_what_models_say_instead(answer: str) -> None:
    for kind in KINDS:
        refused(kind, answer)


@pytest.mark.parametrize("reasoning", ["\ud800", "\U000e0041\u202e\u200b", "\x1b[2J", "«»\n# Situation", "${x} $rules"])
def test_reasoning_may_be_anything_and_goes_nowhere(reasoning: str) -> None:
    found = judged(ACTION, text(REDUCED, reasoning=reasoning))
    if not isinstance(found, Unusable):
        assert reasoning not in repr(taken(found, REDUCED))


@given(st.text(string.printable, max_size=5), st.integers(0, 200), st.integers(0, 5))
def test_a_damaged_answer(inserted: str, at: int, removed: int) -> None:
    fine = text(REDUCED)
    judged(ACTION, fine[:at] + inserted + fine[at + removed :])
