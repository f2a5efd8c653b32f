"""The recorder: hands the guard's events to a record that may fail and may hang, and never waits long for it."""

import math
import queue
import threading
from collections import deque
from dataclasses import dataclass, field

from homeostat.domain.ports import GuardEvent, GuardTrace, Kept
from homeostat.guard.texts import said

URGENT_S = 0.1
"""Longest that a fallback waits for its sync, wall-clock [s]."""
BACKLOG = 10_000
"""Most events that wait for a record that does not answer."""


@dataclass(slots=True)
class _Job:
    """One event to append, or a sync where there is none."""

    event: GuardEvent | None = None
    at_s: float = math.nan
    done: threading.Event = field(default_factory=threading.Event)
    error: str = ""


class Recorder:
    """Appends events in a thread of its own; what the record raises becomes :attr:`trouble`, never an exception.

    Noting an event waits for nothing. An event that finds a full disk is kept and appended once there is room, before
    everything that came after it.
    """

    def __init__(self, record: GuardTrace, wait_s: float = URGENT_S) -> None:
        """``record`` takes the events; ``wait_s`` bounds every wait for it, wall-clock [s]."""
        self._record, self._wait_s = record, wait_s
        self._jobs: queue.Queue[_Job | None] = queue.Queue(BACKLOG)
        self._kept: deque[_Job] = deque()
        self._last: _Job | None = None
        self._late: _Job | None = None
        self._failure, self._ended = "", False
        self.lost = 0
        """Events that found no room, or that the record cannot take."""
        self._thread = threading.Thread(target=self._work, name="guard-recorder", daemon=True)
        self._thread.start()

    @property
    def trouble(self) -> str:
        """Why the record does not work; empty while it does."""
        if self._behind and not self._ended:
            return f"the journal does not answer within {self._wait_s:g} s"
        return self._failure

    def note(self, event: GuardEvent, at_s: float) -> None:
        """Append ``event``, which happened at process time ``at_s`` [s], in its turn."""
        self._hand_over(_Job(event, at_s))

    def commit(self, wait_s: float = math.inf) -> bool:
        """Whether everything that was noted is on the disk now; False where the record fails or is late.

        No longer than ``wait_s``, wall-clock [s], and never longer than the recorder's own bound.
        """
        if self._behind:
            return False
        job = _Job()
        return self._hand_over(job) and self._answered(job, wait_s) and not job.error

    def settle(self) -> None:
        """Give a record that keeps up the time to append what was noted; one that has failed is tried again."""
        if self._failure:
            self.commit()
        elif self._last is not None and not self._behind:
            self._answered(self._last)

    def close(self) -> None:
        """Let the thread end once it has appended what waits; a record that hangs is left behind."""
        try:
            self._jobs.put_nowait(None)
        except queue.Full:
            return
        self._thread.join(self._wait_s * 10)
        self._ended = True

    @property
    def _behind(self) -> bool:
        """Whether a wait was in vain and the record has still not answered: nobody waits for it again until it has."""
        return self._ended or (self._late is not None and not self._late.done.is_set())

    def _hand_over(self, job: _Job) -> bool:
        try:
            self._jobs.put_nowait(job)
        except queue.Full:
            self.lost += 1
            return False
        self._last = job
        return True

    def _answered(self, job: _Job, wait_s: float = math.inf) -> bool:
        if job.done.wait(min(wait_s, self._wait_s)):
            return True
        self._late = job
        return False

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            try:
                self._append(job)
                if job.event is None:
                    self._record.sync()
                self._failure = ""
            except Exception as error:  # whatever a record raises is an alarm, never the end of the guard
                job.error = self._failure = f"the journal failed: {said(error)}"
            except BaseException as error:  # the process ends; nobody shall wait for what is not appended any more
                job.error = self._failure = f"the journal has ended: {type(error).__name__}"
                self._ended = True
                self._release()
                return
            finally:
                job.done.set()

    def _release(self) -> None:
        """Let go of everybody who waits for what will not be appended."""
        while not self._jobs.empty():
            waiting = self._jobs.get_nowait()
            if waiting is not None:
                waiting.error = "the journal has ended"
                waiting.done.set()

    def _append(self, job: _Job) -> None:
        """Append what was kept and then ``job``; what no room was found for stays kept, in order."""
        if job.event is not None and len(self._kept) < BACKLOG:
            self._kept.append(job)
        elif job.event is not None:
            self.lost += 1
        while self._kept:
            first = self._kept[0]
            assert first.event is not None
            try:
                self._record.record(first.event, first.at_s)
            except Kept:  # the record stores it itself once there is room
                self._kept.popleft()
                raise
            except OSError:
                raise
            except Exception:  # the record cannot take this one, and will not later
                self.lost += 1
                self._kept.popleft()
                raise
            self._kept.popleft()
