"""The guard's side: who reaches a door has its role; orders go to the mailbox, and the guard waits for nobody."""

from __future__ import annotations

import contextlib
import os
import pwd
import socket
import struct
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, final

from homeostat.domain.events.people import PersonHeard
from homeostat.domain.mode import PersonCommand, Role
from homeostat.journal import Event
from homeostat.service.attached.place import DOORS
from homeostat.service.doors.messages import ANSWER_S, LARGEST, answer, is_status
from homeostat.service.order import LARGEST as LARGEST_ORDER
from homeostat.service.order import OrderError, parsed

MOST: Final = 16
"""Most people who are talked to at a time; whoever comes then is turned away."""
ASK_S: Final = 5.0
"""Longest wait until somebody at a door has said what he wants, wall-clock [s]."""
AGAIN_S: Final = 0.2
"""Wait before a door that could let nobody in is tried again, wall-clock [s]."""
_HIGHER: Final = {Role.OPERATOR: frozenset({Role.OPERATOR}), Role.ENGINEER: frozenset(Role)}
"""Role of a door -> in which roles one may order there."""


@dataclass(frozen=True, slots=True)
class Behind:
    """What stands behind the doors."""

    order: Callable[[PersonCommand], bool]
    """Takes an order to the guard; False where it is not taken."""
    status: Callable[[], Mapping[str, Any]]
    """How the plant stands."""
    identity: str
    """Identity of the journal, which an order must name."""
    within_s: float = ANSWER_S
    """Longest wait for the guard's answer to an order, which it hears in its ticks, wall-clock [s]."""


@final
class Doors:
    """Listens at both sockets, in threads of its own."""

    def __init__(
        self, directory: Path, behind: Behind, groups: Mapping[Role, int], believed: frozenset[str] = frozenset()
    ) -> None:
        """``groups``: role -> number of the group that has it beside the owner; nobody else has it where there is none.

        ``believed``: logins whose names count as people, as a console's, which asks for passwords; any other login is
        one person, whatever names it gives.

        OSError where a socket cannot be made.
        """
        self._believed = believed
        self._behind, self._places = behind, threading.BoundedSemaphore(MOST)
        self._heard = threading.Condition()
        self._awaited: dict[str, PersonHeard | None] = {}
        self._listeners: list[socket.socket] = []
        self._over = False
        for role, name in DOORS.items():
            listener = opened(directory / name, groups.get(role))
            self._listeners.append(listener)
            threading.Thread(target=self._listen, args=(listener, role), name=f"{role} door", daemon=True).start()

    def follow(self, event: Event, at_s: float) -> None:
        """Take note of what the guard said to an order, which happened at process time ``at_s`` [s]."""
        if isinstance(event, PersonHeard):
            with self._heard:
                if event.command in self._awaited:
                    self._awaited[event.command] = event
                    self._heard.notify_all()

    def close(self) -> None:
        """Nobody is listened to any more."""
        self._over = True
        for listener in self._listeners:
            with contextlib.suppress(OSError):
                os.unlink(listener.getsockname())
            listener.close()

    def _listen(self, listener: socket.socket, role: Role) -> None:
        while True:
            try:
                caller, _ = listener.accept()
            except OSError:
                if self._over:
                    return
                time.sleep(AGAIN_S)  # too many files are open, perhaps: the door is needed all the same
                continue
            if not self._places.acquire(blocking=False):
                _turn_away(caller, f"{MOST} others are being talked to")
                continue
            try:
                threading.Thread(target=self._talk, args=(caller, role), daemon=True).start()
            except RuntimeError:  # there are too many threads, or no memory for one: the door is needed all the same
                self._places.release()
                _turn_away(caller, "no thread can be begun")

    def _talk(self, caller: socket.socket, role: Role) -> None:
        try:
            with caller, contextlib.suppress(OSError):
                line = _asked(caller)
                caller.settimeout(ASK_S)
                caller.sendall(self._answered(line, role, caller)[:LARGEST])
        finally:
            self._places.release()

    def _answered(self, line: bytes, role: Role, caller: socket.socket) -> bytes:
        try:
            login = _login(caller)
            if is_status(line):
                return answer(status=dict(self._behind.status()))
            given = _by(parsed(line, self._behind.identity, time.time()), login)
            counted = "" if login in self._believed else login
            return self._ordered(replace(given, login=counted), role, caller)
        except OrderError as error:
            return answer(error=f"the order is not taken: {error}")
        except Exception as error:  # whoever asks is told; the guard goes on
            return answer(error=f"the service cannot answer: {error or type(error).__name__}")

    def _ordered(self, command: PersonCommand, role: Role, caller: socket.socket) -> bytes:
        """What came of ``command``, given at the door of ``role``; ``caller`` is told how long that may take."""
        if command.role not in _HIGHER[role]:
            return answer(error=f"this is the {role.value}'s door; nobody orders as {command.role.value} here")
        with self._heard:
            self._awaited[command.id] = None
        try:
            if not self._behind.order(command):
                return answer(error="too many orders wait already; try again")
            caller.sendall(answer(within_s=self._behind.within_s))
            with self._heard:
                self._heard.wait_for(lambda: self._awaited[command.id] is not None, self._behind.within_s)
                heard = self._awaited[command.id]
        finally:
            with self._heard:
                del self._awaited[command.id]
        if heard is None:
            return answer(
                error=f"the guard has the order, and has not answered within {self._behind.within_s:g} s; look at "
                "what it does"
            )
        return answer(done=heard.done, reason=heard.reason, counts=heard.missing > 0)


def _turn_away(caller: socket.socket, why: str) -> None:
    with caller, contextlib.suppress(OSError):
        caller.sendall(answer(error=f"{why}; try again"))


def _asked(caller: socket.socket) -> bytes:
    """The line that ``caller`` says; OSError where it has not come whole in time, however it drips."""
    line, until = b"", time.monotonic() + ASK_S
    while b"\n" not in line and (room := LARGEST_ORDER + 2 - len(line)):
        caller.settimeout(max(until - time.monotonic(), 1e-3))
        if not (part := caller.recv(room)):
            break
        line += part
        if time.monotonic() >= until:
            raise TimeoutError
    said, end, _ = line.partition(b"\n")
    return said + end


def opened(path: Path, group: int | None) -> socket.socket:
    """A listening socket at ``path``, for its owner alone, or for ``group``, too."""
    path.unlink(missing_ok=True)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        before = os.umask(0o177)
        try:
            listener.bind(str(path))
        finally:
            os.umask(before)
        if group is not None:
            os.chown(path, -1, group)
            path.chmod(0o660)
        listener.listen(MOST)
    except OSError:
        listener.close()
        raise
    return listener


def _login(caller: socket.socket) -> str:
    """The login at the other end, as the system knows it; its number where it has no name."""
    size = struct.calcsize("3i")
    _, user, _ = struct.unpack("3i", caller.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, size))
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return f"user {user}"


def _by(command: PersonCommand, login: str) -> PersonCommand:
    """``command`` with the name that was given and, where that is another, the login that gave it."""
    return command if command.person == login else replace(command, person=f"{command.person} (login {login})"[:500])
