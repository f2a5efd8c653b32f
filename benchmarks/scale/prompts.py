"""What a language model would be asked on a site, and how long it is."""

from __future__ import annotations

import json
import re
from typing import Any, Final

from homeostat.agents.language.answers import NONE
from homeostat.llm.model import Question
from homeostat.llm.scripted import ScriptedModel
from homeostat.llm.tokens import estimate, exact

_OMITTED: Final = re.compile(r"(\d+) things did not fit")


class Declining:
    """A script that names the least risky path, gives no usable command for it, and leaves the rest to the search.

    So every prompt is made as a language model would see it, and what is released is the search's.
    """

    def __init__(self) -> None:
        self._named = False

    def __call__(self, question: Question) -> str:
        """The answer to ``question``."""
        if question.agent != "planning":
            return "{}"
        schema: Any = question.schema
        path = NONE if self._named else schema["properties"]["path"]["enum"][0]
        self._named = True
        return json.dumps({"reasoning": "to see the prompts", "path": path})


def first_question(model: ScriptedModel, agent: str) -> str:
    """Role, rules and situation of the first question of ``agent``; empty where none was asked."""
    return next((q.system + q.prompt for q in model.asked if q.agent == agent), "")


def left_out(model: ScriptedModel) -> int:
    """Things that the first planning and the first action question say they leave out."""
    texts = (first_question(model, agent) for agent in ("planning", "action"))
    return sum(int(found[1]) for text in texts if (found := _OMITTED.search(text)))


def tokens(text: str) -> int:
    """Tokens of ``text``: by o200k where the tokenizer is installed, else as estimated."""
    counted = exact(text)
    return estimate(text) if counted is None else counted
