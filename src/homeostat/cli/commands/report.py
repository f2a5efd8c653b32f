"""``homeostat report``: what an attached plant's journal tells of the last days, on one page."""

import argparse
import math
import re
import sys
from pathlib import Path

import numpy as np

from homeostat.cli.arguments import UsageError, writable
from homeostat.cli.recorded_plant import plant_of_run
from homeostat.cli.run_directory import run_directory
from homeostat.domain.quotation import printable
from homeostat.history.embedded.layout import MARK
from homeostat.history.samples import Span
from homeostat.history.store import HistoryReader
from homeostat.journal import read_events
from homeostat.journal.beside.files import write_whole
from homeostat.journal.verify.verify import lacking
from homeostat.service.attached.place import KEPT, begins
from homeostat.service.historian.observed import PROCESS_TIME
from homeostat.service.report.facts import condensed, facts_of
from homeostat.service.report.page import page
from homeostat.service.report.residuals import Followed

_DAY_US = 86_400_000_000
_UNITS_S = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86_400.0}


def carry_out(options: argparse.Namespace) -> int:
    """Write the page and print where it is; 1 where the journal's end is missing, which the page says, too."""
    run_dir = run_directory(options.run)
    out = writable(options.out, options.force)
    records = tuple(map(condensed, read_events(run_dir)))
    facts = facts_of(records, _seconds("--last", options.last), _seconds("--until", options.until))
    facts.lacking = lacking(run_dir, len(records))
    followed = _followed(options, run_dir)
    write_whole(out, page(facts, followed).encode())
    counts = f"{len(facts.alarms)} alarms, {len(facts.diagnosed)} diagnoses, {len(facts.asked)} requests"
    print(printable(f"{options.out}: {counts} in {facts.length_s:.0f} s of process time"))
    if facts.lacking:
        print(printable(f"homeostat: {str(run_dir)!r}: what came last is missing: {facts.lacking}"), file=sys.stderr)
    return 1 if facts.lacking else 0


def _followed(options: argparse.Namespace, run_dir: Path) -> Followed | None:
    """What the plant's twin makes of the history; None where there is none, which is an error only if it was named."""
    folder: Path = options.history or run_dir.resolve().with_name(run_dir.resolve().name + KEPT)
    if options.history is None and not (folder / MARK).is_file():  # a historian that never began leaves a folder
        return None
    started = begins(run_dir)
    if started is None:
        raise UsageError(f"{str(run_dir)!r} is no attached plant's, so its history has no process time; omit --history")
    from homeostat.history.embedded.reading import EmbeddedHistory
    from homeostat.service.report.residuals import residuals

    history = EmbeddedHistory(folder)
    extent = history.extent()
    if extent is None:
        return None
    plant = plant_of_run(started, run_dir, options.case)[1]
    if plant is None:
        return None  # why was said
    pace = float(str(started.settings.get("pace")))
    end_us = until_us(history, extent, _seconds("--until", options.until))
    last_us = end_us - extent.from_us
    if options.last is not None:
        last_us = round(_seconds("--last", options.last) / pace * 1e6)
    print(f"{plant.name}'s twin follows the history in {printable(str(folder))}", file=sys.stderr)
    return residuals(plant, history, Span(max(end_us - last_us, extent.from_us), end_us))


def until_us(history: HistoryReader, extent: Span, until_s: float) -> int:
    """When process time ``until_s`` was over [us]: it stood while the plant was not attached.

    At most the end of the process time that was kept: a source whose clock is wrong may have samples of another
    century. It is looked for from there on, day by day, and by more where there is nothing.
    """
    last = history.last([PROCESS_TIME])[PROCESS_TIME]
    to_us = int(last.time_us[0]) + 1 if last.length else extent.to_us
    length_us = _DAY_US
    while math.isfinite(until_s) and to_us > extent.from_us:
        part = Span(max(to_us - length_us, extent.from_us), to_us)
        found = history.read([PROCESS_TIME], part)[PROCESS_TIME]
        before = np.flatnonzero(found.value <= until_s)
        if before.size:
            return to_us if before[-1] == found.value.size - 1 else int(found.time_us[before[-1]]) + 1
        length_us = _DAY_US if found.value.size else 2 * length_us
        to_us = part.from_us
    return to_us


def _seconds(option: str, text: str | None) -> float:
    """``text``, as 7d or 8h, in seconds; infinite where there is none."""
    if text is None:
        return math.inf
    found = re.fullmatch(r"(\d{1,9}(?:\.\d{1,3})?)(s|min|h|d)", text)
    if found is None or (option == "--last" and float(found[1]) == 0.0):
        raise UsageError(f"{option} {text!r} is no length of time; say 7d, 8h, 30min or 90s")
    return float(found[1]) * _UNITS_S[found[2]]
