"""``homeostat monitor``: which rows of a table of signals are out of the ordinary."""

import argparse
import sys
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Final

from homeostat.cli.arguments import UsageError
from homeostat.cli.monitored import read
from homeostat.cli.table import show_table
from homeostat.detectors.alarms import LASTING
from homeostat.detectors.catalogue import USUAL
from homeostat.detectors.tables.table import SignalTable
from homeostat.detectors.watching import FALSE_ALARMS, SEED, Course, Watching, watch
from homeostat.domain.quotation import printable
from homeostat.journal.beside.files import write_whole
from homeostat.journal.encode import canonical, encode

FOUND: Final = 1
"""Exit status where something is out of the ordinary."""
MOST: Final = 20
"""Most alarms of a table that are shown; the longest."""


def carry_out(options: argparse.Namespace) -> int:
    """Judge the tables, show and keep what was found; 0 where nothing is out of the ordinary, else 1."""
    names = tuple(name.strip() for given in options.detectors or [",".join(USUAL)] for name in given.split(","))
    stated = FALSE_ALARMS if options.false_alarms is None else options.false_alarms
    how = Watching(names, stated, options.healthy, SEED if options.seed is None else options.seed)
    kept = _names(options.tables)
    if options.out is not None:
        _refuse_present(
            [options.out / f"{name}{ending}" for name in kept for ending in (".png", ".csv")], options.force
        )
    tables, baselines = ([read(path, options) for path in paths] for paths in (options.tables, options.baseline))
    _refuse_absent(options.ignore, [*tables, *baselines])
    courses = watch(tables, baselines, how, _notice)
    if options.out is not None:  # before anything is said: whoever reads it may go away
        _keep(options.out, dict(zip(kept, courses, strict=True)))
    if options.json:
        told = [_as_json(course) for course in courses]
        print(canonical(encode({"false_alarms": how.false_alarms, "detectors": courses[0].names, "tables": told})))
    else:
        for course in courses:
            _show(course, len(baselines), stated)
        if options.out is not None:
            print(printable(f"{options.out}: a picture, and the scores of each row, of each table"))
    return FOUND if any(course.alarms for course in courses) else 0


def _notice(text: str) -> None:
    print(f"homeostat: {printable(text)}", file=sys.stderr)


def _show(course: Course, baselines: int, stated: float) -> None:
    table, judged = course.table, len(course.table) - course.healthy
    first = f"its first {course.healthy} rows" if course.healthy else ""
    others = f"{baselines} fault-free table{'s' if baselines > 1 else ''}" if baselines else ""
    by = " and ".join(part for part in (first, others) if part)
    when = f" at the times of {table.time!r}" if table.time else "" if table.timed else " without times"
    print(printable(f"{table.name}: {judged} rows of {len(table.signals)} signals{when}, judged by {by}"))
    beyond = (course.judged.scores[course.healthy :] > 1.0).mean(axis=0)
    each = ", ".join(f"{name} {share:.1%}" for name, share in zip(course.names, beyond, strict=True))
    print(f"  {course.share:.1%} of them beyond the limit ({each}); {stated:.3g} is stated for fault-free rows")
    if not course.alarms:
        print(f"  nothing is out of the ordinary for {LASTING} rows in a row")
        return
    longest = sorted(sorted(course.alarms, key=lambda alarm: -alarm.rows)[:MOST], key=lambda alarm: alarm.first)
    rows = [
        (
            table.told(a.first),
            table.told(a.last),
            str(a.rows),
            f"{a.peak:.3g}",
            ", ".join(a.detectors),
            ", ".join(f"{name} {departure:.2g}" for name, departure in a.signals),
        )
        for a in longest
    ]
    heads = ("from", "to", "rows", "peak [limit]", "detectors", "signals that depart most [limit]")
    show_table(heads, rows, indent=2)
    if len(course.alarms) > MOST:
        print(f"  and {len(course.alarms) - MOST} shorter ones")


def _as_json(course: Course) -> Mapping[str, object]:
    table = course.table
    alarms = [
        {
            "from": table.told(a.first),
            "to": table.told(a.last),
            "first_row": a.first,
            "last_row": a.last,
            "peak": a.peak,
            "detectors": a.detectors,
            "signals": dict(a.signals),
        }
        for a in course.alarms
    ]
    whole = {"table": table.name, "time": table.time or None, "signals": table.signals, "rows": len(table)}
    return {**whole, "healthy": course.healthy, "beyond": course.share, "alarms": alarms}


def _names(paths: Sequence[Path]) -> list[str]:
    """A name for what is kept of each table: that of its file, with its folder's or a number where it is taken."""
    found: list[str] = []
    for path in paths:
        resolved = path.resolve()
        name = resolved.stem
        if name in found or [p.resolve().stem for p in paths].count(name) > 1:
            name = f"{resolved.parent.name}-{name}"
        found.append(name if name not in found else f"{name}-{len(found) + 1}")
    return found


def _refuse_present(paths: Sequence[Path], force: bool) -> None:
    there = next((path for path in paths if path.exists()), None)
    if there is not None and not force:
        raise UsageError(f"{str(there)!r} is there already; choose another folder, or replace it with --force")


def _refuse_absent(ignored: Sequence[str], tables: Sequence[SignalTable]) -> None:
    """A name that is written wrongly would leave in what is meant to be left out."""
    for name in ignored:
        if not any(name in table.left_out for table in tables):
            raise UsageError(f"--ignore {name!r}: no table has it; {tables[0].name} has {', '.join(tables[0].signals)}")


def _keep(folder: Path, courses: Mapping[str, Course]) -> None:
    """Write a picture and the scores of each table."""
    from homeostat.detectors.figure import draw

    folder.mkdir(parents=True, exist_ok=True)
    for name, course in courses.items():
        write_whole(folder / f"{name}.png", draw(course))
        write_whole(folder / f"{name}.csv", _scores(course).encode())


def _scores(course: Course) -> str:
    """Each row's scores as CSV: whether it is beyond the limit, the score of each detector [limit]."""
    lines = StringIO()
    lines.write(",".join(("row", "time", "beyond", *course.names)) + "\n")
    over = course.over
    for k, scores in enumerate(course.judged.scores.tolist()):
        lines.write(f"{k + 1},{course.table.told(k)},{int(over[k])},{','.join(f'{s:.6g}' for s in scores)}\n")
    return lines.getvalue()
