"""The recorder: hands the guard's events to a record that may fail and may hang, and never waits long for it."""

from __future__ import annotations

import queue
import threading
from dataclasses import dataclass, field

from homeostat.domain.ports import GuardEvent, Record

WAIT_S = 0.1
"""Longest wait for a record that should answer at once, wall-clock [s]; a fallback waits no longer for its sync."""
BACKLOG = 10_000
"""Most events that wait for a record that does not answer."""


@dataclass(slots=True)
class _Job:
    """One event to append, or a sync where there is none."""

    event: GuardEvent | None
    at_s: float
    done: threading.Event = field(default_factory=threading.Event)
    error: str = ""


class Recorder:
    """Appends events in a thread of its own; what the record raises becomes :attr:`trouble`, never an exception."""

    def __init__(self, record: Record, wait_s: float = WAIT_S) -> None:
        """``record`` takes the events; ``wait_s`` bounds every wait for it, wall-clock [s]."""
        self._record, self._wait_s = record, wait_s
        self._jobs: queue.Queue[_Job | None] = queue.Queue(BACKLOG)
        self._late = False
        self.lost = 0
        """Events that found no room."""
        self.trouble = ""
        """Why the record does not work; empty while it does."""
        self._thread = threading.Thread(target=self._work, name="guard-recorder", daemon=True)
        self._thread.start()

    def note(self, event: GuardEvent, at_s: float) -> None:
        """Append ``event``, which happened at process time ``at_s`` [s]; waits only for a record that keeps up."""
        self._hand_over(_Job(event, at_s))

    def commit(self) -> bool:
        """Whether everything that was noted is on the disk now; False where the record fails or is late."""
        if self._late and self._jobs.unfinished_tasks:
            return False
        job = _Job(None, 0.0)
        self._hand_over(job)
        return job.done.is_set() and not job.error

    def close(self) -> None:
        """Let the thread end once it has appended what waits; a record that hangs is left behind."""
        try:
            self._jobs.put_nowait(None)
        except queue.Full:
            return
        self._thread.join(self._wait_s * 10)

    def _hand_over(self, job: _Job) -> None:
        try:
            self._jobs.put_nowait(job)
        except queue.Full:
            self.lost += 1
            self.trouble = f"the journal has not answered for {BACKLOG} events; {self.lost} are lost"
            return
        if self._late and self._jobs.unfinished_tasks > 1:
            return
        self._late = not job.done.wait(self._wait_s)
        if self._late:
            self.trouble = f"the journal does not answer within {self._wait_s:g} s"

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            try:
                if job.event is None:
                    self._record.sync()
                else:
                    self._record.record(job.event, job.at_s)
                self.trouble = ""
            except Exception as error:  # whatever a record raises is an alarm, never the end of the guard
                job.error = self.trouble = f"the journal failed: {error or type(error).__name__}"
            job.done.set()
            self._jobs.task_done()
