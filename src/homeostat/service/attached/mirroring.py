"""What the plant's own people see of the guard: its alarms in their list, and a recipe that waits after a fallback."""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Final, Protocol, TypeAlias, final

from homeostat.domain.alarm import Alarm, Priority
from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.observation import Settled, Trouble
from homeostat.links.errors import LinkError

OPERATORS: Final = "the plant's operators"
"""Who acknowledges in the plant's own list: it does not say which of them."""
LISTED: Final = "source:alarm-list"
"""Alarm of a list at the plant that takes nothing; it is not mirrored itself."""
WAITS: Final = "source:recipe"
"""Alarm of a recipe that waits although it need not, or does not although it must."""
AGAIN_S: Final = 5.0
"""Wait before what was not taken is written again, wall-clock [s]."""
SETTLES_S: Final = 2.0
"""How long after our text changed an acknowledgement may still be one of the text before, wall-clock [s]."""
LONGEST: Final = 400
"""Longest text in the plant's list [characters]."""
_STILL: Final = (
    "the plant's recipe still waits, as after the fallback; let it go on at the plant, or raise the mode to one that "
    "writes"
)
_THEIRS: Final = "the plant's recipe waits, and not because of this guard; who let it wait lets it go on at the plant"
_IGNORED: Final = "the plant takes the order that its recipe must wait, and does not show that it does; stop it there"
IGNORED: Final = 3
"""How often in turn the plant takes an order to wait before it is called one that ignores it [1]."""
_URGENT: Final = tuple(reversed(Priority))
_Once: TypeAlias = tuple[str, float]
"""An alarm, and when it was raised [s]: the same one again is another one."""


class Listing(Protocol):
    """A link as far as it reaches the plant's own alarm list and recipe."""

    @property
    def trouble(self) -> str:
        """Why there is no connection; empty while there is one."""
        ...

    @property
    def connections(self) -> int:
        """Goes up with every connection that was up, and with every one that was lost."""
        ...

    @property
    def acknowledged(self) -> bool:
        """Whether an operator of the plant has acknowledged what stands in the list."""
        ...

    @property
    def held(self) -> bool | None:
        """Whether the plant's recipe waits; None where the plant does not say."""
        ...

    def raise_alarm(self, text: str, seen: bool = False) -> None:
        """Have ``text`` stand in the list; ``seen``: somebody has acknowledged it here already."""
        ...

    def hold(self, on: bool) -> None:
        """Let the plant's recipe wait or go on."""
        ...


@dataclass(frozen=True, slots=True)
class Shown:
    """What stands in the list."""

    text: str = ""
    """The words; empty for nothing."""
    alarms: frozenset[_Once] = frozenset()
    """The alarms that they name: whoever acknowledges them has seen these and no others."""
    seen: bool = False
    """Whether all of them were acknowledged here."""


def shown(standing: Iterable[Alarm]) -> Shown:
    """What the list says of alarms that are ``standing``: the most urgent first, as many as there is room for."""
    alarms = sorted(
        (alarm for alarm in standing if alarm.id != LISTED),
        key=lambda a: (_URGENT.index(a.priority), -a.raised_s, a.id),
    )
    words, named = "", list[Alarm]()
    for alarm in alarms:
        one = f"{alarm.priority.value} {alarm.id}: {alarm.cause}"
        room = LONGEST - len(words) - len("; and 9999 more")
        if named and len(one) + 2 > room:
            words += f"; and {len(alarms) - len(named)} more"
            break
        words += ("; " if named else "") + one[:room]
        named.append(alarm)
    once = frozenset((alarm.id, alarm.raised_s) for alarm in named)
    return Shown(words, once, bool(alarms) and all(a.acknowledged_by is not None for a in alarms))


