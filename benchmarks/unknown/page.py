"""The page of the study: every bar beside its figure, and how many of the runs are in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from statistics import median

from benchmarks.host import ROOT, commit, measured_on, run_sources
from benchmarks.unknown.bars import LIKELY, Study, bars
from benchmarks.unknown.causes import HARMLESS, HEALTHY, KNOWN
from benchmarks.unknown.figure import draw
from benchmarks.unknown.jobs import KNOWN_LOOKS_S, LOOKED_AT, LOOKS_S, UNKNOWN
from benchmarks.unknown.judge import LEAST_COUNT, Bin, Verdict, merged, reliability
from benchmarks.unknown.sections import costs, forced_section, operated_section, pairs_section, table
from benchmarks.unknown.tally import NOTHING, Look, Share, answers, counts, severity_errors, statements, with_a_name
from benchmarks.unknown.texts import (
    CALIBRATION,
    COST,
    HEAD,
    KNOWN_TEXT,
    LABELS,
    LIMITATIONS,
    OPERATION,
    PAIRS,
    SIZES,
    VERDICTS,
)

DOCS = ROOT / "docs"
MOST_SHOWN = 40
"""Most single answers that the page lists of one plant."""


def page(studies: Sequence[Study], mismatch: str) -> str:
    """The whole page."""
    sections = [
        HEAD.format(commit=commit(*run_sources(), "benchmarks/unknown"), mismatch=mismatch),
        "## Bars\n\n" + _bars(studies),
        "## Verdicts\n\n" + VERDICTS + "\n\n" + "\n\n".join(map(_verdicts, studies)),
        "## Known faults\n\n" + KNOWN_TEXT + "\n\n" + "\n\n".join(map(_known, studies)),
        "## Calibration\n\n" + CALIBRATION + "\n\n" + "\n\n".join(map(_calibration, studies)),
        "## Sizes\n\n" + SIZES + "\n\n" + "\n\n".join(map(_sizes, studies)),
        "## Everything on\n\n" + OPERATION + "\n\n" + "\n\n".join(map(operated_section, studies)),
        "## Two faults at once\n\n" + PAIRS + "\n\n" + "\n\n".join(map(pairs_section, studies)),
        "## A wrong label\n\n" + LABELS + "\n\n" + "\n\n".join(map(forced_section, studies)),
        "## What was wrong\n\n" + "\n\n".join(map(_wrong, studies)),
        "## What it costs\n\n" + COST + "\n\n" + costs(studies),
        "## Limitations\n\n" + LIMITATIONS,
        measured_on(),
    ]
    return "\n\n".join(sections) + "\n"


def _bars(studies: Sequence[Study]) -> str:
    rows = [(b.text, s.title, b.asked, b.measured, b.judgement, b.runs) for s in studies for b in bars(s)]
    return table(("bar", "plant", "asked for", "measured", "met", "runs in"), rows)


def _verdicts(study: Study) -> str:
    header = (
        "look",
        *(v.value for v in Verdict),
        "wrong or elsewhere",
        "of them alike",
        "right by a fault's name",
        "looks",
    )
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
    looked = {p: [x for x in study.part(p) if x.looked] for p in LOOKED_AT}
    mix = ", ".join(f"{len(x)} {p} in {len({one.judged.run for one in x})} runs" for p, x in looked.items())
    single = _reliability("said with", "statements", merged(statements(study.looks)))
    sets = _reliability("said with", "answers", merged(answers(study.looks)))
    parts = table(("part", "statements", "mean", "right"), map(_likely, looked, looked.values()))
    refused = f"Refused: {Share.that(looked[KNOWN], lambda x: x.refused)}."
    told = f"{single}\n\nBy part:\n\n{parts}\n\n{refused}\n\nAnswers as sets:\n\n{sets}"
    return f"{study.title}, {study.runs_looked_at} runs; looks: {mix}.\n\n{told}"


def _likely(part: str, looks: Sequence[Look]) -> Sequence[object]:
    """What is said with high probability at the looks of one part, and how much of it is right."""
    one = next(b for b in reliability(statements(looks)) if (b.low, b.high) == LIKELY)
    return (part, one.count, f"{one.said:.2f}" if one.count else "", f"{one.right:.2f}" if one.count else "")


def _reliability(said: str, what: str, bins: Sequence[Bin]) -> str:
    rows = [
        (
            f"{b.low:g} to {b.high:g}",
            b.count,
            f"{b.said:.2f}" if b.count else "",
            f"{b.right:.2f}" if b.count else "",
            "yes" if b.count >= LEAST_COUNT else f"**no**, {LEAST_COUNT} asked for",
        )
        for b in bins
    ]
    return table((said, what, "mean", "right", "enough"), rows)


def _sizes(study: Study) -> str:
    header = ("said", "sizes", "with an interval", "hold the truth", "median width, of the true size")
    rows = []
    for fault in dict.fromkeys(one.fault for one in study.sizes):
        mine = [one for one in study.sizes if one.fault == fault]
        widths = [one.width for one in mine if math.isfinite(one.width)]
        stated = sum(one.interval is not None for one in mine)
        wide = f"{100 * median(widths):.0f} %" if widths else ""
        rows.append((fault, len(mine), stated, str(Share(len(mine), sum(one.holds for one in mine))), wide))
    return f"{study.title}:\n\n{table(header, sorted(rows))}"


def _wrong(study: Study) -> str:
    bad = [x for x in study.looks if x.looked and x.bad]
    lines = [f"- `{x.judged.run}` +{x.judged.after_s} s: {_best(x)}{', alike' if x.alike else ''}" for x in bad]
    lines += [f"- `{text}`" for part in (HARMLESS, HEALTHY) for text in with_a_name(study.part(part))]
    more = [f"- and {len(lines) - MOST_SHOWN} more"] if len(lines) > MOST_SHOWN else []
    return "\n".join([f"{study.title}: {len(lines)} answers.", "", *lines[:MOST_SHOWN], *more])


def _best(x: Look) -> str:
    best = x.best or NOTHING
    return f"{best.name} {best.probability:.2f}"


def write(studies: Sequence[Study], mismatch: str, folder: Path) -> None:
    """Write the page and its figure below ``folder``."""
    text, picture = folder / "results" / "unknown.md", folder / "images" / "unknown.png"
    for path in (text, picture):
        path.parent.mkdir(parents=True, exist_ok=True)
    draw({s.title: merged(statements(s.looks)) for s in studies}, picture)
    text.write_text(page(studies, mismatch), encoding="utf-8")
    print(f"wrote {text} and {picture}")
