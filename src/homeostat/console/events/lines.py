"""The journal line by line, without what was truly wrong, and what its verification says."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from homeostat.domain.quotation import printable
from homeostat.journal import BrokenChain, Record, read_events
from homeostat.journal.signing.keys import KeyTrouble, installation_public
from homeostat.journal.verify.verify import verify

MOST: Final = 200
"""Most lines at a time."""
_TRUTH: Final = frozenset({"run-started"})
"""Kinds of lines that say what was truly wrong."""
_LONGEST: Final = 2000
"""Most characters of a line that are shown."""


@dataclass(frozen=True, slots=True)
class JournalLine:
    """One line."""

    number: int
    """Its number, from 1."""
    at_s: float
    """Process time at which it happened [s]."""
    kind: str
    """What happened."""
    text: str
    """Its fields, as JSON."""


@dataclass(frozen=True, slots=True)
class JournalPage:
    """Some lines, the latest first."""

    lines: tuple[JournalLine, ...]
    """The lines."""
    kinds: tuple[str, ...]
    """Every kind that the journal has."""
    more: bool
    """Whether older lines are like these."""
    trouble: str
    """Why the journal cannot be read further; empty where it can."""


@dataclass(frozen=True, slots=True)
class Verified:
    """What the verification of a journal says."""

    whole: bool
    """Whether nothing was altered, removed or added, as far as it goes."""
    closed: bool
    """Whether it was closed, so that nothing is missing at its end."""
    signed: int
    """Lines that a trusted key vouches for."""
    lines: int
    """Lines that were read."""
    text: str
    """The same in one sentence."""


def journal_page(run_dir: Path, kinds: frozenset[str], words: str, before: int | None) -> JournalPage:
    """The last lines of ``kinds`` (all of them where empty) that have ``words``, and a number less than ``before``."""
    found: list[JournalLine] = []
    known: set[str] = set()
    trouble, count, words = "", 0, words.casefold()
    try:
        for record in read_events(run_dir):
            if record.kind in _TRUTH:
                continue
            known.add(record.kind)
            if (kinds and record.kind not in kinds) or (before is not None and record.seq >= before):
                continue
            line = _line(record)
            if words and words not in f"{line.kind} {line.text}".casefold():
                continue
            count += 1
            found.append(line)
            del found[:-MOST]
    except (BrokenChain, OSError) as error:
        trouble = str(error)
    return JournalPage(tuple(found[::-1]), tuple(sorted(known)), count > len(found), trouble)


def journal_lines(run_dir: Path) -> JournalPage:
    """Every line, the latest first; as far as the journal can be read."""
    found: list[JournalLine] = []
    trouble = ""
    try:
        found += [_line(record) for record in read_events(run_dir) if record.kind not in _TRUTH]
    except (BrokenChain, OSError) as error:
        trouble = str(error)
    return JournalPage(tuple(found[::-1]), tuple(sorted({line.kind for line in found})), False, trouble)


def _line(record: Record) -> JournalLine:
    text = printable(json.dumps(dict(record.fields), ensure_ascii=False, separators=(", ", ": ")))
    return JournalLine(record.seq, record.happened_s, record.kind, text[:_LONGEST])


def verified(run_dir: Path) -> Verified:
    """What the verification of the journal in ``run_dir`` says; this installation's key is the trusted one."""
    try:
        own = installation_public()
    except KeyTrouble:
        own = None
    try:
        report = verify(run_dir, set() if own is None else {own})
    except OSError as error:
        return Verified(False, False, 0, 0, f"it cannot be read: {error}")
    signed = report.vouched.lines
    if not report.intact:
        text = f"{'CONTRADICTION' if report.contradictions else 'ALTERED'}: {report.problem}"
    else:
        by = (
            f"signed by this installation's key up to line {signed}"
            if signed
            else "not signed by a key that is trusted here"
        )
        end = "closed" if report.complete else "not closed"
        text = f"unaltered up to line {report.lines}, {by}; {end}"
    return Verified(report.intact, report.complete, signed, report.lines, text)
