"""Planning by a language model: it names one of the paths that the machine, the guards and the faults leave open."""

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from pydantic import BaseModel

from homeostat.agents.hypotheses import plausible_faults
from homeostat.agents.language.answers import NONE, AnswerType, Unusable, planning_type, unusable
from homeostat.agents.language.feedback import feedback_text
from homeostat.agents.language.forbidding import forbidding_text
from homeostat.agents.language.situation import MOST_FINDINGS, ranked
from homeostat.agents.language.speaker import Briefing
from homeostat.agents.roles import Hold, NoAdmissiblePlan, Plan, Probe, Situation, Wait
from homeostat.agents.search.planning import open_paths
from homeostat.domain.advice import Advice
from homeostat.domain.plant.limits import LimitKind
from homeostat.domain.quotation import quote
from homeostat.domain.recovery import RecoveryPath
from homeostat.domain.verdict import Revise
from homeostat.knowledge.context.context import Context
from homeostat.llm.model import Question
from homeostat.llm.tokens import estimate

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
    tests: dict[str, Probe]
    """The test moves that are on offer by how they are named."""


class LanguagePlanning:
    """Implements :class:`homeostat.agents.roles.Planning` with a language model."""

    TASK = "planning.route"
    """Prompt file with what is asked for."""
    LASTING = False
    """Whether what is named is always to last."""

    def __init__(self, briefing: Briefing) -> None:
        """``briefing``: what it shares with the other agents of its model."""
        self._briefing, self._plant, self._grounding = briefing, briefing.plant, briefing.grounding

    async def plan(self, situation: Situation, advice: Advice) -> Plan | Revise:
        """The path that the model names, for good or for a while; the wait, or the test, that it names instead."""
        choice = self.choice(situation, advice)
        answer = await self._briefing.ask(choice.question, choice.kind, situation)
        if isinstance(answer, Unusable):
            return Revise(answer.findings)
        found = planned(answer, choice.paths, choice.tests)
        if found is None:
            raise NoAdmissiblePlan(f"{self._briefing.model.name}: names no path")
        return Revise(found.findings) if isinstance(found, Unusable) else found

    def choice(self, situation: Situation, advice: Advice) -> Choice:
        """What the model is asked; NoAdmissiblePlan where there is nothing to choose from."""
        faults = plausible_faults(situation.diagnosis)
        paths = self._offered(open_paths(self._plant, self._grounding, situation, advice))
        if not paths:
            raise NoAdmissiblePlan(
                f"no further path from {situation.state!r} is open with {', '.join(faults) or 'no fault'}"
            )
        tests = {} if self.LASTING else {f"test {k}": probe for k, probe in enumerate(situation.tests, 1)}
        values = {
            "situation": self._briefing.told(situation, advice),
            "paths": "\n".join(
                f"- {name}: {self._describe(p)}{SAME if p == situation.rest else ''}" for name, p in paths.items()
            ),
            "tests": _tests_text(tests),
            "feedback": feedback_text(advice, self._plant, self._briefing.prices.currency),
        }
        kind = planning_type(tuple(paths), self._doubted(situation), tuple(tests), self.LASTING)
        event = self._plant.machine.recovery_event
        ahead = sorted({name for path in paths.values() for name in path.states})

        def find(budget: int) -> Context:
            needed = forbidding_text(self._plant, situation.idle, budget // 2)
            left = budget - estimate(needed)
            found = self._briefing.context.planning_context(situation.state, event, ahead, faults, left)
            text = f"{needed}\n{found.text}".strip()
            return replace(found, text=text, tokens=found.tokens + budget - left, budget=budget)

        asked = self._briefing.question("planning", situation, self.TASK, values, kind, find)
        return Choice(asked, kind, paths, tests)

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


def planned(answer: BaseModel, paths: Mapping[str, RecoveryPath], tests: Mapping[str, Probe]) -> Plan | Unusable | None:
    """What an answer of :func:`planning_type` proposes; None where it says that nothing helps.

    One that says two things at once is unusable: nobody could say which of them is meant.
    """
    given: dict[str, Any] = answer.model_dump()
    path, wait_s, hold_s, test = given["path"], given.get("wait_s"), given.get("hold_s"), given.get("test")
    beside = [name for name in ("wait_s", "hold_s", "test") if given.get(name) is not None]
    if len(beside) > 1:
        return unusable(f"{' and '.join(beside)} stand in one answer; give one of them, the others null")
    if path != NONE and beside in (["wait_s"], ["test"]):
        return unusable(f"{beside[0]} and a path stand in one answer; name the path {NONE!r}, or {beside[0]} null")
    if path == NONE and hold_s is not None:
        return unusable(f"hold_s needs a path that is held; name one, or answer wait_s with path {NONE!r}")
    if test is not None:
        return tests[test]
    if wait_s is not None:
        return Wait(float(wait_s))
    if path == NONE:
        return None
    return paths[path] if hold_s is None else Hold(paths[path], float(hold_s))


def _tests_text(tests: Mapping[str, Probe]) -> str:
    """The test moves on offer, one a line, with what each should tell and what it costs; empty where there are none."""
    lines = []
    for name, probe in tests.items():
        where = probe.actions.target if probe.path is None else " > ".join(probe.path.states)
        told = ", ".join(
            f"{c.tag}={'auto' if c.value is None else format(c.value, '.4g')}" for c in probe.actions.commands
        )
        worth = f"{probe.nats:.1f} nats, worth {100 * probe.value:.1f} %, costs {100 * probe.cost:.1f} % of production"
        lines.append(f"- {name}: {where}: {told}: tells {probe.apart[0]} from {probe.apart[1]}, {worth}")
    return "\n".join(("# Tests on offer", *lines)) if lines else ""
