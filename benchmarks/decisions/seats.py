"""Scripts of the study: a model that is careless, and one that gives one stated answer at its first chance."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, TypeAlias

from homeostat.agents.language.answers import MOST_S, NONE
from homeostat.agents.language.scripts import numbers_asked_for
from homeostat.llm.model import Question

Script: TypeAlias = Callable[[Question], str]
"""Makes an answer of a question, as a language model would."""
_BEFORE: Final = re.compile(r"^\d+\. ", re.MULTILINE)
_WAYS: Final = 3
"""Kinds of answers that a careless model gives in turn: a wait, a path for a while, a path for good."""


def careless(question: Question) -> str:
    """Looks at nothing that it is told: the longest wait, the first path held for the longest time, or for good.

    Which comes first goes by the second in which it is asked, so that a study meets all of them. All numbers stand at
    the upper ends of their ranges, and at the lower ones where it is asked again.
    """
    tried = len(_BEFORE.findall(question.prompt))
    if question.agent == "reprompting":
        return json.dumps({"route": "action", "hint": "something else"})
    if question.agent == "action":
        end = "minimum" if tried % 2 else "maximum"
        values = {tag: float(limit[end]) for tag, limit in numbers_asked_for(question).items()}
        return json.dumps({"reasoning": "all of it", "commands": values})
    first, way = _paths(question)[0], (int(question.at_s) + tried) % _WAYS
    if way == 0:
        return json.dumps({"reasoning": "it will pass", "path": NONE, "wait_s": MOST_S})
    held = {"hold_s": MOST_S} if way == 1 else {}
    return json.dumps({"reasoning": "the first will do", "path": first, **held})


@dataclass
class OneAnswer:
    """Gives one planning answer at its first chance, and nothing after that: what is measured is this answer."""

    plan: Mapping[str, Any]
    """The answer; the path by its last state, a test by its place among those on offer, from 1."""
    commands: Mapping[str, float] = field(default_factory=dict)
    """Tag -> value of a path's commands; everything else as automatic, or at its upper end."""
    given: bool = False
    """Whether it has been given."""

    def __call__(self, question: Question) -> str:
        """The stated answer where it is on offer for the first time; else that nothing helps."""
        if question.agent == "reprompting":
            return json.dumps({"route": "planning", "hint": "nothing else"})
        if question.agent == "action":
            values = {tag: self._value(tag, limit) for tag, limit in numbers_asked_for(question).items()}
            return json.dumps({"reasoning": "as stated", "commands": values})
        plan = self._on_offer(question)
        if self.given or plan is None:
            return json.dumps({"reasoning": "nothing better is known", "path": NONE})
        self.given = True
        return json.dumps({"reasoning": "as stated", **plan})

    def _on_offer(self, question: Question) -> dict[str, Any] | None:
        """The answer in the words of the question; None where it is not one that may be given."""
        schema: Any = question.schema
        plan = {"path": NONE, **self.plan}
        if plan["path"] != NONE:
            plan["path"] = next((p for p in _paths(question) if p.rpartition(" > ")[2] == plan["path"]), None)
        if "test" in plan and "test" not in schema["properties"]:
            return None
        return None if plan["path"] is None else plan

    def _value(self, tag: str, limit: Mapping[str, Any]) -> float | None:
        if tag in self.commands:
            return self.commands[tag]
        return None if limit["automatic"] else float(limit["maximum"])


def _paths(question: Question) -> list[str]:
    schema: Any = question.schema
    return list(schema["properties"]["path"]["enum"])
