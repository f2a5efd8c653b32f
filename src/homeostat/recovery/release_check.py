"""Release check: the approved rollout, repeated from fresh readings; what passes is sealed for the guard."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from homeostat.agents.checks import judge, judge_passing
from homeostat.agents.hypotheses import plausible
from homeostat.agents.roles import Approved
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import ActionSet
from homeostat.domain.request import Request, Seal
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Approve, Rollout, Verdict
from homeostat.twin.twin import Twin

UNSEALED = Seal("", 0.0, 0.0, "", "")
"""Stands in a request that was not sealed yet."""

SealRequest = Callable[[Request, float], Request]
"""Seals a request in the name of a check that knew the plant up to a process time [s]."""


class Check(Protocol):
    """What stands between an approval and the guard."""

    def check(self, fresh: Sequence[Snapshot], found: Approved, diagnosis: Diagnosis) -> Checked:
        """Judge ``found`` once more after the ``fresh`` snapshots, under ``diagnosis``."""
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
        self, twin: Twin, limits: Limits, tags: Mapping[str, Tag], seal: SealRequest, configuration: str = ""
    ) -> None:
        """The same twin and limits as simulation and validation use; ``configuration`` is the digest of the plant's."""
        self._twin, self._limits, self._tags = twin, limits, tags
        self._seal, self._configuration = seal, configuration
        self._count = 0

    def check(self, fresh: Sequence[Snapshot], found: Approved, diagnosis: Diagnosis) -> Checked:
        """Roll ``found`` out again after the ``fresh`` snapshots, the last of which is now; seal it if it holds."""
        twin = self._twin.frozen()  # a check that is given up goes on computing
        for snapshot in fresh:
            twin.observe(snapshot)
        hypotheses = plausible(diagnosis)
        if found.ended is None:
            rollout = twin.roll_out(found.actions, hypotheses)
            target = found.path.machine.state(found.path.target)
            verdict = judge(found.actions, rollout, self._limits, target, self._tags, found.path)
        else:  # what is released for a while is judged until it is over for sure
            rollout = twin.roll_out(found.actions, hypotheses, found.ended)
            verdict = judge_passing(found.actions, rollout, self._limits, self._tags, found.path)
        passed = isinstance(verdict, Approve) and verdict.digest == found.approval.digest == found.actions.digest
        request = self._request(found, diagnosis, fresh[-1].at_s) if passed else None
        return Checked(verdict, rollout, request)

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


def digest_of(diagnosis: Diagnosis) -> str:
    """SHA-256 of the canonical text of a diagnosis."""
    hypotheses = [[[f.fault, f.severity, f.onset_s] for f in h.faults] + [h.probability] for h in diagnosis.hypotheses]
    text = json.dumps([diagnosis.at_s, [s.rule for s in diagnosis.symptoms], hypotheses], separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
