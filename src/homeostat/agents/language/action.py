"""Action by a language model: it gives every free command of the target state a value inside its bounds."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from homeostat.agents.hypotheses import plausible_faults
from homeostat.agents.language.answers import AnswerType, Unusable, action_type, bounds, commands_in, no_value
from homeostat.agents.language.feedback import cost_slopes_text, feedback_text, idle_text
from homeostat.agents.language.situation import MOST_FINDINGS, quality_text, worst_first
from homeostat.agents.language.speaker import Briefing
from homeostat.agents.roles import Situation
from homeostat.agents.search.candidates import SearchSpace, along_by_design
from homeostat.domain.advice import COST, Advice, Sensitivity
from homeostat.domain.plant.limits import LimitKind
from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.domain.quotation import quote
from homeostat.domain.recovery import ActionSet, RecoveryPath, open_setpoints
from homeostat.domain.verdict import Revise
from homeostat.knowledge.context.context import Context
from homeostat.llm.model import Question


@dataclass(frozen=True, slots=True)
class Order:
    """What action is asked."""

    question: Question
    """As the model sees it."""
    kind: AnswerType
    """Type of the answers."""
    path: RecoveryPath
    """Path that the commands take."""


class LanguageAction:
    """Implements :class:`homeostat.agents.roles.Action` with a language model."""

    def __init__(self, briefing: Briefing) -> None:
        """``briefing``: what it shares with the other agents of its model."""
        self._briefing, self._plant = briefing, briefing.plant

    async def act(self, situation: Situation, path: RecoveryPath, advice: Advice) -> ActionSet | Revise:
        """The commands that the model gives, and what the states fix; it is not asked where nothing is to be chosen."""
        tags = self._plant.tags_by_name
        if not open_setpoints(path.commanded_states):
            return along_by_design(path, tags)
        slopes = () if advice.sensitivities else await self._slopes(situation, path)
        order = self.order(situation, path, advice, slopes)
        answer = await self._briefing.ask(order.question, order.kind, situation)
        if isinstance(answer, Unusable):
            return Revise(answer.findings)
        if (none := no_value(answer)) is not None:
            return Revise((none,))
        return ActionSet.along(path, lambda state: commands_in(state, answer, tags))

    def order(
        self, situation: Situation, path: RecoveryPath, advice: Advice, slopes: Sequence[Sensitivity] = ()
    ) -> Order:
        """What the model is asked; ``slopes``: how the margins without action change with each command."""
        faults, choices = plausible_faults(situation.diagnosis), open_setpoints(path.commanded_states)
        chosen = [state for state in path.commanded_states if state.open_setpoints]
        limits = self._plant.limits
        needed = [limit.name for limit in (*limits.hard, *limits.of_kind(LimitKind.PERMISSIVE))]
        currency = self._briefing.prices.currency
        moves = any(s.criterion != COST for s in slopes)
        told = (
            feedback_text(advice, self._plant, currency),
            idle_text(situation.idle, slopes, self._plant) if moves else "",
            cost_slopes_text(slopes, self._plant, currency),
        )
        values = {
            "situation": self._briefing.told(situation, advice, idle=not moves),
            "where": _where(path, chosen),
            "commands": "\n".join(self._describe(r, situation) for r in choices),
            "feedback": "\n".join(filter(None, told)),
        }
        kind, states, tags = (
            action_type(choices, self._plant.tags_by_name),
            [s.name for s in chosen],
            [r.tag for r in choices],
        )

        def find(budget: int) -> Context:
            return self._briefing.context.action_context(states, tags, faults, needed, budget)

        return Order(self._briefing.question("action", situation, "action.route", values, kind, find), kind, path)

    async def _slopes(self, situation: Situation, path: RecoveryPath) -> tuple[Sensitivity, ...]:
        """How what happens without action would change: differences from the present commands in the target state.

        Nothing where steps follow: what happens along a path that is not taken yet cannot be told from idling.
        """
        if path.awaited:
            return ()
        space = SearchSpace(path.machine.state(path.target), self._plant.tags_by_name)
        present = space.actions(space.present(situation.snapshot.values))
        names = [*(f.criterion for f in worst_first(situation.idle, self._plant.scales)[:MOST_FINDINGS]), COST]
        return await self._briefing.simulation.sensitivities(situation.diagnosis, present, (space.state,), names)

    def _describe(self, admitted: SetpointRange, situation: Situation) -> str:
        tag = self._plant.tag(admitted.tag)
        low, high = bounds(admitted, tag)
        now = situation.snapshot.values.get(tag.name, math.nan)
        unit = "" if tag.unit == "1" else f" {tag.unit}"
        design = "automatic (null)" if admitted.design is None else f"{admitted.design:.6g}{unit}"
        steps = "" if tag.increment is None else f" in steps of {tag.increment:g}"
        ramp = "" if tag.rate_limit is None else f", ramps {tag.rate_limit:g}{unit}/s"
        unset = "automatic" if admitted.design is None else "not known"
        present = (unset if math.isnan(now) else f"{now:.6g}{unit}") + quality_text(tag.name, situation.snapshot)
        words = quote(tag.description, 60)
        return f"- {tag.name} {words}: {low:g} to {high:g}{unit}{steps}{ramp}; now {present}, design {design}"


def _where(path: RecoveryPath, chosen: Sequence[State]) -> str:
    """What the commands are for: the state that is reached, or the route and the states of it with a choice."""
    target = path.machine.state(path.target)
    if not path.awaited:
        return f"in state {target.name} ({quote(target.label, 60)})"
    told = ", ".join(state.name for state in chosen)
    return f"on the route {' > '.join(path.states)}, one value each for all of {told}"
