"""The page of the study: every bar beside its figure, and how many of the runs are in."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import median

from benchmarks.host import ROOT, commit, measured_on
from benchmarks.unknown.bars import Study, bars
from benchmarks.unknown.causes import HARMLESS, HEALTHY, KNOWN
from benchmarks.unknown.figure import draw
from benchmarks.unknown.jobs import KNOWN_LOOKS_S, LOOKS_S, UNKNOWN
from benchmarks.unknown.judge import LEAST_COUNT, Verdict, reliability
from benchmarks.unknown.tally import Look, Share, counts, severity_errors, statements, with_a_name

DOCS = ROOT / "docs"
MOST_SHOWN = 40
"""Most single answers that the page lists of one plant."""


def page(studies: Sequence[Study], mismatch: str) -> str:
    """The whole page."""
    sections = [
        HEAD.format(commit=commit().rstrip("+"), mismatch=mismatch),
        "## Bars\n\n" + _bars(studies),
        "## Verdicts\n\n" + VERDICTS + "\n\n" + "\n\n".join(map(_verdicts, studies)),
        "## Known faults\n\n" + KNOWN_TEXT + "\n\n" + "\n\n".join(map(_known, studies)),
        "## Calibration\n\n" + CALIBRATION + "\n\n" + "\n\n".join(map(_calibration, studies)),
        "## What was wrong\n\n" + "\n\n".join(map(_wrong, studies)),
        measured_on(),
    ]
    return "\n\n".join(sections) + "\n"


HEAD = """# What is said of causes that no table names

Made by `python -m benchmarks.unknown` for the sources of `{commit}`. Mismatch of every true plant: `{mismatch}`. The
causes stand in `benchmarks/unknown/causes_*.toml`, each with its class, the component and the balances that it truly
is in, whether the fault list has its equation, and what the instruments cannot tell from it; all of it was written
before anything was judged. Nobody acts in these runs; the diagnosis is asked at the first symptom from the onset on
that the same plant does not raise by itself, and again later.

*Wrong*: another item or balance than the true one, at 0.9 or more. *Right*: the name, or an unknown on its balance.
*Set*: nothing else is sure, and what lies within 3 nats of the best holds the item. *Noticeable*: with nobody acting
some feature leaves its fault-free 99.9 % band, for 60 s at the reactor, as long as its symptom rules wait at the
module. A noticeable cause without a symptom counts as one of which nothing was said."""
VERDICTS = """Looks at causes that are in no row of the fault list, those that are not noticeable included. *Alike*:
of the wrong ones, those about what the instruments cannot tell from the truth, as the table of causes said before.
*Right by a fault's name*: the item is right, but the fault of the list that is named is not what happened to it."""
KNOWN_TEXT = """Severity and onset are drawn at random, the severity from the range of the table. Named: by a fault of
the component. The error of the severity is a share of its range, where the fault is named, 120 s after the first
symptom (fouling: 900 s)."""
CALIBRATION = """Every statement of every look, that nothing is wrong included, by its probability. The mix: causes
that no list names, known faults, harmless disturbances and fault-free runs.

![How often statements are right, by their probability](../images/unknown.png)"""


def _bars(studies: Sequence[Study]) -> str:
    rows = [(b.text, s.title, b.asked, b.measured, b.judgement, b.runs) for s in studies for b in bars(s)]
    return table(("bar", "plant", "asked for", "measured", "met", "runs in"), rows)


def _verdicts(study: Study) -> str:
    header = ("look", *(v.value for v in Verdict), "wrong", "of them alike", "right by a fault's name", "looks")
    looks = [x for x in study.truly_unknown() if x.looked]
    rows = [_verdict_row(f"+{s} s", [x for x in looks if x.judged.after_s == s]) for s in LOOKS_S[study.plant.name]]
    kinds = list(dict.fromkeys(x.job.cause.kind for x in looks))
    rows += [_verdict_row(kind, [x for x in looks if x.job.cause.kind == kind]) for kind in kinds]
    listed = [x for x in study.part(UNKNOWN) if x.job.cause.known and x.looked]
    rows.append(_verdict_row("in the fault list", listed))
    return f"{study.title}, {study.runs(UNKNOWN)} runs:\n\n{table(header, rows)}"


