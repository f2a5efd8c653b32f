"""Asking: what the agents of one language model share, one question to it, and its answer as one of those asked for."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from pydantic import BaseModel

from homeostat.agents.grounding.context import ContextFinder
from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.language.answers import NONE, AnswerType, Unusable, read, schema, unusable
from homeostat.agents.language.feedback import standing_text
from homeostat.agents.language.price_list import cost_text, price_list
from homeostat.agents.language.prompt_files import fill, prompt_file, template_sha256
from homeostat.agents.language.remarks import Said
from homeostat.agents.language.situation import situation_text
from homeostat.agents.roles import NoAdmissiblePlan, Simulation, Situation
from homeostat.domain.advice import Advice
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.prices import Prices
from homeostat.knowledge.context.context import Context
from homeostat.llm.model import ANSWERED, LanguageModel, ModelError, Question
from homeostat.llm.tokens import estimate

Find: TypeAlias = Callable[[int], Context]
"""Finds a context of at most so many tokens."""
MOST_S: Final = 20.0
"""Longest time for one answer where nothing is said, wall-clock [s]."""
BUDGET: Final = 2650
"""Tokens of a question with its schema, as they are estimated; more only where ``LEAST_GRAPH`` does not fit."""
OMISSION: Final = 54
"""Tokens of the sentence on what does not fit."""
MOST_GRAPH: Final = 900
"""Tokens of the context where everything else is short."""
LEAST_GRAPH: Final = 600
"""Tokens of the context however long everything else is."""


@dataclass(frozen=True, slots=True)
class Briefing:
    """What the agents that ask one language model share."""

    model: LanguageModel
    """Who is asked."""
    plant: PlantDescription
    """The plant as its graph has it."""
    prices: Prices
    """What production is worth, and what everything costs that does not forbid."""
    grounding: Grounding
    """Knows what faults take away."""
    context: ContextFinder
    """Finds what the model is shown of the plant."""
    simulation: Simulation
    """Tells which command moves which margin."""
    notes: tuple[str, ...] = ()
    """What operators wrote."""
    answer_s: float = MOST_S
    """Longest time for one answer, wall-clock [s]."""
    hurried: bool = True
    """Whether an answer must come in the process time that is left, too: not where what thinking costs is declared."""
    said: Said = field(default_factory=Said)
    """What its answers said besides proposals."""

    async def ask(self, question: Question, kind: AnswerType, situation: Situation) -> BaseModel | Unusable:
        """The answer, or what is wrong with it; NoAdmissiblePlan where there is none and asking again is no help."""
        within_s = min(self.answer_s, situation.deadline_s) if self.hurried else self.answer_s
        try:
            reply = await self.model.ask(question, max(within_s, 1.0))
        except ModelError as error:
            if error.failure in ANSWERED:
                return unusable(str(error))
            raise NoAdmissiblePlan(f"{self.model.name}: {error}") from error
        answer = read(kind, reply.answer)
        if isinstance(answer, Unusable):
            return answer
        self.said.take(question.agent, answer, {component.name for component in self.plant.components})
        return answer

    def told(self, situation: Situation, advice: Advice, idle: bool = True) -> str:
        """``situation`` in words, operators' notes, what doing nothing costs, and the best so far.

        ``advice`` knows what is approved of the model's own; ``idle``: what doing nothing violates is told as well.
        """
        text = situation_text(situation, self.plant, (*situation.notes, *self.notes), idle)
        currency = self.prices.currency
        costs = cost_text(situation.idle_cost, currency), standing_text(situation.best, advice.attempts, currency)
        return "\n".join(line for line in (text, *costs) if line)

    def question(
        self, agent: str, situation: Situation, task: str, values: Mapping[str, str], kind: AnswerType, find: Find
    ) -> Question:
        """What ``agent`` asks about ``situation``: its prompt files, filled in with ``values``.

        ``task``: prompt file with what is asked for, empty where the system prompt says it; ``find`` finds what fits
        in the tokens that are left beside the rest of the prompt.
        """
        by = self.context.kind
        role = {
            "task": prompt_file(task, by).strip() if task else "",
            "rules": prompt_file("rules", by),
            "guide": prompt_file("guide", by),
            "none": NONE,
            "prices": price_list(self.prices, self.plant.limits, self.plant.scales),
        }
        system, prompt = fill(f"{agent}.system", role, by), f"{agent}.prompt"
        asked = schema(kind)
        shown = find(room(system, fill(prompt, {**values, "turtle": "", "omission": ""}, by), json.dumps(asked)))
        filled = fill(prompt, {**values, "turtle": shown.text, "omission": shown.omission}, by)
        return Question(agent, situation.snapshot.at_s, system, filled, asked, template_sha256(agent, by))


def room(*texts: str) -> int:
    """Tokens that are left for the context beside ``texts``: what happens comes before what the plant is made of."""
    return min(max(BUDGET - OMISSION - sum(estimate(text) for text in texts), LEAST_GRAPH), MOST_GRAPH)
