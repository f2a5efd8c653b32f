"""Releasing: from an approval over the release check to the guard, and what came of it."""

import asyncio
from dataclasses import dataclass, replace

from homeostat.agents.roles import Approved
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.recovery import ReleasedActions, ReleaseRefused
from homeostat.domain.mode import Mode
from homeostat.domain.plant.limits import Limits
from homeostat.domain.request import RequestStatus
from homeostat.domain.verdict import Approve, Finding, NoActionNeeded, Released, Revise, Rollout
from homeostat.recovery.bounds import Budget
from homeostat.recovery.look.foresight import foreseen
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


@dataclass(frozen=True, slots=True)
class Taken:
    """What came of an action set that the guard took."""

    outcome: Released | NoActionNeeded
    """Released where it was written; NoActionNeeded where nobody writes in this mode."""
    rollout: Rollout | None
    """What the plant does with it, from the release check; what was judged where it is only waited."""
    waiting: bool = False
    """Whether it is only waited: the time to act by stands."""


class Releasing:
    """Takes what was approved to the guard."""

    def __init__(self, scene: Scene, check: Check, budget: Budget, limits: Limits) -> None:
        """``check`` seals what passes it; people are told how near to ``limits`` it is to come."""
        self._scene, self._check, self._budget, self._limits = scene, check, budget, limits

    async def release(self, found: Approved, diagnosis: Diagnosis) -> Taken:
        """Have ``found`` checked once more and written.

        Raises:
            Overtaken: the plant has left the state that the action set starts in.
            Refused: the release check or the guard refuses, or the plant does not hold what was written.
            Withdrawn: nobody answered in time, or a person or a change of mode overtook the request.
            TimeoutError: the release check is late, or the guard says nothing.
        """
        scene, proposer, actions, margin = self._scene, found.proposer, found.actions, found.approval.min_margin
        fresh = await scene.look()
        self._refuse_if_overtaken(found)
        work = asyncio.to_thread(self._check.check, fresh, found, diagnosis)
        checked = await scene.within("the release check", self._budget.check_s, work)
        if checked.request is None:
            findings = checked.verdict.violated if isinstance(checked.verdict, Revise) else ()
            scene.record(ReleaseRefused(proposer, actions.digest, findings))
            raise Refused(findings)
        certified = checked.verdict.certificate if isinstance(checked.verdict, Approve) else None
        scene.record(replace(foreseen(checked.rollout, self._limits, actions.digest), certificate=certified))
        within_s = self._budget.person_s if scene.now.mode is Mode.APPROVE else self._budget.answer_s
        answer = await scene.ask(checked.request, within_s)
        if answer.status is RequestStatus.CONFIRMED:  # said before anything else is waited for: it may be overtaken
            if found.ended is None:  # what is held for a while or tried says nothing of what is released for good
                self._check.confirmed(diagnosis)
            scene.record(ReleasedActions.of(proposer, actions, margin, certified, found.for_s), answer.at_s)
        await scene.look()
        match answer.status:
            case RequestStatus.CONFIRMED:
                return Taken(Released(actions, scene.seen_s), checked.rollout)
            case RequestStatus.ADVISED:
                return Taken(NoActionNeeded(scene.seen_s, margin), checked.rollout)
            case RequestStatus.WITHDRAWN:
                because = f": {answer.reason}" if answer.reason else ""
                raise Withdrawn(f"request {answer.request!r} was withdrawn{because}")
            case _:
                self._refuse_if_overtaken(found)
                raise Refused(() if answer.finding is None else (answer.finding,))

    def _refuse_if_overtaken(self, found: Approved) -> None:
        if self._scene.now.state != found.path.states[0]:
            raise Overtaken(f"the plant went on to {self._scene.now.state!r} while the release was prepared")
