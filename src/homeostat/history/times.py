"""Times as people write them: UTC unless they say otherwise."""

import re
from datetime import UTC, datetime, timedelta
from typing import Final

from homeostat.history.samples import NO_TIME, Span
from homeostat.history.store import HistoryError

_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_UNITS_US: Final = {"s": 1_000_000, "m": 60_000_000, "h": 3_600_000_000, "d": 86_400_000_000}
_DURATION: Final = re.compile(r"(\d{1,18}(?:\.\d{1,18})?)([smhd])")


def told_time(at_us: int) -> str:
    """A time [us], to the millisecond, as ``2026-11-25T13:00:00.250Z``; empty where there is none.

    One outside the calendar keeps its number.
    """
    if at_us == NO_TIME:
        return ""
    try:
        moment = _EPOCH + timedelta(microseconds=at_us)
    except OverflowError:
        return f"{at_us} us"
    return f"{moment.replace(tzinfo=None).isoformat(timespec='milliseconds')}Z"


def read_time(text: str) -> int:
    """A time [us] from ISO 8601, ``2026-11-25T13:00`` or with seconds, offset, or a day alone; else HistoryError."""
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise HistoryError(f"{text!r:.60} is no time; write it as 2026-11-25T13:00, which is UTC") from None
    return (moment.replace(tzinfo=moment.tzinfo or UTC) - _EPOCH) // timedelta(microseconds=1)


def read_duration(text: str) -> int:
    """A duration [us] from ``90s``, ``30m``, ``8h`` or ``7d``; HistoryError for anything else, and for nothing."""
    match = _DURATION.fullmatch(text)
    duration_us = round(float(match[1]) * _UNITS_US[match[2]]) if match else 0
    if not 0 < duration_us < 1 << 62:
        raise HistoryError(f"{text!r:.60} is no duration; write it as 90s, 30m, 8h or 7d")
    return duration_us


def read_span(last: str | None, begin: str | None, end: str | None, extent: Span) -> Span:
    """The span that ``last``, or ``begin`` and ``end``, name; what is left out follows from what there is.

    ``last`` counts from the latest sample. Raises HistoryError where they name no span.
    """
    if last is not None and (begin is not None or end is not None):
        raise HistoryError("a span is named by --last, or by --from and --to; leave one of them out")
    if last is not None:
        return Span(max(extent.to_us - read_duration(last), extent.from_us), extent.to_us)
    from_us = extent.from_us if begin is None else read_time(begin)
    to_us = extent.to_us if end is None else read_time(end)
    if to_us <= from_us:
        raise HistoryError(f"the span from {told_time(from_us)} to {told_time(to_us)} is empty; correct --from or --to")
    return Span(from_us, to_us)
