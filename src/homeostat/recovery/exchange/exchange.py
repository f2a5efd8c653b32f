"""Exchange: where the guard's loop and recovery's thread meet, and where thinking is charged."""

import asyncio
import threading
import time
from collections import deque
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any

from homeostat.domain.mode import Mode, PersonCommand
from homeostat.domain.observation import Message, Observation, Settled, Trouble, Withdraw
from homeostat.domain.ports import Clock
from homeostat.domain.request import Answer, Request

EPSILON_S = 1e-9
"""Owed time below this has passed [s]."""
PAUSE = 50
"""Observations between two moments at which recovery's event loop looks after what else it has to do."""
GRACE_S = 10.0
"""After a request was withdrawn, how long the guard's last word on it is waited for, where a tick is a second or less
[s]; so many ticks where it is longer."""


@dataclass(frozen=True, slots=True)
class ExchangeSettings:
    """Bounds of an exchange."""

    ring: int = 4096
    """Most observations that are kept for recovery; older ones are dropped and counted."""
    tick_s: float = 1.0
    """Process time between two ticks of the guard [s]."""
    busy_s: float = 600.0
    """Wall-clock time for which recovery may be busy with one observation before it is given up [s]."""


@dataclass(slots=True)
class _Parked:
    """Recovery waits for ticks, or for the answer to a request."""

    future: asyncio.Future[Answer | None]
    """Ends the wait."""
    request: str | None = None
    """Identifier of the request; None where owed time is to pass."""
    until_s: float = 0.0
    """Process time at which the request is withdrawn [s]."""
    withdrawn: bool = False
    """Whether it was."""


