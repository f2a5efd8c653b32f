"""Requests: verified on the very reading of a tick, the oldest that still stands first, each answered (NE 178)."""

from collections.abc import Iterable
from dataclasses import dataclass

from homeostat.domain.events.guard import RequestAnswered
from homeostat.domain.events.writes import Cause
from homeostat.domain.mode import Mode
from homeostat.domain.recovery import RecoveryPath
from homeostat.domain.request import Answer, Request, RequestStatus
from homeostat.domain.verdict import Finding
from homeostat.guard.parts import Parts
from homeostat.guard.requests.authority import no_request
from homeostat.guard.requests.permissives import refusal
from homeostat.guard.requests.verification import Present, Unfit, authorise, mapped, verify
from homeostat.guard.restart.memory import REMEMBERED
from homeostat.guard.sequence.sequencer import loaded
from homeostat.guard.texts import brief, said
from homeostat.guard.writing.flight import Failed, Progress, Write

MOST = 50
"""Most requests that wait, and most that one tick looks at."""


@dataclass(slots=True)
class _Asked:
    """One request as the guard holds it."""

    request: Request
    path: RecoveryPath
    offered: bool = False
    agreed: bool = False
    loaded: bool = False


class Requests:
    """Everything that was asked and is not answered for good."""

    def __init__(self, parts: Parts, keys: dict[str, bytes]) -> None:
        """``keys``: issuer -> the key of its seals."""
        self._parts, self._keys = parts, keys
        self._waiting: dict[str, _Asked] = {}
        self._written: _Asked | None = None
        self._looked: dict[float, int] = {}
        self._used: dict[str, None] = {}
        self._nonces: dict[str, None] = {}
        self._answers: list[Answer] = []

    @property
    def written(self) -> bool:
        """Whether the write of a request is under way."""
        return self._written is not None

    @property
    def _open(self) -> tuple[_Asked, ...]:
        """Requests that are not answered for good: the one that is being written, and those that wait."""
        return (*([self._written] if self._written else []), *self._waiting.values())

    @property
    def offered(self) -> tuple[Request, ...]:
        """Requests that wait for a person."""
        return tuple(a.request for a in self._waiting.values() if a.offered)

    def drain(self) -> tuple[Answer, ...]:
        """Answers since the last call."""
        answers, self._answers = tuple(self._answers), []
        return answers

    def receive(self, request: Request, now_s: float, oldest_s: float, latched: str | None) -> None:
        """Copy ``request``, check where it comes from, and have it wait; answered at once where it does not pass.

        While a fallback is ``latched`` nothing waits: what was asked then is old when the latch is reset.
        """
        try:
            self._attend(now_s)
            own, path = mapped(request, self._parts.rules)
            if own.id in self._used or own.seal.nonce in self._nonces:
                raise Unfit(refusal("CHK-USED", f"request {own.id!r} was made before; a seal is used once"))
            authorise(own, self._keys, now_s, oldest_s, oldest_s)
        except Unfit as unfit:
            name = _name(request)
            if any(a.request.id == name for a in self._open):  # the one of that name that is known has its own answers
                name = f"{name}#again"
            self._refuse_unknown(name, unfit.finding, now_s)
            return
        self._use(own)
        self._answer(own, RequestStatus.AUTHORISED, now_s)
        if latched is not None:
            no = refusal("CHK-LATCHED", f"a fallback has acted ({latched}); a person must reset it")
        elif len(self._waiting) >= MOST:
            no = refusal("CHK-BUSY", f"{MOST} requests wait already; ask again later")
        else:
            self._waiting[own.id] = _Asked(own, path)
            return
        self._answer(own, RequestStatus.REFUSED, now_s, no)

    def _attend(self, now_s: float) -> None:
        """Raise Unfit where this tick has looked at as many requests as it has time for."""
        looked = self._looked.get(now_s, 0)
        if looked >= MOST:
            raise Unfit(refusal("CHK-BUSY", f"{MOST} requests came at once; this one was not read, ask again later"))
        self._looked = {now_s: looked + 1}

    def remember(self, used: Iterable[str]) -> None:
        """Requests that were ``used`` before a restart are not taken again."""
        self._used.update(dict.fromkeys(used))

    def _use(self, own: Request) -> None:
        """A seal and an identifier are used once, whatever becomes of the request."""
        self._nonces[own.seal.nonce] = self._used[own.id] = None
        for kept in (self._nonces, self._used):
            while len(kept) > REMEMBERED:
                kept.pop(next(iter(kept)))

    def withdraw(self, name: str, reason: str, now_s: float) -> None:
        """The issuer gives up request ``name``; one that is written already stays written."""
        asked = self._waiting.pop(name, None)
        if asked is not None:
            self._answer(asked.request, RequestStatus.WITHDRAWN, now_s, refusal("CHK-WITHDRAWN", brief(reason)))

    def withdraw_all(self, reason: str, now_s: float) -> None:
        """A trip, a mode change or a person has overtaken everything that was asked."""
        finding = refusal("CHK-OVERTAKEN", brief(reason))
        for asked in self._open:
            self._answer(asked.request, RequestStatus.WITHDRAWN, now_s, finding)
        self._give_up()
        self._waiting.clear()

    def fail(self, reason: str, now_s: float) -> None:
        """The lease was lost while a request was being written: it is given up, and what it has done is read."""
        if self._written is not None:
            self._answer(self._written.request, RequestStatus.FAILED, now_s, refusal("CHK-LEASE", reason))
            self._give_up()

    def agree(self, name: str, digest: str) -> str:
        """A person says yes to request ``name`` with this ``digest``; why not, or empty."""
        asked = self._waiting.get(name)
        if asked is None or not asked.offered:
            return no_request(name, (request.id for request in self.offered))
        if digest != asked.request.actions.digest:
            return f"the digest is not that of request {name!r}; look at it again"
        asked.agreed = True
        return ""

    def reject(self, name: str, reason: str, now_s: float) -> str:
        """A person says no to request ``name``; why not, or empty."""
        asked = self._waiting.get(name)
        if asked is None or not asked.offered:
            return no_request(name, (request.id for request in self.offered))
        del self._waiting[name]
        self._answer(asked.request, RequestStatus.REFUSED, now_s, refusal("CHK-PERSON", reason))
        return ""

    def decide(self, present: Present, mode: Mode, oldest_s: float) -> bool:
        """Write the oldest request that still stands, if nothing is under way; whether anything was written."""
        for asked in list(self._waiting.values()):
            try:
                authorise(asked.request, self._keys, present.now_s, oldest_s, oldest_s)
                verify(asked.request, asked.path, self._parts.rules, present)
                if self._parts.recorder.trouble:
                    raise Unfit(refusal("CHK-JOURNAL", f"nothing is released: {self._parts.recorder.trouble}"))
            except Unfit as unfit:
                self._close(asked, RequestStatus.REFUSED, present.now_s, unfit.finding)
                continue
            if present.above:
                continue  # noise, or the beginning of a trip: it is written on a reading inside the limits
            if not mode.writes:
                self._close(asked, RequestStatus.ADVISED, present.now_s)
            elif mode is Mode.APPROVE and not asked.agreed:
                self._offer(asked, present.now_s)
            elif self._parts.tenure.lost:
                text = f"nothing can be written: {self._parts.tenure.lost}; ask again when the guard has the lease"
                self._close(asked, RequestStatus.REFUSED, present.now_s, refusal("CHK-LEASE", text))
            elif self._parts.writer.flying is None:
                return self._write(asked, present.now_s)
        return False

    def follow(self, progress: Progress | Failed | None, now_s: float) -> None:
        """Take note of how far the write of a request has come."""
        asked, parts = self._written, self._parts
        if asked is None:
            return
        actions = asked.request.actions
        if not asked.loaded and (parts.writer.accepted or progress is Progress.CONFIRMED):
            asked.loaded = True
            parts.sequencer.load(actions, now_s)
            parts.note(loaded(asked.request.id, actions, aborting=False), now_s)
        if progress is Progress.CONFIRMED:
            self._written = None
            self._answer(asked.request, RequestStatus.CONFIRMED, now_s)
        elif isinstance(progress, Failed):
            self._give_up()
            self._answer(asked.request, RequestStatus.FAILED, now_s, refusal("CHK-OBEYED", progress.reason))

    def _give_up(self) -> None:
        """Nothing follows behind a request that the plant may not have got, or does not obey."""
        if self._written is not None and self._written.loaded:
            self._parts.sequencer.stop()
        self._written = None

    def _offer(self, asked: _Asked, now_s: float) -> None:
        if not asked.offered:
            asked.offered = True
            self._answer(asked.request, RequestStatus.OFFERED, now_s)

    def _write(self, asked: _Asked, now_s: float) -> bool:
        request, parts = asked.request, self._parts
        del self._waiting[request.id]
        self._answer(request, RequestStatus.VERIFIED, now_s)
        actions = request.actions
        write = Write.of(Cause.REQUEST, request.id, actions)
        self._written = asked
        self._answer(request, RequestStatus.ACCEPTED, now_s)
        if actions.commands and not parts.writer.begin(write, now_s):
            self._written = None
            text = f"the intention of request {request.id!r} could not be journalled: {parts.recorder.trouble}"
            self._answer(request, RequestStatus.FAILED, now_s, refusal("CHK-JOURNAL", text))
            return False
        self.follow(None if actions.commands else Progress.CONFIRMED, now_s)
        return True

    def _close(self, asked: _Asked, status: RequestStatus, now_s: float, finding: Finding | None = None) -> None:
        del self._waiting[asked.request.id]
        self._answer(asked.request, status, now_s, finding)

    def _answer(self, request: Request, status: RequestStatus, now_s: float, finding: Finding | None = None) -> None:
        self._answers.append(Answer(request.id, status, now_s, finding))
        check, reason = ("", "") if finding is None else (finding.criterion, finding.message)
        void_s = request.seal.expires_s if status is RequestStatus.OFFERED else None
        said = request.id, request.proposer, request.actions.digest, status.value, check, reason
        event = RequestAnswered(*said, void_s)
        self._parts.note(event, now_s)

    def _refuse_unknown(self, name: str, finding: Finding, now_s: float) -> None:
        """Answer something that is not known to be what it says."""
        self._answers.append(Answer(name, RequestStatus.REFUSED, now_s, finding))
        event = RequestAnswered(name, "", "", RequestStatus.REFUSED.value, finding.criterion, finding.message)
        self._parts.note(event, now_s)


def _name(request: Request) -> str:
    """What somebody calls a request that may be anything."""
    try:
        return brief(request.id)
    except BaseException as error:  # whatever a stranger made of it
        said(error)
        return ""