def _verdict_row(name: str, looks: Sequence[Look]) -> Sequence[object]:
    found, bad = counts(looks), Share.that(looks, lambda x: x.bad)
    percent = f"{100 * bad.value:.0f} %" if bad.of else ""
    alike, borrowed = sum(x.alike for x in looks), sum(x.borrowed for x in looks)
    return (name, *(found[v] for v in Verdict), percent, alike, borrowed, len(looks))


def _known(study: Study) -> str:
    after = KNOWN_LOOKS_S[study.plant.name]
    header = ("fault", "runs", "with a symptom", *(f"named at +{s} s" for s in after), "wrong looks", "severity error")
    rows = []
    for fault in study.plant.description.faults:
        mine = _of(study.part(KNOWN), fault.name)
        if mine:
            errors = severity_errors(mine, fault)
            rows.append((*_known_row(fault.name, mine, after), f"{100 * median(errors):.0f} %" if errors else ""))
    return f"{study.title}, {study.runs(KNOWN)} runs:\n\n{table(header, rows)}"


def _of(looks: Sequence[Look], cause: str) -> list[Look]:
    return [x for x in looks if x.job.cause.id == cause]


def _known_row(name: str, mine: Sequence[Look], after_s: Sequence[int]) -> Sequence[object]:
    looked = [x for x in mine if x.looked]
    at = {s: [x for x in looked if x.judged.after_s == s] for s in after_s}
    right = (Share.that(at[s], lambda x: x.named) for s in after_s)
    seen = {x.judged.run for x in looked}
    wrong = sum(x.bad for x in looked)
    return (name, len({x.judged.run for x in mine}), len(seen), *(f"{r.many}/{r.of}" for r in right), wrong)


def _calibration(study: Study) -> str:
    header = ("said with", "statements", "mean", "right", "enough")
    rows = [
        (
            f"{b.low:g} to {b.high:g}",
            b.count,
            f"{b.said:.2f}" if b.count else "",
            f"{b.right:.2f}" if b.count else "",
            "yes" if b.count >= LEAST_COUNT else f"**no**, {LEAST_COUNT} asked for",
        )
        for b in reliability(statements(study.looks))
    ]
    parts = ", ".join(
        f"{len({x.judged.run for x in study.part(p)})} {p}" for p in dict.fromkeys(j.part for j in study.jobs)
    )
    return f"{study.title}; runs: {parts}.\n\n{table(header, rows)}"


def _wrong(study: Study) -> str:
    bad = [x for x in study.looks if x.looked and x.bad]
    lines = [f"- `{x.judged.run}` +{x.judged.after_s} s: {_best(x)}{', alike' if x.alike else ''}" for x in bad]
    lines += [f"- `{text}`" for part in (HARMLESS, HEALTHY) for text in with_a_name(study.part(part))]
    more = [f"- and {len(lines) - MOST_SHOWN} more"] if len(lines) > MOST_SHOWN else []
    return "\n".join([f"{study.title}: {len(lines)} answers.", "", *lines[:MOST_SHOWN], *more])


def _best(x: Look) -> str:
    best = max(x.judged.said, key=lambda s: s.probability)
    return f"{best.name} {best.probability:.2f}"


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join([*lines, *("| " + " | ".join(str(c) for c in r) + " |" for r in rows)])


def write(studies: Sequence[Study], mismatch: str, folder: Path) -> None:
    """Write the page and its figure below ``folder``."""
    text, picture = folder / "results" / "unknown.md", folder / "images" / "unknown.png"
    for path in (text, picture):
        path.parent.mkdir(parents=True, exist_ok=True)
    draw({s.title: reliability(statements(s.looks)) for s in studies}, picture)
    text.write_text(page(studies, mismatch), encoding="utf-8")
    print(f"wrote {text} and {picture}")
