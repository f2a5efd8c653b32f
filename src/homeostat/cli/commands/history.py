"""``homeostat history``: what was measured, shown and exported."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from homeostat.cli.arguments import UsageError, writable
from homeostat.cli.table import show_table
from homeostat.domain.quotation import printable
from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.export import export
from homeostat.history.minutes import combine
from homeostat.history.quality import told
from homeostat.history.samples import MINUTE_US, Minutes, Series, Span
from homeostat.history.store import HistoryError, HistoryReader
from homeostat.history.times import read_duration, read_span, told_time
from homeostat.journal.encode import canonical, encode

ROWS: Final = 60
"""Most rows of a tag, unless another step is asked for."""
STEPS: Final = tuple(m * MINUTE_US for m in (1, 2, 5, 10, 15, 30, 60, 120, 240, 480, 720, 1440))
"""Steps from which the shortest is taken that gives few enough rows [us]."""
SHORT_US: Final = 5 * MINUTE_US
"""Longest span whose samples are shown one by one, unless that is asked for [us]."""


def show(options: argparse.Namespace) -> int:
    """Print samples or steps of the tags, or the last value of every tag where none is named; 0."""
    history = EmbeddedHistory(options.store)
    extent = _extent(history, options.store)
    if not options.tags:
        _show_last(history, options.json)
        return 0
    tags = tuple(dict.fromkeys(options.tags))
    begin, end = getattr(options, "from"), options.to
    last = "1h" if options.last is begin is end is None else options.last
    span = read_span(last, begin, end, extent if last is None else _known(history, tags, extent))
    step_us = _step(options, span)
    if step_us is None:
        _show_samples(history.read(tags, span), span, options.json)
    else:
        _show_steps(_in_steps(history.minutes(tags, _whole(span, step_us)), step_us), span, step_us, options.json)
    return 0


def write(options: argparse.Namespace) -> int:
    """Write samples or minutes of the tags, or of all tags, to a file; 0."""
    out = writable(options.out, options.force)
    history = EmbeddedHistory(options.store)
    extent, tags = _extent(history, options.store), tuple(dict.fromkeys(options.tags)) or history.tags()
    known = extent if options.last is None or not options.tags else _known(history, tags, extent)
    span = read_span(options.last, getattr(options, "from"), options.to, known)
    rows = export(history, tags, span, out, options.minutes)
    where = f"{len(tags)} {'tag' if len(tags) == 1 else 'tags'}, {told_time(span.from_us)} to {told_time(span.to_us)}"
    print(f"{printable(str(options.out))}: {rows} rows, {where}")
    return 0


def _extent(history: HistoryReader, store: Path) -> Span:
    extent = history.extent()
    if extent is None:
        raise HistoryError(f"the history in {str(store)!r} has no samples yet")
    return extent


def _known(history: HistoryReader, tags: Sequence[str], extent: Span) -> Span:
    """``extent`` up to the latest sample of ``tags``: another one, whose clock is ahead, has some of the future."""
    ends = [int(series.time_us[0]) + 1 for series in history.last(tags).values() if series.length]
    return Span(extent.from_us, max(ends, default=extent.to_us))


def _step(options: argparse.Namespace, span: Span) -> int | None:
    """The step of what is shown [us]; None for every sample."""
    if options.samples:
        return None
    if options.step is not None:
        step_us = read_duration(options.step)
        if step_us % MINUTE_US:
            raise UsageError(f"--step {options.step} must be whole minutes, because the roll-up has one row a minute")
        return step_us
    length_us = span.to_us - span.from_us
    if length_us <= SHORT_US:
        return None
    return next((step for step in STEPS if length_us <= ROWS * step), STEPS[-1])


def _whole(span: Span, step_us: int) -> Span:
    """``span`` widened to whole steps."""
    return Span(span.from_us // step_us * step_us, -(-span.to_us // step_us) * step_us)


def _in_steps(found: Mapping[str, Minutes], step_us: int) -> dict[str, Minutes]:
    return {t: combine([replace(m, minute_us=m.minute_us // step_us * step_us)]) for t, m in found.items()}


def _show_last(history: HistoryReader, as_json: bool) -> None:
    tags = history.tags()
    found = history.last(tags)
    if as_json:
        print(canonical(encode({"tags": {tag: _samples(series) for tag, series in found.items()}})))
        return
    rows = [(tag, *_sample(series, 0)) for tag, series in found.items() if series.length]
    show_table(("tag", "last at", "value", "quality"), rows)


def _show_samples(found: Mapping[str, Series], span: Span, as_json: bool) -> None:
    if as_json:
        _print_json(span, None, {tag: _samples(series) for tag, series in found.items()})
        return
    rows = [(tag, *_sample(series, k)) for tag, series in found.items() for k in range(series.length)]
    show_table(("tag", "time", "value", "quality"), rows)


def _show_steps(found: Mapping[str, Minutes], span: Span, step_us: int, as_json: bool) -> None:
    if as_json:
        _print_json(span, step_us / 1e6, {tag: _steps(minutes) for tag, minutes in found.items()})
        return
    rows = [(tag, *_row(minutes, k)) for tag, minutes in found.items() for k in range(minutes.length)]
    show_table(("tag", f"from, {step_us // MINUTE_US} min", "least", "mean", "greatest", "last", "good of all"), rows)


def _sample(series: Series, k: int) -> tuple[str, str, str]:
    return told_time(int(series.time_us[k])), f"{series.value[k]:.6g}", told(int(series.quality[k]))


def _row(minutes: Minutes, k: int) -> Sequence[str]:
    values = (f"{column[k]:.6g}" for column in (minutes.minimum, minutes.mean, minutes.maximum, minutes.last))
    return told_time(int(minutes.minute_us[k])), *values, f"{minutes.good[k]} of {minutes.count[k]}"


def _print_json(span: Span, step_s: float | None, tags: Mapping[str, object]) -> None:
    ends = {"from": told_time(span.from_us), "to": told_time(span.to_us)}
    print(canonical(encode({**ends, "step_s": step_s, "tags": tags})))


def _samples(series: Series) -> dict[str, object]:
    times = {"time": series.time_us, "server_time": series.server_us, "own_time": series.own_us}
    told_times = {name: [told_time(t) for t in column.tolist()] for name, column in times.items()}
    return {**told_times, "value": series.value.tolist(), "status": series.quality.tolist()}


def _steps(minutes: Minutes) -> dict[str, object]:
    names = ("minimum", "mean", "maximum", "last", "good", "count")
    columns = {name: getattr(minutes, name).tolist() for name in names}
    return {"from": [told_time(t) for t in minutes.minute_us.tolist()], **columns}
