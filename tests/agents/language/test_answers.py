"""Typed answers: what the schema of a question admits is what is read, and everything else is a finding."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.checks import command_findings
from homeostat.agents.language.answers import (
    ANSWER,
    MOST_ANSWER,
    NONE,
    AnswerType,
    Unusable,
    action_type,
    bounds,
    planning_type,
    read,
    reprompting_type,
    schema,
)
from homeostat.domain.plant.limits import Owner
from homeostat.domain.plant.state_machine import State
from tests.agents.language.answering import STATES, TAGS, commands, taken, text, values_of
from tests.safety.world import RUNNING
from tests.safety.world import TAGS as VESSEL_TAGS

PATHS = ("normal > reduced_load", "normal > holding")
KINDS: dict[str, AnswerType] = {
    "planning": planning_type(PATHS),
    "reprompting": reprompting_type(),
    **{f"action in {state.name}": action_type(state.open_setpoints, TAGS) for state in STATES},
    "action without increments": action_type(RUNNING.open_setpoints, VESSEL_TAGS),
}
REDUCED = next(s for s in STATES if s.name == "reduced_load")


def nodes(node: Any) -> list[dict[str, Any]]:
    """Every object in a schema."""
    inner = node.values() if isinstance(node, dict) else node if isinstance(node, list) else ()
    return [*([node] if isinstance(node, dict) else []), *(n for child in inner for n in nodes(child))]


def unusable(kind: AnswerType, answer: str) -> Unusable:
    """The findings on an answer that must be refused: no exception, no margin, one line each."""
    found = read(kind, answer)
    assert isinstance(found, Unusable), found
    assert 1 <= len(found.findings) <= 4
    for finding in found.findings:
        assert finding.criterion == ANSWER and finding.margin == -math.inf and not finding.satisfied
        assert finding.message and "\n" not in finding.message
    return found


# --- schemas ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_a_schema_leaves_nothing_open(kind: AnswerType) -> None:
    asked = schema(kind)
    assert json.loads(json.dumps(asked, allow_nan=False)) == asked
    for node in nodes(asked):
        assert "$ref" not in node and "$defs" not in node and "allOf" not in node
        match node.get("type"):
            case "object":
                assert node["additionalProperties"] is False
                assert sorted(node["required"]) == sorted(node["properties"]), "everything must be given"
            case "string":
                assert "maxLength" in node or "enum" in node or "const" in node
            case "number":
                assert math.isfinite(node["minimum"]) and math.isfinite(node["maximum"])
                assert node["minimum"] <= node["maximum"]
            case "integer" | "array" | "boolean":
                raise AssertionError(f"nobody asks for {node}")


@pytest.mark.parametrize("state", STATES, ids=lambda s: s.name)
def test_only_what_the_state_leaves_free_is_asked_for(state: State) -> None:
    asked: Any = schema(action_type(state.open_setpoints, TAGS))
    numbers = asked["properties"]["commands"]["properties"]
    assert set(numbers) == {r.tag for r in state.setpoints if r.low < r.high}
    for r in state.open_setpoints:
        (number,) = (n for n in nodes(numbers[r.tag]) if n.get("type") == "number")
        assert r.low - 1e-9 <= number["minimum"] <= number["maximum"] <= r.high + 1e-9
        assert number["multipleOf"] == TAGS[r.tag].increment
        may_be_automatic = any(n.get("type") == "null" for n in nodes(numbers[r.tag]))
        assert may_be_automatic is (r.design is None)
        assert TAGS[r.tag].unit in numbers[r.tag]["description"]


def test_a_path_is_one_of_those_that_are_open_or_none() -> None:
    asked: Any = schema(planning_type(PATHS))
    assert asked["properties"]["path"]["enum"] == [*PATHS, NONE]
    assert not isinstance(read(planning_type(PATHS), json.dumps({"reasoning": "", "path": NONE})), Unusable)
    for path in ("normal > shutdown", "normal", "", "NONE", PATHS[0].upper(), f" {PATHS[0]}", PATHS):
        unusable(planning_type(PATHS), json.dumps({"reasoning": "", "path": path}))


def test_advice_is_for_planning_or_action() -> None:
    for owner in Owner:
        assert not isinstance(read(reprompting_type(), json.dumps({"route": owner.value, "hint": "less"})), Unusable)
    for route in ("gate", "Action", "", None, 1, ["action"]):
        unusable(reprompting_type(), json.dumps({"route": route, "hint": "less"}))
    unusable(reprompting_type(), json.dumps({"route": "action", "hint": "x" * 201}))


# --- what is accepted -------------------------------------------------------------------------------------------

INCREMENTS = [(state, r.tag) for state in STATES for r in state.open_setpoints]


@pytest.mark.parametrize(("state", "tag"), INCREMENTS, ids=lambda x: getattr(x, "name", x))
def test_every_whole_multiple_inside_the_bounds_is_accepted(state: State, tag: str) -> None:
    """Spelled as decimals, as a model would, as a product of floats, and in exponents: every one of them."""
    kind, values = action_type(state.open_setpoints, TAGS), values_of(state, tag)
    assert len(values) >= 2
    low, high = next((r.low, r.high) for r in state.setpoints if r.tag == tag)
    for spelled in values:
        for form in (spelled, f"{float(spelled)!r}", f"{float(spelled):.6e}", f"{spelled}0"):
            answer = read(kind, text(state, {tag: form}))
            assert not isinstance(answer, Unusable), (form, answer)
            actions = taken(answer, state)
            assert command_findings(actions, state, TAGS) == ()
            command = actions.command(tag)
            assert command is not None and command.value == pytest.approx(float(spelled), abs=1e-12)
            assert command.value is not None and low <= command.value <= high


@pytest.mark.parametrize(("state", "tag"), INCREMENTS, ids=lambda x: getattr(x, "name", x))
def test_what_lies_between_or_beyond_is_refused(state: State, tag: str) -> None:
    values, step = [float(v) for v in values_of(state, tag)], TAGS[tag].increment
    assert step is not None
    wrong = [values[0] - step, values[-1] + step, math.nextafter(values[0], -1e9), math.nextafter(values[-1], 1e9)]
    wrong += [v + step * f for v in values[:-1:3] for f in (0.5, 0.1, 0.9)]
    for value in wrong:
        found = unusable(action_type(state.open_setpoints, TAGS), text(state, {tag: repr(value)}))
        assert any(tag in f.message for f in found.findings), "the finding names the command"


@pytest.mark.parametrize(("state", "tag"), INCREMENTS, ids=lambda x: getattr(x, "name", x))
def test_automatic_is_an_answer_where_there_is_an_automatic_mode(state: State, tag: str) -> None:
    admitted = next(r for r in state.setpoints if r.tag == tag)
    answer = read(action_type(state.open_setpoints, TAGS), text(state, {tag: "null"}))
    assert isinstance(answer, Unusable) is (admitted.design is not None)


def test_what_the_state_fixes_is_commanded_without_being_asked() -> None:
    answer = read(action_type(REDUCED.open_setpoints, TAGS), text(REDUCED))
    assert not isinstance(answer, Unusable)
    actions = taken(answer, REDUCED)
    assert [c.tag for c in actions.commands] == [r.tag for r in REDUCED.setpoints], "in the state's own order"
    fixed = {r.tag: r.design for r in REDUCED.setpoints if r.low == r.high}
    assert fixed and all(c.value == fixed[c.tag] for c in actions.commands if c.tag in fixed)
    assert all(c.rate == (None if c.value is None else TAGS[c.tag].rate_limit) for c in actions.commands)
    unusable(action_type(REDUCED.open_setpoints, TAGS), text(REDUCED, {"XV1.cmd": "1"}))


def test_the_same_commands_are_the_same_action_set_however_they_are_spelled() -> None:
    """Otherwise a model could have the same proposal simulated again and again."""
    kind = action_type(REDUCED.open_setpoints, TAGS)
    spellings = ["0", "0.0", "-0.0", "0e3", "0.00"]
    answers = [read(kind, text(REDUCED, {"V2.man": spelled})) for spelled in spellings]
    digests = {taken(a, REDUCED).digest for a in answers if not isinstance(a, Unusable)}
    assert len(digests) == 1


def test_a_value_beside_a_multiple_is_that_multiple_or_refused() -> None:
    kind = action_type(REDUCED.open_setpoints, TAGS)
    for tag, near, multiple in (("T1.sp", "310.0000000001", 310.0), ("T1.sp", "309.9999999999", 310.0),
                                ("V2.man", "5e-324", 0.0), ("V2.man", "0.4999999999", 0.5)):  # fmt: skip
        answer = read(kind, text(REDUCED, {tag: near}))
        if not isinstance(answer, Unusable):
            assert commands(answer, REDUCED)[tag] == multiple


@pytest.mark.parametrize("fence", ["```json\n{}\n```", "```\n{}\n```", "  {}  \n", "```json{}```", "\ufeff{}"])
def test_a_fence_around_an_answer_is_taken_off(fence: str) -> None:
    answer = fence.replace("{}", text(REDUCED))
    if fence.startswith("\ufeff"):
        unusable(action_type(REDUCED.open_setpoints, TAGS), answer)
    else:
        assert not isinstance(read(action_type(REDUCED.open_setpoints, TAGS), answer), Unusable)


def test_reasoning_has_an_end() -> None:
    kind = action_type(REDUCED.open_setpoints, TAGS)
    assert not isinstance(read(kind, text(REDUCED, reasoning="x" * 400)), Unusable)
    unusable(kind, text(REDUCED, reasoning="x" * 401))
    unusable(kind, " " * (MOST_ANSWER + 1))


@given(st.data())
def test_any_answer_of_the_schema_is_accepted(data: st.DataObject) -> None:
    state = data.draw(st.sampled_from([s for s in STATES if s.open_setpoints]))
    chosen = {r.tag: data.draw(st.sampled_from(values_of(state, r.tag))) for r in state.open_setpoints}
    answer = read(action_type(state.open_setpoints, TAGS), text(state, chosen))
    assert not isinstance(answer, Unusable)
    assert command_findings(taken(answer, state), state, TAGS) == ()


def test_bounds_are_inside_the_range() -> None:
    for state in STATES:
        for r in state.open_setpoints:
            low, high = bounds(r, TAGS[r.tag])
            assert r.low - 1e-9 <= low <= high <= r.high + 1e-9
