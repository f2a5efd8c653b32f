"""Asking: one question to the model, and its answer as one of the types that were asked for."""

from __future__ import annotations

from typing import Final

from pydantic import BaseModel

from homeostat.agents.grounding.context import GroundingKind
from homeostat.agents.language.answers import AnswerType, Unusable, read, schema, unusable
from homeostat.agents.language.prompt_files import template_sha256
from homeostat.agents.roles import NoAdmissiblePlan, Situation
from homeostat.llm.model import ANSWERED, LanguageModel, ModelError, Question
from homeostat.llm.tokens import estimate

MOST_S: Final = 20.0
"""Longest time for one answer [s]."""
BUDGET: Final = 2000
"""Tokens of a question without its schema, as they are estimated; more only where ``LEAST_GRAPH`` does not fit."""
OMISSION: Final = 50
"""Tokens of the sentence on what does not fit."""
MOST_GRAPH: Final = 900
"""Tokens of the excerpt where everything else is short."""
LEAST_GRAPH: Final = 300
"""Tokens of the excerpt however long everything else is."""


async def ask(model: LanguageModel, question: Question, kind: AnswerType, situation: Situation) -> BaseModel | Unusable:
    """The answer, or what is wrong with it; NoAdmissiblePlan where there is none and asking again will not help."""
    try:
        reply = await model.ask(question, max(min(MOST_S, situation.deadline_s), 1.0))
    except ModelError as error:
        if error.failure in ANSWERED:
            return unusable(str(error))
        raise NoAdmissiblePlan(f"{model.name}: {error}") from error
    return read(kind, reply.answer)


def room(*texts: str) -> int:
    """Tokens that are left for the excerpt beside ``texts``: what happens comes before what the plant is made of."""
    return min(max(BUDGET - OMISSION - sum(estimate(text) for text in texts), LEAST_GRAPH), MOST_GRAPH)


def question(
    agent: str, situation: Situation, system: str, prompt: str, kind: AnswerType,
    grounding: GroundingKind = GroundingKind.GRAPH,
) -> Question:  # fmt: skip
    """What ``agent`` asks about ``situation``."""
    return Question(agent, situation.snapshot.at_s, system, prompt, schema(kind), template_sha256(agent, grounding))
