"""Releasing: from an approval over the release check to the guard, and what came of it."""

from __future__ import annotations

import asyncio

from homeostat.agents.roles import Approved
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.recovery import ReleasedActions, ReleaseRefused
from homeostat.domain.mode import Mode
from homeostat.domain.request import Answer, Request, RequestStatus
from homeostat.domain.verdict import Finding, LeftAlone, Released, Revise
from homeostat.recovery.plant_rules import Bounds
from homeostat.recovery.release_check import Check
from homeostat.recovery.scene import Scene


class Refused(Exception):
    """The release check or the guard refused; ``findings`` say why, for whoever proposed it."""

    def __init__(self, findings: tuple[Finding, ...]) -> None:
        worst = min(findings, key=lambda f: f.margin, default=None)
        super().__init__(worst.message if worst else "no reason was given")
        self.findings = findings


class Overtaken(Exception):
    """The plant went on to another state while the release was prepared; what was approved may be found again."""


class Withdrawn(Exception):
    """The request was given up before it was written."""


class Releasing:
    """Takes what was approved to the guard."""

    def __init__(self, scene: Scene, check: Check, bounds: Bounds) -> None:
        """``check`` seals what passes it."""
        self._scene, self._check, self._budget = scene, check, bounds.budget

    async def release(self, found: Approved, diagnosis: Diagnosis) -> Released | LeftAlone:
        """Have ``found`` written; LeftAlone where it passed, and in this mode nobody writes.

        Raises:
            Overtaken: the plant has left the state that the action set starts in.
            Refused: the release check or the guard refuses, or the plant does not hold what was written.
            Withdrawn: nobody answered in time, or a person or a change of mode overtook the request.
            TimeoutError: the release check is late, or the guard says nothing.
        """
        scene = self._scene
        fresh = await scene.look()
        self._refuse_if_overtaken(found)
        work = asyncio.to_thread(self._check.check, fresh, found, diagnosis)
        checked = await scene.within("the release check", self._budget.check_s, work)
        if checked.request is None:
            findings = checked.verdict.violated if isinstance(checked.verdict, Revise) else ()
            self._note_refusal(found, findings)
            raise Refused(findings)
        answer = await self._ask(checked.request)
        if answer.status is RequestStatus.CONFIRMED:
            self._note_release(found, answer.at_s)
        await scene.look()
        match answer.status:
            case RequestStatus.CONFIRMED:
                scene.progress.expect(found.actions.then, checked.rollout)
                return Released(found.actions, scene.seen_s)
            case RequestStatus.ADVISED:
                return LeftAlone(scene.seen_s, found.approval.min_margin)
            case RequestStatus.WITHDRAWN:
                raise Withdrawn(
                    f"request {answer.request!r} was withdrawn{f': {answer.reason}' if answer.reason else ''}"
                )
            case _:
                self._refuse_if_overtaken(found)
                raise Refused(() if answer.finding is None else (answer.finding,))

    async def _ask(self, request: Request) -> Answer:
        """The guard's final answer."""
        scene = self._scene
        waits_for_person = scene.now.mode is Mode.APPROVE
        within_s = self._budget.person_s if waits_for_person else self._budget.answer_s
        return await scene.desk.ask(request, within_s)

    def _refuse_if_overtaken(self, found: Approved) -> None:
        if self._scene.now.state != found.path.states[0]:
            raise Overtaken(f"the plant went on to {self._scene.now.state!r} while the release was prepared")

    def _note_refusal(self, found: Approved, findings: tuple[Finding, ...]) -> None:
        self._scene.record(ReleaseRefused(found.proposer, found.actions.digest, findings))

    def _note_release(self, found: Approved, at_s: float) -> None:
        """Before anything else is waited for: whoever is overtaken then says no more."""
        actions = found.actions
        self._scene.record(ReleasedActions.of(found.proposer, actions, found.approval.min_margin), at_s)
