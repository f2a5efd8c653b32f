"""Step by step: a model names only the state that is entered next, and gives every actuator its value in it."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from homeostat.agents.hypotheses import plausible_faults
from homeostat.agents.language.answers import (
    AnswerType,
    Unusable,
    action_type,
    bounds,
    commands_in,
    no_value,
    open_range,
)
from homeostat.agents.language.feedback import feedback_text
from homeostat.agents.language.planning import LanguagePlanning
from homeostat.agents.language.reprompting import TeachingReprompting, is_inadmissible
from homeostat.agents.language.situation import quality_text
from homeostat.agents.language.speaker import Briefing
from homeostat.agents.roles import Plan, Situation
from homeostat.agents.search.candidates import SearchSpace, design_commands
from homeostat.agents.search.planning import open_paths
from homeostat.domain.advice import Advice, Attempt, Sensitivity
from homeostat.domain.plant.limits import Owner
from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.domain.quotation import quote
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath
from homeostat.domain.verdict import Finding, Revise
from homeostat.knowledge.context.context import Context
from homeostat.llm.model import Question


def entered(path: RecoveryPath) -> str:
    """Name of the state that is entered next on ``path``."""
    return path.states[1]


def went_on(path: RecoveryPath, advice: Advice) -> bool:
    """Whether the last attempt entered the same state next, so that only what comes later is to be found anew."""
    last = advice.attempts[-1].path if advice.attempts else None
    return last is not None and entered(last) == entered(path)


class StepPlanning(LanguagePlanning):
    """Asks for the state that is entered next; what may follow it is looked for, and tried before it is asked again."""

    TASK = "planning.step"
    LASTING = True

    async def plan(self, situation: Situation, advice: Advice) -> Plan | Revise:
        """A path whose first step is the one that the model names."""
        paths = _steps(open_paths(self._plant, self._grounding, situation, advice))
        further = next((path for path in paths if went_on(path, advice)), None)
        return further or await super().plan(situation, advice)

    def _offered(self, paths: Iterator[RecoveryPath]) -> dict[str, RecoveryPath]:
        found: dict[str, RecoveryPath] = {}
        for path in _steps(paths):
            found.setdefault(entered(path), path)
        return found

    def _describe(self, path: RecoveryPath) -> str:
        state = self._plant.machine.state(entered(path))
        return f"risk {state.risk}, {quote(state.label, 60)}"


class StepAction:
    """Implements :class:`homeostat.agents.roles.Action`: asks for every actuator in the state that is entered next.

    What the state admits is not part of the question's type, so that a wrong answer is told from a right one by
    validation. Before that state the plant is left as it is; after it, it is commanded as by design.
    """

    def __init__(self, briefing: Briefing) -> None:
        """``briefing``: what it shares with the other agents of its model."""
        self._briefing, self._plant = briefing, briefing.plant

    async def act(self, situation: Situation, path: RecoveryPath, advice: Advice) -> ActionSet | Revise:
        """The commands that the model gives, and what comes before and after them."""
        said = _said_before(path, advice)
        if said is not None:
            return self._along(path, situation, said)
        state = path.machine.state(entered(path))
        asked, kind = self.order(situation, state, advice)
        answer = await self._briefing.ask(asked, kind, situation)
        if isinstance(answer, Unusable):
            return Revise(answer.findings)
        if (none := no_value(answer)) is not None:
            return Revise((none,))
        opened = replace(state, setpoints=self._actuators(state))
        return self._along(path, situation, commands_in(opened, answer, self._plant.tags_by_name))

    def order(self, situation: Situation, state: State, advice: Advice) -> tuple[Question, AnswerType]:
        """What the model is asked about ``state``, and the type of its answers."""
        actuators, faults = self._actuators(state), plausible_faults(situation.diagnosis)
        values = {
            "situation": self._briefing.told(situation, advice),
            "where": f"in state {state.name} ({quote(state.label, 60)})",
            "commands": "\n".join(self._tell(r, situation) for r in actuators),
            "feedback": feedback_text(advice, self._plant),
        }
        kind = action_type(actuators, self._plant.tags_by_name)

        def find(budget: int) -> Context:
            return self._briefing.context.step_context(state.name, faults, budget)

        return self._briefing.question("action", situation, "action.step", values, kind, find), kind

    def _along(self, path: RecoveryPath, situation: Situation, given: tuple[Command, ...]) -> ActionSet:
        tags = self._plant.tags_by_name
        sent = {c.tag: c.value for c in situation.under_way if c.value is not None}
        values = {**situation.snapshot.values, **sent}

        def commands(state: State) -> tuple[Command, ...]:
            if state.name == entered(path):
                return given
            if state.name == situation.state:
                space = SearchSpace(state, tags)
                return space.actions(space.present(values)).commands
            return design_commands(state, tags)

        return ActionSet.along(path, commands)

    def _actuators(self, state: State) -> tuple[SetpointRange, ...]:
        """Every tag that ``state`` commands, with the range that it has over all states."""
        every = [r for s in self._plant.machine.states for r in s.setpoints]
        return tuple(open_range(r, [other for other in every if other.tag == r.tag]) for r in state.setpoints)

    def _tell(self, actuator: SetpointRange, situation: Situation) -> str:
        tag = self._plant.tag(actuator.tag)
        low, high = bounds(actuator, tag)
        now = situation.snapshot.values.get(tag.name, math.nan)
        unset = "automatic" if actuator.design is None else "not known"
        present = (unset if math.isnan(now) else f"{now:.6g}") + quality_text(tag.name, situation.snapshot)
        return f"- {tag.name} {quote(tag.description, 60)}: {low:g} to {high:g}; now {present}"


class StepReprompting(TeachingReprompting):
    """As for whole routes, without sensitivities and a model's advice: there is hardly anything to vary in a step."""

    async def _slopes(
        self, situation: Situation, attempt: Attempt, violated: Sequence[Finding]
    ) -> tuple[Sensitivity, ...]:
        return ()

    async def _asked(
        self, situation: Situation, attempt: Attempt, before: Advice, violated: tuple[Finding, ...], route: Owner
    ) -> tuple[Owner, str]:
        return route, ""


def _steps(paths: Iterator[RecoveryPath]) -> Iterator[RecoveryPath]:
    """Those of ``paths`` that stay for a while in the state that they enter next: at most one decision."""
    return (path for path in paths if len(path.decisions) <= 1)


def _said_before(path: RecoveryPath, advice: Advice) -> tuple[Command, ...] | None:
    """What was said for the same next state, where only what comes later is tried anew; None where to ask again."""
    last = advice.attempts[-1] if advice.attempts else None
    if last is None or last.actions is None or path == advice.keep_path or not went_on(path, advice):
        return None
    if any(is_inadmissible(f) for f in last.verdict.findings if not f.satisfied):
        return None
    later = {step.target: step.commands for step in last.actions.then}
    return last.actions.commands if last.actions.target == entered(path) else later[entered(path)]
