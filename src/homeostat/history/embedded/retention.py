"""What is dropped: what is too old or too much, and on a full disk the oldest samples, then minutes; events never."""

import errno
import math
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final, TypeVar

from homeostat.history.embedded.layout import ARRIVALS, MINUTES, RAW, TableFile, listed
from homeostat.history.settings import HistorySettings

T = TypeVar("T")

FULL: Final = (errno.ENOSPC, errno.EDQUOT)
"""Errors that say that the disk is full."""
WAIT_S: Final = 5.0
"""Longest wait for tables that are being joined, and hold the room until then, before there is no room [s]."""


def too_old(store: Path, settings: HistorySettings, now_us: int) -> list[TableFile]:
    """Samples, arrivals and roll-ups that are older than the settings keep them; ``now_us``: the latest time [us]."""
    found = list[TableFile]()
    for kind, days in ((RAW, settings.raw_days), (ARRIVALS, settings.raw_days), (MINUTES, settings.minutes_days)):
        oldest = _label(now_us, days)
        found += [t for t in listed(store, kind).tables if t.label < oldest[: len(t.label)]]
    return found


def too_much(store: Path, settings: HistorySettings) -> list[TableFile]:
    """The oldest samples, as many as make the rest no more than the settings allow, with their arrivals."""
    tables = listed(store, RAW).tables
    sizes = [_size(table) for table in tables]
    left, drop = sum(sizes), list[TableFile]()
    for table, size in zip(tables[:-1], sizes, strict=False):
        if left <= settings.raw_bytes:
            break
        left -= size
        drop.append(table)
    return _with_arrivals(store, drop)


def oldest(store: Path) -> list[TableFile]:
    """The oldest table of samples with its arrivals; where there is none, the oldest of the roll-up, or nothing."""
    return _with_arrivals(store, listed(store, RAW).tables[:1]) or list(listed(store, MINUTES).tables[:1])


def _never(seconds: float) -> bool:
    return False


def with_room(
    store: Path, work: Callable[[], T], told: Callable[[str], None], ended: Callable[[float], bool] = _never
) -> T:
    """What ``work`` returns; as long as the disk is full, what is oldest is dropped for it, which is told.

    What is being joined beside holds its room until that is over, even what was dropped of it. So where one table was
    dropped in vain, or there is none, that is waited for, :data:`WAIT_S` at most, before more is dropped, or it is
    given up. ``ended`` returns whether anything was under way that has ended within so many seconds. Raises OSError
    where there is nothing left to drop, or anything else is wrong.
    """
    until_s, dropped, last = math.inf, False, False
    while True:
        try:
            return work()
        except OSError as error:
            if error.errno not in FULL:
                raise
            tables, now_s = oldest(store), time.monotonic()
            if dropped or not tables:
                until_s = min(until_s, now_s + WAIT_S)
                if ended(max(until_s - now_s, 0.0)):
                    dropped = False
                    continue
            if tables:
                _drop_oldest(tables, told)
                dropped = True
            elif last:
                raise
            else:  # what had ended just before is not under way any more, and left its room
                last = True


def _drop_oldest(tables: Sequence[TableFile], told: Callable[[str], None]) -> None:
    what = "samples" if tables[0].folder.name == RAW else "minutes"
    told(f"the disk is full: the oldest {what}, those of {tables[0].label}, were dropped; make room")
    drop(tables)


def drop(tables: Sequence[TableFile]) -> None:
    """Remove tables, those of samples before those of arrivals."""
    for table in sorted(tables, key=lambda t: t.folder.name != RAW):
        table.path.unlink(missing_ok=True)


def _with_arrivals(store: Path, tables: Sequence[TableFile]) -> list[TableFile]:
    """``tables`` with the arrivals that no other table needs."""
    if not tables:
        return []
    return [*tables, *(t for t in listed(store, ARRIVALS).tables if t.last <= tables[-1].last)]


def _size(table: TableFile) -> int:
    try:
        return table.path.stat().st_size
    except FileNotFoundError:
        return 0


def _label(now_us: int, days: float) -> str:
    """Label of the hour that lies ``days`` before ``now_us`` [us]; the first one there is where the calendar ends."""
    try:
        moment = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=now_us) - timedelta(days=days)
    except OverflowError:
        return ""
    return moment.strftime("%Y-%m-%dT%H").zfill(13)
