"""The course of all proposals of an episode: how each came to stand where it stands, from a journal's events alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Final

from homeostat.console.card.standing import Standing, Stands
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.events.guard import GuardStarted, RequestAnswered, StateEntered, ThinkingEnded
from homeostat.domain.events.people import ModeEntered
from homeostat.domain.events.recovery import (
    Attempted,
    Compared,
    Concluded,
    Diagnosed,
    FaultsEnded,
    NoActionTaken,
    Noticed,
    Probed,
    ReleasedActions,
    ReleaseRefused,
    SymptomsCleared,
    Waited,
)
from homeostat.domain.events.trips import FallbackActivated, Latched, LatchReset
from homeostat.domain.events.writes import Cause, WriteIntended
from homeostat.domain.mode import Mode
from homeostat.domain.request import RequestStatus
from homeostat.journal import RunFinished
from homeostat.journal.memory import Entry

_THOUGHT: Final = (Stands.TRIED, Stands.CHOSEN)
_UNSENT: Final = (*_THOUGHT, Stands.ADVISED, Stands.WAITED)
_PENDING: Final = (*_UNSENT, Stands.OFFERED, Stands.WRITTEN)
_NOBODY_WRITES: Final = tuple(mode.value for mode in Mode if not mode.writes)
_VOID_CHECKS: Final = ("CHK-EXPIRY", "CHK-AGE", "CHK-STATE", "CHK-WITHDRAWN", "CHK-CONFIGURATION", "CHK-READING")
"""Checks of the guard that say that time or the plant has passed a request by, and nothing against what it asks for."""
_ON_THE_WAY: Final = (RequestStatus.RECEIVED, RequestStatus.AUTHORISED, RequestStatus.VERIFIED)


def standings(entries: Iterable[Entry]) -> tuple[Standing, ...]:
    """Where every proposal stands after ``entries`` that ever passed its checks; what changed last comes last."""
    course = _Course()
    for entry in entries:
        course.take(entry)
    force = () if course.force is None else (course.force,)
    return tuple(sorted((*course.known.values(), *force), key=lambda one: one.turn))


@dataclass(slots=True)
class _Course:
    """What the events so far leave true."""

    known: dict[str, Standing] = field(default_factory=dict)
    """Digest -> what is not in force, whether it stands or has fallen."""
    force: Standing | None = None
    """What was released last, while nothing has overtaken it."""
    judged: dict[str, Entry] = field(default_factory=dict)
    """Digest -> the last attempt that passed its checks; of waits by their length."""
    open: dict[str, tuple[str, Stands]] = field(default_factory=dict)
    """Request that waits for a person, or is being written -> its digest, and which of both."""
    until_s: float = 0.0
    """When a wait is over [s]."""
    latched: bool = False
    """Whether nothing is released until a person resets the latch."""
    turns: int = 0
    """How often anything has changed."""

    def take(self, entry: Entry) -> None:
        """Take one event."""
        match entry.event:
            case Attempted():
                self._tried(entry, entry.event)
            case Compared(chosen=chosen, alternatives=alternatives):
                waits = [a for a in alternatives if a.digest == chosen and a.kind is AlternativeKind.WAIT]
                if waits and (judged := self.judged.get(_wait(waits[0].seconds))) is not None:
                    self.judged[chosen] = judged
                    self.known.pop(_wait(waits[0].seconds), None)
                other = "something else was chosen" if chosen else "of what could be done nothing was chosen"
                self._fall(_UNSENT, Stands.OVERTAKEN, other, entry, but=chosen)
                if chosen:
                    self._stand(chosen, Stands.CHOSEN, entry)
            case Waited(seconds=seconds, follows=follows):
                target = f"to {follows.split(' > ')[-1]!r}" if " > " in follows else repr(follows)
                self._wait(seconds, f"{target} is expected to follow", entry)
            case Probed(commands=(), seconds=seconds, apart=apart):
                self._wait(seconds, f"{apart[0]!r} is to be told from {apart[1]!r} by then", entry)
            case RequestAnswered() as answered if answered.digest:
                self._answered(answered, entry)
            case ReleasedActions(digest=digest):
                before = self.known.get(digest)  # recovery may say so when a fallback has acted since
                if before is None or before.released_s is None or before.since_s < entry.at_s:
                    self._released(digest, entry)
            case ReleaseRefused(digest=digest, reason=reason):
                self._end(digest, Stands.REFUSED, f"the release check on fresh readings: {reason}", entry)
            case _:
                self._passed_by(entry)

    def _passed_by(self, entry: Entry) -> None:
        """What is about no proposal, and ends some."""
        match entry.event:
            case Noticed() if entry.at_s >= self.until_s:
                self._fall((*_THOUGHT, Stands.WAITED), Stands.OVERTAKEN, "the plant is looked at again", entry)
            case Noticed():
                self._fall(_THOUGHT, Stands.OVERTAKEN, "the plant is looked at again", entry)
            case Diagnosed():
                self._fall((*_THOUGHT, Stands.WAITED), Stands.OVERTAKEN, "the plant is looked at again", entry)
            case NoActionTaken():
                self._fall(_UNSENT, Stands.OVERTAKEN, "the plant is left as it is", entry)
            case FaultsEnded() | SymptomsCleared():
                self._fall(_UNSENT, Stands.OVERTAKEN, "what was wrong is over", entry)
            case Concluded(reason=reason):
                ended = (*_THOUGHT, Stands.WAITED) if entry.at_s >= self.until_s else _THOUGHT
                self._fall(ended, Stands.VOID, f"recovery thinks no more about it, because {reason}", entry)
            case ModeEntered(mode=mode):
                self._fall((*_THOUGHT, Stands.ADVISED), Stands.VOID, f"the mode is {mode!r} now", entry)
                self._stop(mode)
            case WriteIntended(cause=Cause.PERSON, source=person):
                self._fall(_UNSENT, Stands.OVERTAKEN, f"{person} ordered a start", entry)
                self._replace(f"{person} ordered a start", entry)
            case StateEntered(state=state):
                for digest, one in list(self.known.items()):
                    begins = one.judged.event.path[:1] if one.judged and isinstance(one.judged.event, Attempted) else ()
                    if one.stands in _THOUGHT and begins not in ((), (state,)):
                        self._end(digest, Stands.VOID, f"the plant went on to {state!r}", entry)
            case FallbackActivated(strategy=strategy):
                self.open.clear()
                self._fall(_PENDING, Stands.OVERTAKEN, f"fallback {strategy!r} acted", entry)
                self._replace(f"fallback {strategy!r} acted", entry)
            case Latched():
                self.latched = True
                self._fall(_UNSENT, Stands.OVERTAKEN, "a fallback acts, and nothing is released after it", entry)
            case LatchReset():
                self.latched = False
            case GuardStarted():
                self.open.clear()
                self._fall(_PENDING, Stands.VOID, "the guard began again and knows of no request", entry)
            case ThinkingEnded(reason=reason):
                self._fall((*_THOUGHT, Stands.WAITED), Stands.VOID, reason, entry)
            case RunFinished():
                pending = (*_THOUGHT, Stands.OFFERED, Stands.WRITTEN)
                self._fall(pending, Stands.VOID, "the run has ended", entry)
            case _:
                pass

    def _tried(self, entry: Entry, tried: Attempted) -> None:
        """A judgement on the twin; of what was asked for or written it changes nothing."""
        key = _wait(tried.seconds) if tried.what is AlternativeKind.WAIT else tried.digest
        before = self.known.get(key)
        if not key or (before is not None and before.stands in (Stands.OFFERED, Stands.WRITTEN, Stands.ADVISED)):
            return
        if not tried.approved:
            violated = next((f.message for f in tried.findings if not f.satisfied), "no reason was given")
            self._end(key, Stands.REFUSED, f"its checks: {violated}", entry)
            return
        self.judged[key] = entry
        if self.force is None or self.force.digest != key:
            self._stand(key, Stands.TRIED, entry)

    def _wait(self, seconds: float, what: str, entry: Entry) -> None:
        """It is waited for so many ``seconds``; ``what`` is to be seen then."""
        chosen = [one for one in self.known.values() if one.stands is Stands.CHOSEN and _is_wait(one)]
        self.until_s = entry.at_s + seconds
        text = f"and the plant is looked at again at {self.until_s:.0f} s; {what}"
        digest = chosen[-1].digest if chosen else _wait(seconds)
        self._stand(digest, Stands.WAITED, entry, text)

    def _answered(self, answered: RequestAnswered, entry: Entry) -> None:
        digest, status, said = answered.digest, RequestStatus(answered.status), answered.reason
        self.open.pop(answered.request, None)
        # It may have been asked for twice: then it stands as what is still open of it.
        other = next((stands for known, stands in reversed(self.open.values()) if known == digest), None)
        before = self.known.get(digest)
        match status:
            case RequestStatus.OFFERED:
                self._open(answered.request, digest, Stands.OFFERED, entry)
            case RequestStatus.ADVISED:
                self._stand(digest, Stands.ADVISED, entry)
            case RequestStatus.ACCEPTED:
                self._open(answered.request, digest, Stands.WRITTEN, entry)
            case RequestStatus.CONFIRMED:
                self._released(digest, entry, "and the plant holds it")
                if other is not None:
                    self._stand(digest, other, entry)
            case _ if status in _ON_THE_WAY:
                if before is None or before.stands not in (Stands.OFFERED, Stands.WRITTEN):
                    self._stand(digest, Stands.CHOSEN, entry)
            case RequestStatus.FAILED:
                self._replace("something else was written, and the plant does not hold it", entry)
                self._end(digest, Stands.FAILED, said, entry)
                if other is not None:
                    self._stand(digest, other, entry)
            case _ if other is not None:
                if before is None or before.stands is not other:
                    self._stand(digest, other, entry)
            case _ if answered.check == "CHK-OVERTAKEN":
                self._end(digest, Stands.OVERTAKEN, said, entry)
            case _ if status is RequestStatus.WITHDRAWN or answered.check in _VOID_CHECKS:
                self._end(digest, Stands.VOID, said, entry)
            case _:
                # A person's reason begins with their name.
                who = "" if answered.check == "CHK-PERSON" else "the guard: "
                self._end(digest, Stands.REFUSED, f"{who}{said}", entry)

    def _open(self, request: str, digest: str, stands: Stands, entry: Entry) -> None:
        """A request waits for a person, or is being written."""
        self.open[request] = digest, stands
        self._stand(digest, stands, entry)

    def _released(self, digest: str, entry: Entry, because: str = "") -> None:
        """It is in force; what was before it, or stood beside it, is overtaken."""
        if self.force is not None and self.force.digest == digest and digest not in self.known:
            return  # the guard has said so, and now recovery does
        self._fall(_UNSENT, Stands.OVERTAKEN, "something else was released", entry, but=digest)
        self._replace("something else was released", entry)
        self.known.pop(digest, None)
        self.force = replace(self._made(digest, Stands.RELEASED, entry, because), released_s=entry.at_s)

    def _stop(self, mode: str) -> None:
        """Where nobody writes in ``mode``, nothing more follows what was released, in no later mode either."""
        tried = None if self.force is None or self.force.judged is None else self.force.judged.event
        if self.force is not None and isinstance(tried, Attempted) and tried.then and mode in _NOBODY_WRITES:
            text = f"and what was still to follow is not written: the mode went to {mode!r}"
            self.force = replace(self.force, because=text)

    def _replace(self, because: str, entry: Entry) -> None:
        """What was released is not in force any more."""
        was, self.force = self.force, None
        if was is not None:
            made = self._made(was.digest, Stands.OVERTAKEN, entry, because)
            self.known[was.digest] = replace(made, judged=was.judged, released_s=was.released_s)

    def _stand(self, digest: str, stands: Stands, entry: Entry, because: str = "") -> None:
        if not self.latched or stands not in (*_THOUGHT, Stands.WAITED):
            self.known[digest] = self._made(digest, stands, entry, because)

    def _end(self, digest: str, stands: Stands, because: str, entry: Entry) -> None:
        """One proposal has fallen, if it stood."""
        before = self.known.get(digest)
        if before is not None and before.stands.holds:
            self.known[digest] = replace(self._made(digest, stands, entry, because), judged=before.judged)

    def _fall(self, which: tuple[Stands, ...], stands: Stands, because: str, entry: Entry, but: str = "") -> None:
        """All that stands as one of ``which`` says has fallen, ``but`` for one."""
        for digest, one in list(self.known.items()):
            if one.stands in which and digest != but:
                self._end(digest, stands, because, entry)

    def _made(self, digest: str, stands: Stands, entry: Entry, because: str) -> Standing:
        self.turns += 1
        return Standing(stands, digest, self.judged.get(digest), entry.at_s, self.turns, because)


def _wait(seconds: float) -> str:
    """What stands for a wait before it is chosen: its attempt has the digest of what goes on meanwhile."""
    return f"wait {seconds:g}"


def _is_wait(one: Standing) -> bool:
    tried = None if one.judged is None else one.judged.event
    return isinstance(tried, Attempted) and tried.what is AlternativeKind.WAIT
