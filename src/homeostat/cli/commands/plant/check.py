"""``homeostat plant check``: a lint that knows plants, as text or as JSON."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from typing import Any

from homeostat.domain.lasting import lasting
from homeostat.domain.quotation import printable
from homeostat.evaluate.lint.check import Checked, check
from homeostat.evaluate.lint.checks import ANSWERS, DEEP, LOADING
from homeostat.evaluate.lint.child import Begun
from homeostat.evaluate.lint.deep.answers import Answered
from homeostat.evaluate.lint.deep.faults import Outlook
from homeostat.evaluate.lint.finding import Finding


def carry_out(options: argparse.Namespace) -> int:
    """Print every finding as it is found; 1 where one counts."""
    names = ANSWERS if options.answers else DEEP if options.deep else LOADING
    progress = _Progress()

    def said(finding: Finding) -> None:
        progress.clear()
        if not options.json:
            print(printable(str(finding)), flush=True)

    checked = check(options.case, names, progress, said)
    progress.clear()
    if options.json:
        print(json.dumps(_as_json(options.case, checked), indent=1))
    else:
        for line in _ending(options.case, checked):
            print(printable(line))
    return 0 if checked.clean else 1


def _ending(case: str, checked: Checked) -> list[str]:
    """What is told when every check is over: what comes of each fault, and how much was found."""
    counted = sum(finding.counts for finding in checked.findings)
    notes = len(checked.findings) - counted
    told = "clean" if not counted else f"{counted} finding{'' if counted == 1 else 's'}"
    said = f", {notes} note{'' if notes == 1 else 's'}" if notes else ""
    about = [*map(_outlook, checked.outlooks), *map(_answer, checked.answers)]
    return [*about, f"{case}: {told}{said}"]


def _outlook(each: Outlook) -> str:
    noticed = "not noticed" if each.noticed_s is None else f"noticed after {lasting(each.noticed_s)}"
    symptoms = f" ({', '.join(each.symptoms[:3])}{' ...' if each.symptoms[3:] else ''})" if each.symptoms else ""
    violates = ", violates no hard limit"
    if each.violates and each.violated_s is not None:
        violates = f", violates {each.violates} after {lasting(each.violated_s)}"
    alike = f", looks like {', '.join(each.alike)}" if each.alike else ""
    answers = f", may end in {', '.join(each.answers)}" if each.answers else ", ends in a fallback"
    return f"fault {each.fault}: {noticed}{symptoms}{violates}{alike}{answers}"


def _answer(each: Answered) -> str:
    if not each.path:
        return f"answer to {each.fault}: none: {each.reason}"
    binds = f", {each.margin:.3g} {each.unit} of {each.binds} are left" if each.margin is not None else ""
    cost = "" if each.cost_share is None else f", at {each.cost_share:.1%} of the design production"
    return f"answer to {each.fault}: {' > '.join(each.path)} by {each.proposer}{binds}{cost}"


def _as_json(case: str, checked: Checked) -> dict[str, Any]:
    def plain(finding: Finding) -> dict[str, Any]:
        where = {"file": finding.where.file, "row": finding.where.row, "key": finding.where.key}
        return {**asdict(finding), "where": where}

    return {
        "plant": case,
        "clean": checked.clean,
        "findings": [plain(finding) for finding in checked.findings],
        "faults": [asdict(each) for each in checked.outlooks],
        "answers": [asdict(each) for each in checked.answers],
    }


class _Progress:
    """Says on standard error which check has begun; a terminal sees every part of it on one line."""

    def __init__(self) -> None:
        self._shown = sys.stderr.isatty()
        self._last = ""

    def __call__(self, begun: Begun) -> None:
        if self._shown:
            part = f": {begun.part}" if begun.part else ""
            print(f"\r\x1b[Kchecking {begun.check}{part}", end="", file=sys.stderr, flush=True)
        elif begun.check != self._last:
            print(f"homeostat: checking {begun.check}", file=sys.stderr, flush=True)
        self._last = begun.check

    def clear(self) -> None:
        """Take the line away before something else is printed on a terminal."""
        if self._shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)