class Exchange:
    """Implements :class:`homeostat.domain.ports.Desk` towards recovery; the rest is for the thread of the loop.

    While recovery waits, the plant goes on. While it thinks, the plant goes on by what the clock charges: a measured
    clock charges as the wall clock runs; a declared one only where recovery looks up (``since``, ``ask``, the end of
    thinking), so that with it only one of the two threads runs at any time, and equal runs are equal.
    """

    def __init__(
        self,
        clock: Clock,
        send: Callable[[Message], object],
        lost: Callable[[str], None],
        settings: ExchangeSettings | None = None,
    ) -> None:
        """``send`` puts a message into the guard's mailbox; ``lost`` is told, once, why recovery was given up."""
        self._clock, self._send, self._lost = clock, send, lost
        self._settings = settings or ExchangeSettings()
        self._grace_s = GRACE_S * max(self._settings.tick_s, 1.0)
        self._changed = threading.Condition()
        self._unread: deque[Observation] = deque()
        self._kept: deque[Observation] = deque(maxlen=self._settings.ring)
        self._past: tuple[Observation, ...] = ()
        self._owed_s = 0.0
        self._idle = False
        self._busy_since = time.monotonic()
        self._parked: _Parked | None = None
        self._work: tuple[asyncio.AbstractEventLoop, asyncio.Task[None]] | None = None
        self._overtaken: str | None = None
        self._over = False
        self._calls = 0
        self.dropped = 0
        """Observations that recovery never saw, because it was too slow."""

    # --- towards recovery ---------------------------------------------------------------------------------------

    async def next(self) -> Observation | None:
        """The next observation, each one once and in order; None when there is no further one."""
        self._calls += 1
        if self._calls % PAUSE == 0:
            await asyncio.sleep(0)
        with self._changed:
            self._idle = True
            self._changed.notify_all()
            while not self._unread and not self._over:
                self._changed.wait()
            self._idle, self._busy_since = False, time.monotonic()
            return self._unread.popleft() if self._unread and not self._over else None

    async def since(self, at_s: float) -> tuple[Observation, ...]:
        """Every observation after process time ``at_s``, at least the freshest; charged thinking time passes first."""
        await self._settle()
        with self._changed:
            if not self._clock.measured:  # nothing else ends a long deliberation: whoever looks up does not hang
                self._busy_since = time.monotonic()
            found: list[Observation] = []
            for observation in reversed(self._kept):
                if observation.now_s <= at_s:
                    break
                found.append(observation)
            return tuple(reversed(found)) or (self._kept[-1],)

    def put(self, message: Message) -> None:
        """Send ``message`` to the guard; what was overtaken sends nothing, and nobody here speaks for a person."""
        if isinstance(message, PersonCommand):
            raise PermissionError(f"recovery may not order {message.verb!r} in the name of {message.person!r}")
        with self._changed:
            if self._overtaken is None and not self._over:
                self._send(message)

    async def ask(self, request: Request, within_s: float) -> Answer:
        """The final answer to ``request``, which is withdrawn after ``within_s`` [s]; TimeoutError where none comes."""
        await self._settle()
        with self._changed:
            parked = self._park(request.id, self._kept[-1].now_s + within_s)
            self._send(request)
        try:
            answer = await parked.future
        except BaseException:
            self._send(Withdraw(request.id, self._overtaken or "who asked has no time left"))
            raise
        finally:
            self._unpark(parked)
        if answer is None:
            waited_s = within_s + self._grace_s
            raise TimeoutError(f"the guard did not answer request {request.id!r} within {waited_s:.0f} s")
        return answer

    async def think(self, work: Coroutine[Any, Any, None]) -> bool:
        """Do ``work`` as charged thinking; whether it came to its end before something overtook it.

        RuntimeError where it was cancelled by anything else than what overtook it here: that is a bug in it.
        """

        async def charged() -> None:
            await work
            await self._settle()

        loop = asyncio.get_running_loop()
        task = loop.create_task(charged())
        with self._changed:
            self._work = loop, task
            self._clock.start()
        try:
            await asyncio.wait({task})
        finally:
            task.cancel()  # where who waits for it is cancelled; nothing where it has ended
            with self._changed:
                self._clock.stop()
                overtaken = self._overtaken is not None or self._over
                self._work, self._overtaken = None, None
        if not task.cancelled():
            task.result()
            return True
        if overtaken:
            return False
        raise RuntimeError("thinking was cancelled, and nothing has overtaken it")

    @property
    def behind(self) -> bool:
        """Whether observations wait that were not given yet."""
        with self._changed:
            return bool(self._unread)

    @property
    def hang_s(self) -> float:
        """Wall-clock time after which one answer is taken to hang [s]; infinite where the time that is left ends it."""
        return self._clock.hang_s

    def wall_s(self, process_s: float) -> float:
        """Wall-clock seconds after which thinking that may take ``process_s`` is cut off [s]."""
        return self._clock.wall_s(process_s)

    # --- towards the loop ---------------------------------------------------------------------------------------

    def remember(self, past: tuple[Observation, ...]) -> None:
        """Show ``past`` to recovery together with the next tick: what went before a guard that goes on."""
        with self._changed:
            self._past = past[-self._settings.ring + 1 :]

    def publish(self, observation: Observation, overtaking: str | None = None) -> None:
        """Show one more tick to recovery; never blocks. What it thinks about is cancelled where something overtakes it.

        Both happen at once: whoever was cancelled has the tick that overtook it among those that wait for it.
        """
        with self._changed:
            past, self._past = self._past, ()
            self._kept.extend(past)
            self._unread.extend(past)
            passed_s = observation.now_s - self._kept[-1].now_s if self._kept else self._settings.tick_s
            self._collect()
            if self._owed_s > EPSILON_S:
                self._owed_s -= passed_s
            self._kept.append(observation)
            self._unread.append(observation)
            if len(self._unread) > self._settings.ring:
                self._unread.popleft()
                self.dropped += 1
            if overtaking is None:
                self._look_after(observation)
            else:
                self.cancel(overtaking)
            self._changed.notify_all()

    def hold(self) -> None:
        """Return when the plant may go on by a tick: recovery waits, thinks on at its own cost, or is given up."""
        with self._changed:
            while not self._over and not self._may_go_on():
                left_s = self._busy_since + self._settings.busy_s - time.monotonic()
                if left_s <= 0.0:
                    self._give_up(f"recovery was busy for {self._settings.busy_s:.0f} s without a break")
                    return
                ahead_s = max(self._settings.tick_s - self._owed_s, 0.0)
                self._changed.wait(min(left_s, max(self._clock.wall_s(ahead_s), 0.001)))

    def cancel(self, reason: str) -> None:
        """Something overtakes what recovery thinks about now: it is cancelled, and sends nothing more."""
        with self._changed:
            if self._work is not None:
                if self._parked is not None:
                    self._clock.collect_s()  # what passed while it waited was no thinking
                self._overtaken, self._parked = reason, None
                _soon(self._work[0], self._work[1].cancel)

    def close(self) -> None:
        """There is no further tick."""
        with self._changed:
            self._over = True
            self.cancel("the run is over")
            self._changed.notify_all()

    @property
    def busy_s(self) -> float:
        """How long recovery has gone on without a look at the plant, wall-clock [s]; 0 while it waits."""
        with self._changed:
            return 0.0 if self._idle or self._parked is not None else time.monotonic() - self._busy_since

    @property
    def at_rest(self) -> bool:
        """Whether nobody thinks: recovery waits for the next tick, or for a person's answer, or is lost."""
        with self._changed:
            if self._parked is not None:
                return self._parked.request is not None and self._kept[-1].mode is Mode.APPROVE
            return self._over or (self._idle and not self._unread)

    def report(self, name: str, cause: str) -> None:
        """Have the guard call a person: ``cause`` is one sentence about ``name``."""
        self._send(Trouble(name, cause))

    def settle(self, name: str) -> None:
        """What was reported as ``name`` is over."""
        self._send(Settled(name))

    def give_up(self, reason: str) -> None:
        """Go on without recovery, which is lost."""
        with self._changed:
            if not self._over:
                self._give_up(reason)

    # --- both ---------------------------------------------------------------------------------------------------

    async def _settle(self) -> None:
        """Let the thinking time that is owed pass; CancelledError where something has overtaken the thinking."""
        with self._changed:
            if self._overtaken is not None or self._over:
                raise asyncio.CancelledError(self._overtaken)
            self._collect()
            if self._owed_s <= EPSILON_S:
                return
            parked = self._park()
        try:
            await parked.future
        finally:
            self._unpark(parked)

    def _park(self, request: str | None = None, until_s: float = 0.0) -> _Parked:
        """Recovery waits from now on."""
        if self._overtaken is not None or self._over:
            raise asyncio.CancelledError(self._overtaken)
        self._parked = _Parked(asyncio.get_running_loop().create_future(), request, until_s)
        self._changed.notify_all()
        return self._parked

    def _unpark(self, parked: _Parked) -> None:
        """Recovery goes on, whatever it waited for."""
        with self._changed:
            if self._parked is parked:
                self._parked = None
                self._clock.collect_s()

    def _collect(self) -> None:
        """Charge what was thought since the last look at the clock."""
        if self._parked is None:
            self._owed_s += self._clock.collect_s()

    def _look_after(self, observation: Observation) -> None:
        """End recovery's wait where what it waits for has come, and withdraw what waited too long."""
        parked = self._parked
        if parked is None:
            return
        if parked.request is None:
            if self._owed_s <= EPSILON_S:
                self._resume(parked, None)
            return
        final = [a for a in observation.answers if a.request == parked.request and a.status.final]
        if final:
            self._resume(parked, final[-1])
        elif observation.now_s >= parked.until_s and not parked.withdrawn:  # before anybody gives it up
            parked.withdrawn = True
            self._send(Withdraw(parked.request, "no answer in the time that there was for it"))
        elif observation.now_s >= parked.until_s + self._grace_s:
            self._resume(parked, None)

    def _resume(self, parked: _Parked, answer: Answer | None) -> None:
        self._parked, self._busy_since = None, time.monotonic()
        self._clock.collect_s()  # what passed while it waited was no thinking
        _soon(parked.future.get_loop(), lambda: None if parked.future.done() else parked.future.set_result(answer))

    def _may_go_on(self) -> bool:
        if self._parked is not None or (self._idle and not self._unread):
            return True
        if self._work is None or not self._clock.measured:
            return False
        self._collect()
        return self._owed_s >= self._settings.tick_s - EPSILON_S

    def _give_up(self, reason: str) -> None:
        self.close()
        self._lost(reason)


def _soon(loop: asyncio.AbstractEventLoop, call: Callable[[], object]) -> None:
    """Have ``loop`` make ``call``; nothing where the loop has ended, as nobody waits in it any more."""
    try:
        loop.call_soon_threadsafe(call)
    except RuntimeError:
        return