@final
class Mirror:
    """Is told how the guard stands at each tick, and waits for nothing; a thread of its own writes."""

    def __init__(
        self,
        link: Listing,
        put: Callable[[PersonCommand | Trouble | Settled], object],
        lists: bool,
        holds: bool,
        settles_s: float = SETTLES_S,
    ) -> None:
        """``put`` takes what the guard is told; ``lists``, ``holds``: whether the plant can be told of either.

        ``settles_s``: wall-clock [s].
        """
        self._link, self._put, self._lists, self._holds = link, put, lists, holds
        self._changed = threading.Condition()
        self._wanted, self._listed = Shown(), None if lists else Shown()
        self._hold: bool | None = None
        self._wrote: bool | None = None
        self._in_vain = 0
        self._ours = self._over = self._unseen = self._answers = self._told = False
        self._settles_s, self._settled_s = settles_s, 0.0
        self._asked_again: Shown | None = None
        self._connection, self._ordered = link.connections, set[_Once]()
        self._troubles: dict[str, str] = {}
        if lists or holds:
            threading.Thread(target=self._write_on, name="the plant's alarm list", daemon=True).start()

    def look(self, standing: Iterable[Alarm], latched: bool, mode: Mode) -> None:
        """One tick: what the plant must show from now on, and what its operators have acknowledged."""
        alarms = tuple(standing)
        with self._changed:
            self._told = True
            if self._link.connections != self._connection:
                self._connection = self._link.connections
                self._listed = None if self._lists else self._listed  # another server, perhaps, that knows nothing
                self._wrote = None
            if self._lists:
                self._wanted = shown(alarms)
                self._acknowledge(alarms)
            if self._holds:
                self._wait(latched, mode)
            self._changed.notify_all()

    def close(self) -> None:
        """Write nothing any more; what stands in the list stays there."""
        with self._changed:
            self._over = True
            self._changed.notify_all()

    def _acknowledge(self, alarms: tuple[Alarm, ...]) -> None:
        """Order it here where it was done there, after what stands there now was seen to be unacknowledged.

        What the plant says while our text settles may be of the text before. What it calls acknowledged by then was
        too early, or nobody's: its operators are asked again, unless the plant never says that they were not.
        """
        listed = self._listed
        if listed is None or not listed.alarms or self._link.trouble:
            self._unseen = False
            return
        settled = time.monotonic() >= self._settled_s
        if not self._link.acknowledged:
            self._unseen, self._answers = settled, True
            return
        if not settled or listed.seen:
            return
        if not self._unseen:
            if self._answers or listed != self._asked_again:
                self._asked_again, self._listed, self._answers = listed, None, False
            return
        for alarm in alarms:
            once = alarm.id, alarm.raised_s
            if once in listed.alarms and alarm.acknowledged_by is None and once not in self._ordered:
                self._ordered.add(once)
                reason = "acknowledged in the plant's own alarm list"
                order = f"plant-{secrets.token_hex(8)}"
                self._put(PersonCommand(order, OPERATORS, Role.OPERATOR, Verb.ACKNOWLEDGE, alarm.id, reason=reason))
        self._ordered &= {(alarm.id, alarm.raised_s) for alarm in alarms}

    def _wait(self, latched: bool, mode: Mode) -> None:
        """A recipe waits while a latch stands, in every mode; it goes on with a mode that writes, where we held it.

        What goes on at the plant after the latch is nobody's of ours any more: who lets it wait then is somebody else.
        """
        held = self._wrote if self._link.held is None else self._link.held
        self._ours = self._ours and (latched or held is not False)
        self._hold = None
        if latched:
            self._hold = True if held is not True else None
        elif self._ours and mode.writes:
            self._hold = False
        if not latched and held is True and not (self._ours and mode.writes):
            self._trouble(WAITS, _STILL if self._ours else _THEIRS, Priority.HIGH if self._ours else Priority.LOW)
        elif self._hold is None:
            self._in_vain = 0
            self._trouble(WAITS, "")

    def _write_on(self) -> None:
        while not self._over:
            with self._changed:
                self._changed.wait_for(lambda: self._over or self._due, AGAIN_S)
                wanted, hold, before = self._wanted, self._hold, self._listed
            if self._over or self._link.trouble or not self._told:
                self._rest()
                continue
            done = hold is None or self._held(hold)
            if wanted != before and self._lists:
                if self._tried(LISTED, partial(self._link.raise_alarm, wanted.text, wanted.seen)):
                    with self._changed:
                        self._listed, self._unseen = wanted, False
                        self._settled_s = time.monotonic() + self._settles_s
                else:
                    done = False
            self._rest(1.0 if done else AGAIN_S, hold)

    def _held(self, hold: bool) -> bool:
        """Whether the plant took it that its recipe waits, or goes on; what is no longer wanted is not written."""
        with self._changed:
            if self._hold is not hold:
                return True
        done = self._tried(WAITS, partial(self._link.hold, hold), quietly=True)
        with self._changed:
            self._ours = self._ours or (hold and done)
            self._wrote = hold if done else None
            self._in_vain = self._in_vain + 1 if hold and done else 0
        if done:
            self._trouble(WAITS, _IGNORED if self._in_vain > IGNORED else "")
        return done

    @property
    def _due(self) -> bool:
        return self._told and (self._hold is not None or self._wanted != self._listed)

    def _rest(self, seconds: float = 1.0, hold: bool | None = None) -> None:
        """Write no more often than that, wall-clock [s]; that the recipe must wait waits for nothing."""
        with self._changed:
            self._changed.wait_for(lambda: self._over or (self._hold is True and hold is not True), seconds)

    def _tried(self, name: str, write: Callable[[], None], quietly: bool = False) -> bool:
        """Whether ``write`` was taken; ``quietly``: that it was is not said yet."""
        try:
            write()
        except LinkError as refused:
            self._trouble(name, str(refused))
            return False
        if not quietly:
            self._trouble(name, "")
        return True

    def _trouble(self, name: str, cause: str, priority: Priority = Priority.HIGH) -> None:
        """Tell the guard of a trouble that began, and of one that is over."""
        if bool(cause) != bool(self._troubles.get(name)):
            self._put(Trouble(name, cause, priority) if cause else Settled(name))
        self._troubles[name] = cause
