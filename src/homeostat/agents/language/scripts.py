"""Scripts: models that play a part by reading what a language model reads, for demonstrations and tests.

They know nothing but the question: what they cannot find in prompt and schema, a language model could not either.
"""

import json
import re
from collections.abc import Callable, Mapping
from typing import Any, Final, TypeAlias

import numpy as np

from homeostat.agents.language.answers import LEAST_S, NONE
from homeostat.llm.model import Question

Point: TypeAlias = Mapping[str, float | None]
"""Tag -> value; None for automatic."""
Limits: TypeAlias = Mapping[str, Mapping[str, Any]]
"""Tag -> its numeric schema."""
_NUMBER: Final = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_ABOUT: Final = re.compile(r"^# What attempt (?P<number>\d+) violated", re.MULTILINE)
_ATTEMPT: Final = re.compile(r"^(?P<number>\d+)\. [^:]*: (?P<commands>[^:]*): ", re.MULTILINE)
_FIRST: Final = re.compile(r"^1\. (?P<path>[^:]*): ", re.MULTILINE)
_COMMAND: Final = re.compile(rf"(?P<tag>\S+)=(?P<value>auto|{_NUMBER})")
_VIOLATED: Final = re.compile(
    rf"^(?:holds only just: )?(?P<name>\S+) (?P<margin>{_NUMBER})[^:]*: .*; margin per step: (?P<effects>.*)$",
    re.MULTILINE,
)
_IDLE: Final = "# What leaving it alone violates"
_EFFECT: Final = re.compile(rf"(?P<tag>[^\s,]+) (?P<step>{_NUMBER}) -> (?P<change>{_NUMBER}|no change)")
_PRESENT: Final = re.compile(
    rf"^- (?P<tag>\S+) «[^»]*»: .*; now (?P<value>automatic|{_NUMBER}).*, design (?P<design>automatic|{_NUMBER})",
    re.MULTILINE,
)
_ADMITTED: Final = re.compile(
    rf"^:range_\S+ .*hs:high (?P<high>{_NUMBER}); hs:low (?P<low>{_NUMBER}); hs:ofTag :tag_(?P<tag>\S+)\.$",
    re.MULTILINE,
)
_FINE: Final = "Without action: every criterion holds."
_SAME: Final = re.compile(r"^- (?P<path>[^:]*): .*; this is what follows without action$", re.MULTILINE)
_STATES: Final = re.compile(r"an hour in a state: (?P<prices>.*?)(?:;|\.(?:\s|$))")
_PRICED: Final = re.compile(rf"(?P<price>{_NUMBER}) (?P<names>[^,]+)")
_ACTS: Final = re.compile(r"^A fallback acts in (?P<left>\d+) s ", re.MULTILINE)
DEAR: Final = 4.0
"""Price of a state in which a careful model does not stay for good, in the plant's currency an hour."""
HELD_S, KEPT_S = 60.0, 35.0
"""How long it holds, and what it keeps of the time until a fallback acts [s]."""
RESERVE: Final = 0.05
"""Margin that is wanted beyond zero, in the margin's unit."""
MOVES: Final = 201
"""Values of each command that are looked at."""
STRIDE: Final = 0.5
"""Longest step of each command, as a share of its range: straight lines do not hold any farther [1]."""


def reasonable(question: Question) -> str:
    """Names the least risky path that changes something; starts from the present commands; steps against the worst.

    The step moves one command after the other as long as, along straight lines, less is missing with every move.
    """
    if question.agent == "planning":
        return json.dumps({"reasoning": "the least risky path that changes something", "path": _change(question)})
    if question.agent == "reprompting":
        return json.dumps({"route": "action", "hint": "move the command with the largest effect"})
    if admitted := _admitted(question):
        return json.dumps({"reasoning": "what the graph says that the state admits", "commands": admitted})
    limits = numbers_asked_for(question)
    present = _present(question, limits)
    base = present if _IDLE in question.prompt else _last(question) or present
    base = {tag: _inside(base.get(tag), limits[tag]) for tag in limits}
    values = dict(base)
    for _ in limits:
        move = _best_move(question, base, values, limits)
        if move is None:
            break
        values[move[0]] = move[1]
    return json.dumps({"reasoning": "one step against what was violated", "commands": values})


def stubborn(question: Question) -> str:
    """Names the least risky path and the present commands at first, and says the same ever after."""
    if question.agent == "planning":
        before = _FIRST.search(question.prompt)
        path = before["path"] if before else _paths(question)[0]
        return json.dumps({"reasoning": "as always", "path": path})
    if question.agent == "reprompting":
        return json.dumps({"route": "action", "hint": "the same again"})
    limits = numbers_asked_for(question)
    values = _present(question, limits)
    commands = {tag: _inside(values.get(tag), limits[tag]) for tag in limits}
    return json.dumps({"reasoning": "as always", "commands": commands})


