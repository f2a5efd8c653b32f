"""Release check: the approved rollout, repeated from fresh readings; what passes is sealed for the guard."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from homeostat.agents.certificates import Course, counted, interval
from homeostat.agents.checks import judge, judge_passing, rollout_findings
from homeostat.agents.hypotheses import plausible
from homeostat.agents.no_worse import judge_no_worse
from homeostat.agents.reliance import Bench, Relied, Relying, relied_on
from homeostat.agents.roles import Approved
from homeostat.domain.certificate import Certificate
from homeostat.domain.diagnosis import Diagnosis, Hypothesis
from homeostat.domain.plant.limits import Limits, Owner
from homeostat.domain.plant.tag import Tag, scales_of
from homeostat.domain.recovery import ActionSet
from homeostat.domain.request import Request, Seal
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import NOT_YET, Approve, Finding, Revise, Rollout, RolloutResult, Verdict, Violating
from homeostat.guard.requests.permissives import refusal
from homeostat.process.batch import ProcessError
from homeostat.recovery.bounds import RiskBounds
from homeostat.twin.forecast import Ensemble
from homeostat.twin.twin import Twin

FIRST = 0.8
"""Share of the error that a check has before which none was made lately that came to nothing [1]."""
LATER = (1.0 - FIRST) * 6.0 / math.pi**2
"""Share that the next one has; the k-th after it has it over k squared, so that all of them have what is left [1]."""
RISK = "CHK-RISK"
"""Name of the refusal of what violates a hard limit too often."""
UNSEALED = Seal("", 0.0, 0.0, "", "")
"""Stands in a request that was not sealed yet."""

SealRequest = Callable[[Request, float], Request]
"""Seals a request in the name of a check that knew the plant up to a process time [s]."""


class Check(Protocol):
    """What stands between an approval and the guard."""

    def check(self, fresh: Sequence[Snapshot], found: Approved, diagnosis: Diagnosis) -> Checked:
        """Judge ``found`` once more after the ``fresh`` snapshots, under ``diagnosis``."""
        ...

    def confirmed(self, diagnosis: Diagnosis) -> None:
        """What was checked last under ``diagnosis`` was written: whatever is checked now is another question."""
        ...


@dataclass(frozen=True, slots=True)
class Checked:
    """What the release check says."""

    verdict: Verdict
    """Its judgement."""
    rollout: Rollout
    """The rollout that was judged."""
    request: Request | None
    """The sealed request; None where the verdict is no approval."""


class ReleaseCheck:
    """Implements :class:`Check` over the twin; the only one that can seal."""

    def __init__(
        self,
        twin: Twin,
        limits: Limits,
        tags: Mapping[str, Tag],
        seal: SealRequest,
        configuration: str = "",
        risk: RiskBounds | None = None,
    ) -> None:
        """The same twin and limits as simulation and validation use; ``configuration`` is the digest of the plant's."""
        self._twin, self._limits, self._tags = twin, limits, tags
        self._scales = scales_of(tags.values())
        self._seal, self._configuration, self._risk = seal, configuration, risk or RiskBounds()
        self._count = self._certified = 0
        self._spent: dict[bool, list[float]] = {}

    def check(self, fresh: Sequence[Snapshot], found: Approved, diagnosis: Diagnosis) -> Checked:
        """Roll ``found`` out again after the ``fresh`` snapshots, the last of which is now; seal it if it holds."""
        twin = self._twin.frozen()  # a check that is given up goes on computing
        for snapshot in fresh:
            twin.observe(snapshot)
        hypotheses = plausible(diagnosis)
        rollout = twin.roll_out(found.actions, hypotheses, found.ended)
        if found.ended is None:
            target = found.path.machine.state(found.path.target)
            verdict = judge(found.actions, rollout, self._limits, target, self._tags, found.path)
            if found.beside is not None:
                fallback = twin.roll_out(found.beside, hypotheses)
                verdict = judge_no_worse(
                    verdict, rollout, fallback, self._limits, self._scales, self._twin.timing.tick_s
                )
        else:  # what is released for a while is judged until it is over for sure
            verdict = judge_passing(found.actions, rollout, self._limits, self._tags, found.path)
        if isinstance(verdict, Approve) and (
            unseen := _relied_on(found, rollout, self._bench(twin, hypotheses)).findings
        ):
            verdict = Revise(unseen)
        if isinstance(verdict, Approve):
            spent = self._spent.setdefault(diagnosis.faulty, [])
            verdict = self._certify(twin, found, hypotheses, verdict, spent, fresh[-1].at_s)
        passed = isinstance(verdict, Approve) and verdict.digest == found.approval.digest == found.actions.digest
        request = self._request(found, diagnosis, fresh[-1].at_s) if passed else None
        return Checked(verdict, rollout, request)

    def confirmed(self, diagnosis: Diagnosis) -> None:
        """The checks before it have come to their end, and share the error with no later one."""
        self._spent.pop(diagnosis.faulty, None)

    def _bench(self, twin: Twin, hypotheses: tuple[Hypothesis, ...], members: Ensemble | None = None) -> Bench:
        return Bench.of(twin, hypotheses, self._limits, self._scales, members)

    def _certify(
        self,
        twin: Twin,
        found: Approved,
        hypotheses: tuple[Hypothesis, ...],
        approval: Approve,
        spent_s: list[float],
        now_s: float,
    ) -> Approve | Revise:
        """The approval with its certificate, on draws that nobody has seen; a refusal where the risk is too large.

        Checks that were in vain lately, at ``spent_s`` [s], share one error with it, the first one most of it: asking
        again is no second chance, until something is written. One that passes was no chance for a later one, whatever
        kept it from being written. One with whose share no draws could show anything is not made, and has no share.
        """
        risk, draws, violations, beside = self._risk, 0, 0, found.beside is not None
        course = Course(found.actions, found.ended, found.beside)
        if not risk.most:
            return approval
        spent_s[:] = [at_s for at_s in spent_s if now_s - at_s <= risk.shared_s]
        level = 1.0 - (1.0 - risk.level) * (LATER / len(spent_s) ** 2 if spent_s else FIRST)
        if spent_s and interval(risk.most, 0, level, risk.required)[1] > risk.required:
            again_s = spent_s[0] + risk.shared_s
            text = f"{len(spent_s)} checks within {risk.shared_s:g} s were in vain"
            text = f"{text}; nothing can be shown before {again_s:.0f} s"
            return Revise((refusal(NOT_YET, text),))
        spent_s.append(now_s)  # before anything is drawn: one that breaks down or is given up was a chance as well
        self._certified = number = self._certified + 1
        worst: dict[str, Finding] = {}
        while draws < risk.most:
            try:
                members = twin.sampled(hypotheses, risk.batch, f"{number}/{draws // risk.batch}")
            except ProcessError as broke:  # the last readings are no state of the model
                return Revise((refusal("CHK-ROLLOUT", f"{RolloutResult.BROKE_DOWN.value} {broke}"),))
            bench = self._bench(twin, hypotheses, members)
            rollout = bench.roll_out(found.actions, found.ended)
            if rollout.result is not RolloutResult.COMPLETED:
                return Revise((refusal("CHK-ROLLOUT", f"{rollout.result.value} {rollout.note}"),))
            draws += len(rollout.weights)
            unseen = _relied_on(found, rollout, bench)
            violations += int((counted(course, rollout, bench) | unseen.members).sum())
            low, high = interval(draws, violations, level, risk.required)
            if high <= risk.required:
                spent_s.remove(now_s)
                return replace(approval, certificate=Certificate(draws, violations, high, level, beside))
            judged = rollout_findings(rollout, (), self._limits.watched.hard, found.actions)
            for f in (*judged, *unseen.findings):
                if not f.satisfied and (f.criterion not in worst or f.margin < worst[f.criterion].margin):
                    worst[f.criterion] = f
            if low > risk.required:
                break
        shown = Certificate(draws, violations, high, level, beside)
        text = f"{violations} of {draws} rollouts {shown.told}: at most {high:.2g} with {level:.1%} confidence"
        text, told = f"{text}; {risk.required:g} is admitted", Violating(violations, draws, violations / draws)
        refused = Finding(RISK, Owner.ACTION, risk.required - high, "1", 0.0, 0, text, None, told)
        return Revise((refused, *worst.values()))

    def _request(self, found: Approved, diagnosis: Diagnosis, checked_s: float) -> Request:
        self._count += 1
        actions: ActionSet = found.actions
        path = tuple(t.name for t in found.path.transitions)
        name = f"{found.proposer}-{self._count}-{checked_s:.0f}s"
        request = Request(
            name,
            found.proposer,
            found.path.states[0],
            actions,
            path,
            digest_of(diagnosis),
            self._configuration,
            UNSEALED,
        )
        return self._seal(request, checked_s)


def _relied_on(found: Approved, rollout: Rollout, bench: Bench) -> Relied:
    """Whether it counts on actuators that nobody has seen move, in the members of ``rollout``."""
    return relied_on(Relying(found.actions, found.path.commanded_states, found.instead, found.ended), rollout, bench)


def digest_of(diagnosis: Diagnosis) -> str:
    """SHA-256 of the canonical text of a diagnosis."""
    hypotheses = [[[f.fault, f.severity, f.onset_s] for f in h.faults] + [h.probability] for h in diagnosis.hypotheses]
    text = json.dumps([diagnosis.at_s, [s.rule for s in diagnosis.symptoms], hypotheses], separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
