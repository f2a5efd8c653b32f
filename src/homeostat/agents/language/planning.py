"""Planning by a language model: it names one of the paths that the machine, the guards and the faults leave open."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from homeostat.agents.hypotheses import plausible_faults
from homeostat.agents.language.answers import NONE, AnswerType, Unusable, planning_type
from homeostat.agents.language.feedback import feedback_text
from homeostat.agents.language.situation import MOST_FINDINGS, ranked
from homeostat.agents.language.speaker import Briefing
from homeostat.agents.roles import NoAdmissiblePlan, Situation
from homeostat.agents.search.planning import open_paths
from homeostat.domain.advice import Advice
from homeostat.domain.plant.limits import LimitKind
from homeostat.domain.quotation import quote
from homeostat.domain.recovery import RecoveryPath
from homeostat.domain.verdict import Revise
from homeostat.knowledge.context.context import Context
from homeostat.llm.model import Question

SAME: Final = "; this is what follows without action"
"""Said of the path that the plant takes if nobody interferes."""
MOST_PATHS: Final = 24
"""Most paths that are offered, those with least risk."""


@dataclass(frozen=True, slots=True)
class Choice:
    """What planning is asked."""

    question: Question
    """As the model sees it."""
    kind: AnswerType
    """Type of the answers."""
    paths: dict[str, RecoveryPath]
    """The paths by how they are named."""


class LanguagePlanning:
    """Implements :class:`homeostat.agents.roles.Planning` with a language model."""

    TASK = "planning.route"
    """Prompt file with what is asked for."""

    def __init__(self, briefing: Briefing) -> None:
        """``briefing``: what it shares with the other agents of its model."""
        self._briefing, self._plant, self._grounding = briefing, briefing.plant, briefing.grounding

    async def plan(self, situation: Situation, advice: Advice) -> RecoveryPath | Revise:
        """The path that the model names."""
        choice = self.choice(situation, advice)
        answer = await self._briefing.ask(choice.question, choice.kind, situation)
        if isinstance(answer, Unusable):
            return Revise(answer.findings)
        named: str = answer.model_dump()["path"]
        if named == NONE:
            raise NoAdmissiblePlan(f"{self._briefing.model.name}: names no path")
        return choice.paths[named]

    def choice(self, situation: Situation, advice: Advice) -> Choice:
        """What the model is asked; NoAdmissiblePlan where there is nothing to choose from."""
        faults = plausible_faults(situation.diagnosis)
        paths = self._offered(open_paths(self._plant, self._grounding, situation, advice))
        if not paths:
            raise NoAdmissiblePlan(
                f"no further path from {situation.state!r} is open with {', '.join(faults) or 'no fault'}"
            )
        values = {
            "situation": self._briefing.told(situation),
            "paths": "\n".join(
                f"- {name}: {self._describe(p)}{SAME if p == situation.rest else ''}" for name, p in paths.items()
            ),
            "feedback": feedback_text(advice, self._plant),
        }
        kind, event = planning_type(tuple(paths), self._doubted(situation)), self._plant.machine.recovery_event
        ahead = sorted({name for path in paths.values() for name in path.states})

        def find(budget: int) -> Context:
            return self._briefing.context.planning_context(situation.state, event, ahead, faults, budget)

        asked = self._briefing.question("planning", situation, self.TASK, values, kind, find)
        return Choice(asked, kind, paths)

    def _doubted(self, situation: Situation) -> tuple[str, ...]:
        """Names of what may be doubted: the hypotheses that are told, and every permissive."""
        told = [group[0].name for group in ranked(situation.diagnosis.hypotheses)[:MOST_FINDINGS]]
        needed = [x.name for x in self._plant.limits.limits if x.kind is LimitKind.PERMISSIVE]
        return tuple(dict.fromkeys((*told, *needed)))

    def _offered(self, paths: Iterator[RecoveryPath]) -> dict[str, RecoveryPath]:
        """The paths by how they are named."""
        return {" > ".join(path.states): path for path in itertools.islice(paths, MOST_PATHS)}

    def _describe(self, path: RecoveryPath) -> str:
        states = path.commanded_states
        return f"risk {max(s.risk for s in states)}, {quote(states[-1].label, 60)}"
