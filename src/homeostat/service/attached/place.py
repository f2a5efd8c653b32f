"""The directory of an attached plant: its journal, as of a run, and the sockets at which others reach its guard."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from homeostat.domain.events.people import ModeEntered
from homeostat.domain.mode import Role
from homeostat.guard.restart.memory import FOLDED
from homeostat.journal import BrokenChain, Record, Resumed, RunStarted, Setting
from homeostat.journal.beside.files import JOURNAL
from homeostat.journal.beside.lock import locked
from homeostat.journal.chain import GENESIS
from homeostat.journal.reading import follow
from homeostat.links.errors import LinkError

ATTACHED: Final = "attached"
"""Name of the setting that tells the journal of an attached plant from a run's."""
THINKING: Final = "thinking.sock"
"""Socket at which the process that thinks reaches the guard."""
HISTORY: Final = "history.sock"
"""Socket at which the process that keeps the history reaches the guard."""
KEPT: Final = ".history"
"""Ending of the folder beside the directory in which the history is, unless another one is said."""
DOORS: Final = {Role.OPERATOR: "operator.sock", Role.ENGINEER: "engineer.sock"}
"""Role -> the socket for it: whoever may open it has the role."""
FREE_S: Final = 5.0
"""Longest wait for a directory that another process has, wall-clock [s]: a guard sees soon that it is alone."""
LONGEST_PATH: Final = 107
"""Longest path of a local socket [byte]."""


class AttachError(LinkError):
    """A plant cannot be attached in a directory; one line with the remedy."""


def hold(directory: Path, within_s: float = FREE_S) -> int:
    """Make ``directory`` where it is not there; its lock, which ends with the last process that has it.

    A guard whose service has just died has it until it sees that, so it is tried for ``within_s`` [s]. Raises
    AttachError where another service has it, or sockets in it would have paths that are too long.
    """
    longest = max(map(len, (THINKING, HISTORY, *DOORS.values()))) + 1
    if (size := len(os.fsencode(directory.resolve())) + longest) > LONGEST_PATH:
        raise AttachError(
            f"sockets in {str(directory)!r} would have a path of {size} bytes, {LONGEST_PATH} are possible; "
            "choose a shorter one with --dir"
        )
    directory.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    if not locked(descriptor, within_s):
        os.close(descriptor)
        raise AttachError(f"{str(directory)!r} is attached already; stop that service, or choose another --dir")
    return descriptor


def begins(directory: Path) -> RunStarted | None:
    """How the journal in ``directory`` begins; None where there is none, or it is not an attached plant's.

    Raises BrokenChain where its first line is none that a journal has.
    """
    try:
        with (directory / JOURNAL).open("rb") as file:
            line = file.readline()
    except OSError:
        return None
    if not line.endswith(b"\n"):
        return None
    try:
        return _started(follow(1, line[:-1], GENESIS))
    except BrokenChain as broken:
        raise BrokenChain(f"the journal of {str(directory)!r} cannot be read: {broken}", 0) from None


def _started(record: Record) -> RunStarted | None:
    if record.kind != RunStarted.kind:
        return None
    from homeostat.record.decode import decode

    started = decode(record)
    return started if isinstance(started, RunStarted) and started.settings.get(ATTACHED) is True else None


def refuse_unfit(directory: Path, plant: str, configuration: str) -> None:
    """AttachError where ``directory`` holds something else than what was attached there before with this plant."""
    names = [path.name for path in directory.iterdir() if not path.is_socket()]
    started = begins(directory)
    if started is None:
        if names:
            raise AttachError(f"{str(directory)!r} is not empty; choose another directory with --dir")
        return
    made = str(started.settings.get("configuration"))
    if (started.case, made) != (plant, configuration):
        raise AttachError(
            f"{str(directory)!r} is of plant {started.case!r} in configuration {made[:12]}, and not of {plant!r} in "
            f"{configuration[:12]}; choose another directory with --dir, after a look at the latch in this one"
        )


def first_event(plant: str, chosen: Sequence[Setting], wall_started: str, versions: Sequence[Setting]) -> RunStarted:
    """The first event of an attached plant's journal; ``chosen``: what it is attached with."""
    return RunStarted(plant, (), 1, (Setting(ATTACHED, True), *chosen), tuple(versions), wall_started)


def changed(records: Sequence[Record], stated: Sequence[Setting]) -> tuple[Setting, ...]:
    """Those of ``stated`` that the journal of ``records`` does not state, or stated otherwise when it last did."""
    from homeostat.record.decode import decode

    before: dict[str, str | float | bool] = {}
    for event in (decode(record) for record in records if record.kind in (RunStarted.kind, Resumed.kind)):
        if isinstance(event, RunStarted):
            before |= event.settings | {version.name: version.value for version in event.versions}
        elif isinstance(event, Resumed):
            before |= {setting.name: setting.value for setting in event.changed}
    return tuple(setting for setting in stated if before.get(setting.name) != setting.value)


RECALLED: Final = FOLDED | {RunStarted.kind, Resumed.kind, ModeEntered.kind}
"""Kinds of the events that say where a guard stood, and what it was attached with: months of the rest are followed, not
read."""
