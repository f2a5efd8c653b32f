"""The roll-up: one row per tag and minute."""

from collections.abc import Sequence
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from homeostat.history.quality import severity
from homeostat.history.samples import MINUTE_US, NO_TIME, Codes, Minutes, Times, Values

NONE = Minutes(*(np.empty(0, dtype=kind) for kind in ("i8", "f8", "f8", "f8", "f8", "i8", "i8", "i8")))
"""No minute at all."""


def roll_up(time_us: Times, value: Values, quality: Codes) -> Minutes:
    """The minutes of one tag's samples, which are in order of their time; shapes (n,)."""
    if not len(time_us):
        return NONE
    minute = time_us // MINUTE_US
    first = np.flatnonzero(np.r_[True, minute[1:] != minute[:-1]])
    used = (severity(quality) == 0) & np.isfinite(value)
    good = np.add.reduceat(used.astype(np.int64), first)
    count = np.diff(np.r_[first, len(minute)])
    latest = np.maximum.reduceat(np.where(used, np.arange(len(minute)), -1), first)
    any_good = good > 0
    least = np.minimum.reduceat(np.where(used, value, np.inf), first)
    most = np.maximum.reduceat(np.where(used, value, -np.inf), first)
    # Each value is divided before they are added: the sum of large ones would overflow.
    parts = np.where(used, value, 0.0) / np.repeat(np.maximum(good, 1), count)
    return Minutes(
        minute[first] * MINUTE_US,
        _where(any_good, least),
        _where(any_good, most),
        _where(any_good, _mean(parts, first, least, most)),
        _where(any_good, value[latest]),
        np.where(any_good, time_us[latest], NO_TIME),
        good,
        count,
    )


def combine(parts: Sequence[Minutes]) -> Minutes:
    """The minutes of several parts of one tag's samples, those that arrived later last."""
    parts = [part for part in parts if part.length]
    if not parts:
        return NONE
    rows = Minutes(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Minutes)))
    order = np.argsort(rows.minute_us, kind="stable")
    minute = rows.minute_us[order]
    first = np.flatnonzero(np.r_[True, minute[1:] != minute[:-1]])
    if len(first) == len(minute):
        return _picked(rows, order)
    good = np.add.reduceat(rows.good[order], first)
    any_good = good > 0
    share = rows.good[order] / np.repeat(np.maximum(good, 1), np.diff(np.r_[first, len(minute)]))
    # Ordered by minute, then by the time of the last value: the last row of a minute has the one that counts.
    by_last = order[np.lexsort((rows.last_us[order], minute))][np.r_[first[1:] - 1, len(minute) - 1]]
    least, most = np.fmin.reduceat(rows.minimum[order], first), np.fmax.reduceat(rows.maximum[order], first)
    return Minutes(
        minute[first],
        least,
        most,
        _where(any_good, _mean(np.where(share > 0, rows.mean[order], 0.0) * share, first, least, most)),
        rows.last[by_last],
        rows.last_us[by_last],
        good,
        np.add.reduceat(rows.count[order], first),
    )


def _mean(parts: Values, first: NDArray[np.intp], least: Values, most: Values) -> Values:
    """The sums of ``parts`` from each of ``first`` on: what rounding made of the largest floats is no mean of them."""
    with np.errstate(over="ignore"):
        return np.clip(np.add.reduceat(parts, first), least, most)


def _picked(rows: Minutes, order: NDArray[np.intp]) -> Minutes:
    return Minutes(*(getattr(rows, f.name)[order] for f in fields(Minutes)))


def _where(known: NDArray[np.bool_], values: Values) -> Values:
    return np.where(known, values, np.nan)
