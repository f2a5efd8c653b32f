"""Reprompting that teaches: margins, sensitivities, every earlier attempt; a model's advice where no rule fits."""

import functools
import math
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from homeostat.agents.grounding.context import nothing
from homeostat.agents.language.answers import ANSWER, Unusable, reprompting_type
from homeostat.agents.language.feedback import feedback_text
from homeostat.agents.language.prompt_files import PROMPTS
from homeostat.agents.language.reach import curable
from homeostat.agents.language.situation import MOST_FINDINGS, nearest, situation_text, worst_first
from homeostat.agents.language.speaker import Briefing
from homeostat.agents.roles import NoAdmissiblePlan, Situation
from homeostat.domain.advice import COST, Advice, Attempt, Sensitivity
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.plant.limits import Owner
from homeostat.domain.recovery import open_setpoints
from homeostat.domain.verdict import REPEATED, Approve, Finding, circumstantial

TRIES: Final = 4
"""Attempts on one path before another one is asked for."""
PROGRESS: Final = 0.9
"""A path is given up when the worst violation is not reduced to this share of what it was before [1]."""
_WAITED: Final = "Until then, or with what follows, too much is violated: name a shorter time, or a path."
"""What is said to a wait that nothing but limits refuses."""
_CIRCUMSTANCES: Final = "That would have met any proposal: wait, or name it again with other values."
"""What is said to a refusal that is no reason of what was proposed."""
MOST_REPEATS: Final = 2
"""A model that says again what was refused this often has nothing more to say."""


class TeachingReprompting:
    """Implements :class:`homeostat.agents.roles.Reprompting` for a language model."""

    def __init__(self, briefing: Briefing) -> None:
        """The model of ``briefing`` is asked where no rule fits; it is shown no part of the plant."""
        self._briefing, self._plant = briefing, briefing.plant

    async def advise(self, situation: Situation, attempt: Attempt, before: Advice) -> Advice:
        """What was violated, what would move it, and who should change something."""
        if isinstance(attempt.verdict, Approve):
            return Advice()
        violated = attempt.verdict.violated
        if any(f.criterion == REPEATED for f in violated):
            return self._repeated(attempt, before)
        hint, kept = known_hint(violated), before.refused_paths
        if any(f.criterion == ANSWER for f in violated):
            return _again(attempt, before, before.findings or violated, hint)
        if attempt.kind in (AlternativeKind.WAIT, AlternativeKind.TEST):
            return Advice(violated, Owner.PLANNING, refused_paths=kept, hint=hint or _WAITED)
        if circumstantial(violated):
            return Advice(violated, Owner.PLANNING, refused_paths=kept, hint=hint or _CIRCUMSTANCES)
        slopes = await self._slopes(situation, attempt, violated)
        route = self._route(attempt, violated, slopes, before)
        if not hint and not any(s.slope for s in slopes if s.criterion != COST):
            route, hint = await self._asked(situation, attempt, before, violated, route)
        return _placed(attempt, before, Advice(violated, route, sensitivities=slopes, hint=hint))

    def _repeated(self, attempt: Attempt, before: Advice) -> Advice:
        """The same feedback again, with the hint that it was the same proposal; nothing new is known of its path."""
        repeats = sum(any(f.criterion == REPEATED for f in a.verdict.findings) for a in before.attempts) + 1
        if repeats >= MOST_REPEATS:
            raise NoAdmissiblePlan(f"{self._briefing.model.name}: repeats what was refused")
        hint = known_hint(attempt.verdict.findings)
        if attempt.path is not None and attempt.path == before.keep_path:
            return _again(attempt, before, before.findings, hint)
        return Advice(before.findings, Owner.PLANNING, refused_paths=before.refused_paths, hint=hint)

    async def _slopes(
        self, situation: Situation, attempt: Attempt, violated: Sequence[Finding]
    ) -> tuple[Sensitivity, ...]:
        if attempt.path is None or attempt.actions is None or attempt.members == 0:
            return ()
        scales = self._plant.scales
        near = nearest(attempt.verdict.findings, scales)
        names = [*(f.criterion for f in (*worst_first(violated, scales)[:MOST_FINDINGS], *near)), COST]
        return await self._briefing.simulation.sensitivities(
            situation.diagnosis, attempt.actions, attempt.path.commanded_states, names
        )

    def _route(
        self, attempt: Attempt, violated: Sequence[Finding], slopes: Sequence[Sensitivity], before: Advice
    ) -> Owner:
        """Action keeps the path while it has tries left, gets on, and its commands could cure what is violated."""
        if attempt.path is None or self._stuck(violated, before):
            return Owner.PLANNING
        if attempt.kind is AlternativeKind.HOLD and any(f.owner is Owner.PLANNING for f in violated):
            return Owner.PLANNING  # its time is asked for with its path
        if before.tries + 1 < TRIES and any(is_inadmissible(f) for f in violated):
            return Owner.ACTION  # what a rollout of commands shows that may not be given says nothing about the path
        if before.tries + 1 >= TRIES or any(f.owner is Owner.PLANNING for f in violated):
            return Owner.PLANNING
        states = attempt.path.commanded_states
        chosen = attempt.actions.choices(states) if attempt.actions else {}
        findings = (*violated, *nearest(attempt.verdict.findings, self._plant.scales))
        cured = curable(findings, slopes, chosen, open_setpoints(states), self._plant.scales)
        return Owner.ACTION if cured else Owner.PLANNING

    def _stuck(self, violated: Sequence[Finding], before: Advice) -> bool:
        """Whether another attempt on the same path left the worst of it as bad as it was."""
        if before.keep_path is None or not before.findings or not violated:
            return False
        scales = self._plant.scales
        was, now = (min(f.relative(scales) for f in found) for found in (before.findings, violated))
        return math.isfinite(was) and now <= PROGRESS * was

    async def _asked(
        self, situation: Situation, attempt: Attempt, before: Advice, violated: tuple[Finding, ...], route: Owner
    ) -> tuple[Owner, str]:
        """The model's own advice; the rules' where it has none."""
        told = Advice(violated, attempts=(*before.attempts, attempt))
        values = {"situation": situation_text(situation, self._plant), "feedback": feedback_text(told, self._plant)}
        kind = reprompting_type()
        asked = self._briefing.question("reprompting", situation, "", values, kind, nothing)
        try:
            answer = await self._briefing.ask(asked, kind, situation)
        except NoAdmissiblePlan:
            return route, ""
        if isinstance(answer, Unusable):
            return route, ""
        given = answer.model_dump()
        return (Owner(given["route"]) if route is Owner.ACTION else route), given["hint"]


