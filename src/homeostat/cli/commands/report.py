"""``homeostat report``: what an attached plant's journal tells of the last days, on one page."""

import argparse
import math
import re

from homeostat.cli.arguments import UsageError
from homeostat.cli.run_directory import run_directory
from homeostat.domain.quotation import printable
from homeostat.journal import read_events
from homeostat.journal.beside.files import write_whole
from homeostat.service.report.facts import facts_of
from homeostat.service.report.page import page

_UNITS_S = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86_400.0}


def carry_out(options: argparse.Namespace) -> int:
    """Write the page and print where it is; 0."""
    run_dir = run_directory(options.run)
    if options.out.exists() and not options.force:
        raise UsageError(f"{str(options.out)!r} is there already; --force replaces it")
    facts = facts_of(read_events(run_dir), _seconds(options.last))
    write_whole(options.out, page(facts).encode())
    counts = f"{len(facts.alarms)} alarms, {len(facts.diagnosed)} diagnoses, {len(facts.asked)} requests"
    print(printable(f"{options.out}: {counts} in {facts.length_s:.0f} s of process time"))
    return 0


def _seconds(text: str | None) -> float:
    """``text``, as 7d or 8h, in seconds; infinite where there is none."""
    if text is None:
        return math.inf
    found = re.fullmatch(r"(\d{1,9}(?:\.\d{1,3})?)(s|min|h|d)", text)
    if found is None or float(found[1]) == 0.0:
        raise UsageError(f"--last {text!r} is no length of time; say 7d, 8h, 30min or 90s")
    return float(found[1]) * _UNITS_S[found[2]]
