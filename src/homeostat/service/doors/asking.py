"""The side of whoever asks: one line to a service, and its answer."""

from __future__ import annotations

import contextlib
import json
import socket
import time
from pathlib import Path
from typing import Any, Final

from homeostat.domain.mode import PersonCommand, Role
from homeostat.service.answers import Heard
from homeostat.service.attached.place import DOORS
from homeostat.service.doors.messages import ANSWER_S, LARGEST, STATUS
from homeostat.service.order import OrderError, run_identity, written

LATE_S: Final = 5.0
"""By how much a service may answer later than it says, wall-clock [s]."""


def status(directory: Path) -> dict[str, Any]:
    """How the plant that is attached in ``directory`` stands; OrderError where no service runs, or it does not answer.

    Whoever may pass one of the doors may ask.
    """
    try:
        told = _asked(directory, Role.OPERATOR, STATUS)
    except PermissionError:
        told = _asked_or_refused(directory, Role.ENGINEER, STATUS)
    found = told.get("status")
    if not isinstance(found, dict):
        raise OrderError(f"the service of {str(directory)!r} says {str(told.get('error', told))[:200]}")
    return found


def order(directory: Path, command: PersonCommand) -> Heard:
    """Give ``command`` to the service of ``directory``; what came of it.

    OrderError where no service runs, whoever asks may not order in that role, or there is no answer.
    """
    line = written(command, run_identity(directory), time.time())
    told = _asked_or_refused(directory, command.role, line)
    if "done" not in told:
        raise OrderError(f"the service of {str(directory)!r} says: {str(told.get('error', told))[:500]}")
    return Heard(bool(told["done"]), str(told.get("reason", "")), bool(told.get("counts")))


def _asked_or_refused(directory: Path, role: Role, line: bytes) -> dict[str, Any]:
    try:
        return _asked(directory, role, line)
    except PermissionError:
        raise OrderError(
            f"you may not order as {role.value}: {str(directory / DOORS[role])!r} is for its owner and its group"
        ) from None


def _asked(directory: Path, role: Role, line: bytes) -> dict[str, Any]:
    """The answer to ``line``; OrderError where there is none, PermissionError where the door is shut to us."""
    path = directory / DOORS[role]
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as door:
        door.settimeout(ANSWER_S + LATE_S)
        try:
            door.connect(str(path))
        except (FileNotFoundError, ConnectionRefusedError):
            raise OrderError(
                f"no service runs in {str(directory)!r}; 'homeostat attach' with --dir {directory} starts one"
            ) from None
        try:
            with contextlib.suppress(BrokenPipeError):  # whoever is turned away was told so before it could ask
                door.sendall(line)
            with door.makefile("rb") as lines:
                told = json.loads(lines.readline(LARGEST))
                if isinstance(told, dict) and "within_s" in told:  # the guard has it, and hears it in its next tick
                    door.settimeout(float(told["within_s"]) + LATE_S)
                    told = json.loads(lines.readline(LARGEST))
        except (OSError, ValueError, TypeError):
            raise OrderError(f"the service of {str(directory)!r} does not answer; look at what it does") from None
    if not isinstance(told, dict):
        raise OrderError(f"the service of {str(directory)!r} gives no answer that can be read")
    return told
