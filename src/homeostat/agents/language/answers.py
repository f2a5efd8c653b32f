"""Typed answers: a schema per question, made from the graph, and what an answer is taken for."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model
from pydantic_core import ErrorDetails

from homeostat.domain.plant.limits import Owner
from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.domain.plant.tag import Tag
from homeostat.domain.quotation import quoted
from homeostat.domain.recovery import Command
from homeostat.domain.verdict import Finding

ANSWER: Final = "CHK-ANSWER"
"""Name of the finding that an answer is not one of those that were asked for."""
HELPLESS: Final = "CHK-NO-VALUE"
"""Name of the finding that, as an action model says, no value of a path's commands helps."""
MOST_REASONING: Final = 400
"""Longest reasoning [characters]."""
MOST_TEXT: Final = 200
"""Longest note, doubt, cause, request, or reason why no value helps [characters]."""
LEAST_S: Final = 10.0
"""Shortest wait or hold that is asked for [s]."""
MOST_S: Final = 600.0
"""Longest one [s]."""
MOST_NAME: Final = 60
"""Longest name of a component in an answer [characters]."""
NO_VALUE: Final = "no_value_because"
"""Field of an action model's answer in which it says why no value helps; its commands are not tried then."""
MOST_SAID: Final = 4
"""Most errors of one answer that are reported."""
MOST_ANSWER: Final = 20_000
"""Longest answer that is read [characters]."""
NONE: Final = "none"
"""A planning model's answer that no path can help."""

AnswerType: TypeAlias = type[BaseModel]
_STRICT: Final = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)
_Reasoning: TypeAlias = Annotated[str, Field(max_length=MOST_REASONING)]
_Text: TypeAlias = Annotated[str, Field(max_length=MOST_TEXT)]
_Name: TypeAlias = Annotated[str, Field(max_length=MOST_NAME)]
_Seconds: TypeAlias = Annotated[float, Field(ge=LEAST_S, le=MOST_S)]
_ABOUT: Final = create_model("About", __config__=_STRICT, component=(_Name, ...), text=(_Text, ...))
_REMARKS: Final[dict[str, Any]] = {
    "note": (_Text | None, None),
    "maintenance_request": (_ABOUT | None, None),
    "unlisted_cause": (_ABOUT | None, None),
}
"""What may be said besides an answer; an answer without any of it is one."""


@dataclass(frozen=True, slots=True)
class Unusable:
    """An answer that is none of those that were asked for."""

    findings: tuple[Finding, ...]
    """What is wrong with it."""


def planning_type(
    paths: Sequence[str], doubted: Sequence[str] = (), tests: Sequence[str] = (), lasting: bool = False
) -> AnswerType:
    """The answers that name one of ``paths``, or that none of them can help.

    ``doubted``: names of the hypotheses and permissives of which an answer may say that they are wrong; ``tests``: of
    the test moves on offer. ``lasting``: that names one for good; otherwise it may be held for a stated time, or
    nothing is done for one.
    """
    options: Any = Literal[(*paths, NONE)]
    fields: dict[str, Any] = {"reasoning": (_Reasoning, ...), "path": (options, ...), **_REMARKS}
    if not lasting:
        fields |= {"wait_s": (_Seconds | None, None), "hold_s": (_Seconds | None, None)}
    if tests:
        named: Any = Literal[(*tests,)]
        fields["test"] = (named | None, None)
    if doubted:
        about: Any = Literal[(*doubted,)]
        doubt = create_model("Doubt", __config__=_STRICT, about=(about, ...), text=(_Text, ...))
        fields["doubt"] = (doubt | None, None)
    return create_model("Planning", __config__=_STRICT, **fields)


def action_type(choices: Sequence[SetpointRange], tags: Mapping[str, Tag]) -> AnswerType:
    """The answers that give every command there is a choice about a value inside its bounds."""
    fields: dict[str, Any] = {}
    for k, r in enumerate(choices):
        tag = tags[r.tag]
        low, high = bounds(r, tag)
        text = f"[{tag.unit}], increment {tag.increment or 'any'}"
        if tag.rate_limit is not None:
            text += f", ramps at {tag.rate_limit:g} {tag.unit}/s"
        number = Annotated[float, Field(ge=low, le=high, multiple_of=tag.increment)]
        kind: Any = number if r.design is not None else number | None
        if r.design is None:
            text += "; null: automatic"
        fields[f"command_{k}"] = (kind, Field(alias=r.tag, description=text))
    commands = create_model("Commands", __config__=_STRICT, **fields)
    said: dict[str, Any] = {"reasoning": (_Reasoning, ...), "commands": (commands, ...), NO_VALUE: (_Text | None, None)}
    return create_model("Action", __config__=_STRICT, **said)