def _placed(attempt: Attempt, before: Advice, found: Advice) -> Advice:
    """``found`` with the path of ``attempt`` kept for another try, or refused; a hold says nothing of it for good."""
    if found.route is Owner.ACTION and attempt.path is not None:
        kept = replace(found, keep_path=attempt.path, keep_s=attempt.seconds, tries=before.tries + 1)
        return replace(kept, refused_paths=before.refused_paths)
    refused = () if attempt.path is None or attempt.kind is AlternativeKind.HOLD else (attempt.path.commanded,)
    return Advice(found.findings, Owner.PLANNING, refused_paths=(*before.refused_paths, *refused), hint=found.hint)


def _again(attempt: Attempt, before: Advice, findings: tuple[Finding, ...], hint: str) -> Advice:
    """The same once more after what says nothing about the path of ``attempt``: no try is spent, and none is closed."""
    path, refused = attempt.path, before.refused_paths
    if path is None:
        return Advice(findings, Owner.PLANNING, refused_paths=refused, sensitivities=before.sensitivities, hint=hint)
    tries = before.tries if before.keep_path == path else 0
    told = Advice(findings, Owner.ACTION, path, tries, refused, sensitivities=before.sensitivities, hint=hint)
    return replace(told, keep_s=attempt.seconds)


def is_inadmissible(finding: Finding) -> bool:
    """Whether a command may not be given at all, whatever would come of it."""
    return finding.criterion.startswith("CHK-") and finding.owner is Owner.ACTION


def known_hint(violated: Sequence[Finding]) -> str:
    """What to say about the first violation that has a rule; empty where none has."""
    for finding in violated:
        for name, hint in _hints().items():
            if finding.criterion == name or (name.endswith("-") and finding.criterion.startswith(name)):
                return hint
    return ""


@functools.cache
def _hints() -> dict[str, str]:
    return tomllib.loads(PROMPTS.joinpath("hints.toml").read_text("utf-8"))
