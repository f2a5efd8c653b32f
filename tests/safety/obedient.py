"""A model that obeys whatever it reads: the worst that an injected text could find."""

from __future__ import annotations

import json
import re
from typing import Any

from homeostat.llm.model import Question

_OBJECT = re.compile(r"\{.*\}")
_ORDER = re.compile(
    r"(?P<tag>[A-Z][A-Z0-9]*\.(?:sp|man|cmd))\W{1,4}(?:to|=|:|auf|a)?\W{0,3}(?P<value>-?\d+(?:\.\d+)?(?:e\d+)?)", re.I
)
_DATA = re.compile(r"«(?P<text>[^»]*)»|\"(?P<literal>(?:[^\"\\]|\\.)*)\"")


def obedient(question: Question) -> str:
    """The first JSON object that stands in the data, or commands with every number that the data ask for.

    Where the data ask for nothing that can be answered, everything is set to the edge of what the schema admits.
    """
    data = [m["text"] or m["literal"] or "" for m in _DATA.finditer(question.prompt)]
    schema: Any = question.schema
    if question.agent == "planning":
        options = schema["properties"]["path"]["enum"]
        named = [o for o in options if any(o in text for text in data)]
        return json.dumps({"reasoning": " ".join(data)[:400], "path": (named or options[:1])[0]})
    if question.agent == "reprompting":
        return json.dumps({"route": "action", "hint": " ".join(data)[:200]})
    if "# Refused so far" not in question.prompt:  # at first to the letter, whatever the schema says
        for text in data:
            found = _OBJECT.search(text)
            if found:
                return found[0]
        for text in data:
            orders = {m["tag"]: float(m["value"]) for m in _ORDER.finditer(text)}
            if orders:
                return json.dumps({"reasoning": "as ordered", "commands": orders})
    return json.dumps({"reasoning": "as far as it goes", "commands": _edges(schema, data)})


def _edges(schema: Any, data: list[str]) -> dict[str, float]:
    """What the data ask for, clipped to the schema; the far edge for the rest."""
    wanted: dict[str, float] = {}
    for text in data:
        wanted |= {m["tag"].lower(): float(m["value"]) for m in _ORDER.finditer(text)}
    found = {}
    for tag, node in schema["properties"]["commands"]["properties"].items():
        number = next(option for option in node.get("anyOf", [node]) if option["type"] == "number")
        low, high = number["minimum"], number["maximum"]
        found[tag] = min(max(wanted.get(tag.lower(), high), low), high)
        step = number.get("multipleOf")
        if step:
            found[tag] = round(round(found[tag] / step) * step, 9)
    return found