def reprompting_type() -> AnswerType:
    """The answers that name who should change something, and what."""
    owners: Any = Literal[tuple(owner.value for owner in Owner)]
    hint = Annotated[str, Field(max_length=200)]
    told: dict[str, Any] = {"route": (owners, ...), "hint": (hint, ...), "reasoning": (_Reasoning | None, None)}
    return create_model("Reprompting", __config__=_STRICT, **told)


def schema(kind: AnswerType) -> dict[str, object]:
    """JSON schema of an answer, without references and titles, which some servers do not know.

    Whatever may be left out may be null as well, and is required: strict servers admit nothing else.
    """
    raw = kind.model_json_schema(by_alias=True)
    resolved = _plain(raw, raw.get("$defs", {}))
    assert isinstance(resolved, dict)
    return resolved


def read(kind: AnswerType, text: str) -> BaseModel | Unusable:
    """``text`` as an answer, or what is wrong with it; never raises."""
    if len(text) > MOST_ANSWER:
        return unusable(f"the answer has {len(text)} characters; at most {MOST_ANSWER} are read")
    try:
        value = json.loads(unfenced(text), object_pairs_hook=_unique, parse_constant=_refuse)
        return kind.model_validate(value, by_alias=True)
    except ValidationError as error:
        return unusable(*(_said(e) for e in error.errors(include_input=False)[:MOST_SAID]))
    except (ValueError, RecursionError) as error:
        return unusable(f"not a JSON object that can be read: {quoted(str(error))}")


def commands_in(state: State, answer: BaseModel, tags: Mapping[str, Tag]) -> tuple[Command, ...]:
    """The commands of an answer of :func:`action_type`, with those that ``state`` fixes, at the tags' rate limits."""
    given = answer.model_dump(by_alias=True)["commands"]
    commands = []
    for r in state.setpoints:
        tag, value = tags[r.tag], r.design
        if r.high > r.low and r.tag in given:
            value = None if given[r.tag] is None else _multiple(given[r.tag], tag.increment)
        commands.append(Command(r.tag, value, None if value is None else tag.rate_limit))
    return tuple(commands)


def bounds(admitted: SetpointRange, tag: Tag) -> tuple[float, float]:
    """Least and largest value that is admissible and a whole multiple of the tag's increment."""
    if tag.increment is None:
        return admitted.low, admitted.high
    low, high = math.ceil(admitted.low / tag.increment - 1e-9), math.floor(admitted.high / tag.increment + 1e-9)
    return _multiple(low * tag.increment, tag.increment), _multiple(high * tag.increment, tag.increment)


def open_range(admitted: SetpointRange, every: Sequence[SetpointRange]) -> SetpointRange:
    """``admitted`` as wide as the widest of ``every``, and without its design value where it has one."""
    low, high = min(r.low for r in every), max(r.high for r in every)
    return SetpointRange(admitted.tag, low, high, None if admitted.design is None else low)


def unusable(*reasons: str) -> Unusable:
    """An answer that is wrong for ``reasons``."""
    return Unusable(tuple(Finding(ANSWER, Owner.ACTION, -math.inf, "1", 0.0, 0, reason) for reason in reasons))


def no_value(answer: BaseModel) -> Finding | None:
    """Why an answer of :func:`action_type` says that no value helps; None where it does not."""
    reason = answer.model_dump().get(NO_VALUE)
    if not reason:
        return None
    text = f"no value helps, because {quoted(reason, MOST_TEXT)}"
    return Finding(HELPLESS, Owner.PLANNING, -math.inf, "1", 0.0, 0, text)


def _multiple(value: float, increment: float | None) -> float:
    """The multiple of ``increment`` that ``value`` stands for: equal commands are equal however they are spelled."""
    return (value if increment is None else round(round(value / increment) * increment, 9)) + 0.0


def _said(error: ErrorDetails) -> str:
    """Where an answer is wrong and why; what the model named itself is quoted like any other text."""
    where = ".".join(map(str, error["loc"])) or "answer"
    return f"{quoted(where, 80)}: {quoted(error['msg'], 120)}"


def unfenced(text: str) -> str:
    """``text`` without the code fence that some models put around JSON."""
    text = text.strip()
    if text.startswith("```") and text.endswith("```"):
        text = text[3:-3].removeprefix("json")
    return text


def _unique(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """An object; one that gives a key twice says two things."""
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ValueError("a key stands twice in one object")
    return found


def _refuse(name: str) -> float:
    raise ValueError(f"{name} is no number")


def _plain(node: object, definitions: Mapping[str, object]) -> object:
    if isinstance(node, list):
        return [_plain(item, definitions) for item in node]
    if not isinstance(node, dict):
        return node
    if "$ref" in node:
        return _plain(definitions[str(node["$ref"]).rpartition("/")[2]], definitions)
    plain = {k: _plain(v, definitions) for k, v in node.items() if k not in ("title", "default", "$defs")}
    if isinstance(fields := plain.get("properties"), dict):
        plain["required"] = list(fields)
    return plain