def careful(question: Question) -> str:
    """As :func:`reasonable`, but a test that is on offer comes first, a dear state is held for a while only, and where
    a fallback need not act soon it is waited a little; once something of its own was refused it is reasonable."""
    planned: dict[str, Any] = json.loads(reasonable(question))
    if question.agent != "planning" or "# Refused so far" in question.prompt:
        return json.dumps(planned)
    schema: Any = question.schema
    tests = schema["properties"].get("test")
    if tests is not None:
        named = next(option for option in tests["anyOf"] if option["type"] == "string")
        name = named["const"] if "const" in named else named["enum"][0]
        return json.dumps({"reasoning": "it tells what is wrong", "path": NONE, "test": name})
    left = _ACTS.search(question.prompt)
    if _price(question, planned["path"]) >= DEAR:
        return json.dumps({**planned, "reasoning": "what passes needs no dear state for good", "hold_s": HELD_S})
    wait_s = 0.0 if left is None else 10.0 * ((float(left["left"]) - KEPT_S) // 10.0)
    if wait_s >= LEAST_S:
        return json.dumps({"reasoning": "there is time", "path": NONE, "wait_s": min(wait_s, HELD_S)})
    return json.dumps(planned)


SCRIPTS: Final[Mapping[str, Callable[[Question], str]]] = {
    "reasonable": reasonable,
    "stubborn": stubborn,
    "careful": careful,
}
"""Name -> script."""


def _paths(question: Question) -> list[str]:
    schema: Any = question.schema
    return list(schema["properties"]["path"]["enum"])


def _change(question: Question) -> str:
    """What follows anyway where every criterion holds then, else the least risky path that changes something."""
    same = [found["path"] for found in _SAME.finditer(question.prompt)]
    paths = _paths(question)
    if _FINE in question.prompt:
        return (*same, *paths)[0]
    return next((path for path in paths if path not in same), paths[0])


def _price(question: Question, path: str) -> float:
    """What an hour in the state costs that ``path`` ends in; 0 where the price list does not say."""
    section = _STATES.search(question.system)
    end = path.rpartition(" > ")[2]
    for found in _PRICED.finditer("" if section is None else section["prices"]):
        if end in found["names"].split(" or "):
            return float(found["price"])
    return 0.0


def _admitted(question: Question) -> dict[str, float]:
    """Tag -> the largest value that the graph admits for it in one state; empty where it does not say."""
    return {found["tag"]: float(found["high"]) for found in _ADMITTED.finditer(question.prompt)}


def numbers_asked_for(question: Question) -> dict[str, dict[str, Any]]:
    """Tag -> its numeric schema, with ``automatic`` where null may be answered."""
    schema: Any = question.schema
    found = {}
    for tag, node in schema["properties"]["commands"]["properties"].items():
        options = node.get("anyOf", [node])
        number = next(option for option in options if option["type"] == "number")
        found[tag] = {**number, "automatic": len(options) > 1}
    return found


def _last(question: Question) -> dict[str, float | None]:
    """The commands of the attempt that the feedback is about; empty where there is none."""
    about = _ABOUT.search(question.prompt)
    attempts = {a["number"]: a["commands"] for a in _ATTEMPT.finditer(question.prompt)}
    pairs = _COMMAND.finditer(attempts.get(about["number"], "") if about else "")
    return {p["tag"]: None if p["value"] == "auto" else float(p["value"]) for p in pairs}


def _present(question: Question, limits: Limits) -> dict[str, float | None]:
    """Tag -> its present value; the design value of what is off its range now, like a pump that stands still."""
    found = {}
    for p in _PRESENT.finditer(question.prompt):
        now, design = (None if p[name] == "automatic" else float(p[name]) for name in ("value", "design"))
        limit = limits[p["tag"]]
        inside = now is None or limit["minimum"] <= now <= limit["maximum"]
        found[p["tag"]] = now if inside else design
    return found


def _inside(value: float | None, limits: Mapping[str, Any]) -> float | None:
    """``value`` as a whole multiple inside its bounds; null stays where it is allowed."""
    if value is None:
        return None if limits["automatic"] else float(limits["maximum"])
    step = limits.get("multipleOf")
    clipped = min(max(value, float(limits["minimum"])), float(limits["maximum"]))
    return clipped if step is None else round(round(clipped / step) * step, 9)


def _best_move(question: Question, base: Point, values: Point, limits: Limits) -> tuple[str, float] | None:
    """Tag and value of the one move after which, along straight lines from ``base``, least is missing; None for none.

    Of equal moves the one with the smallest share of its range counts.
    """
    violated = [_violation(found) for found in _VIOLATED.finditer(question.prompt)]
    moved = {
        tag: value - start for tag, value in values.items() if value is not None and (start := base[tag]) is not None
    }
    before = _missing(violated, moved)
    found: list[tuple[float, float, str, float]] = []
    for tag in moved:
        limit, now, start = limits[tag], values[tag], base[tag]
        assert now is not None and start is not None
        width = limit["maximum"] - limit["minimum"]
        for value in np.linspace(start - STRIDE * width, start + STRIDE * width, MOVES).tolist():
            reached = _inside(value, limit)
            assert reached is not None
            missing = _missing(violated, {**moved, tag: reached - start})
            found.append((missing, abs(reached - now) / width, tag, reached))
    best = min(found, default=None)
    return None if best is None or best[0] >= before - 1e-9 else (best[2], best[3])


def _violation(found: re.Match[str]) -> tuple[float, dict[str, float]]:
    """Margin that is wanted beyond the present one, and by how much one unit of each command changes it."""
    slopes = {
        e["tag"]: float(e["change"]) / float(e["step"])
        for e in _EFFECT.finditer(found["effects"])
        if e["change"] != "no change"
    }
    return RESERVE - float(found["margin"]), slopes


def _missing(violated: list[tuple[float, dict[str, float]]], moved: Mapping[str, float]) -> float:
    """What is missing in all after the commands were ``moved``; nothing counts twice."""
    return sum(
        max(wanted - sum(slopes.get(tag, 0.0) * change for tag, change in moved.items()), 0.0)
        for wanted, slopes in violated
    )
