"""The page of the study: every bar beside its figure, and how many of the runs are in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import median

from benchmarks.host import ROOT, commit, measured_on
from benchmarks.unknown.causes import HARMLESS, HEALTHY, KNOWN
from benchmarks.unknown.figure import draw
from benchmarks.unknown.jobs import DAY, KNOWN_LOOKS_S, LOOKS_S, UNKNOWN, Job
from benchmarks.unknown.judge import LEAST_COUNT, Bin, Verdict, reliability
from benchmarks.unknown.operated import Operated, longer, poorer
from benchmarks.unknown.tally import Look, Share, counts, of_runs, right_from, severity_errors, statements, with_a_name
from homeostat.evaluate.score.scoring import SAME_LOSS
from homeostat.plants.plant import Plant

DOCS = ROOT / "docs"
LIKELY = (0.85, 0.95)
"""What counts as said with 90 % [1]."""
MOST_SHOWN = 40
"""Most single answers that the page lists of one plant."""


class Study:
    """What was measured of one plant."""

    def __init__(
        self, plant: Plant, jobs: Sequence[Job], looks: Sequence[Look], operated: Sequence[Operated] = ()
    ) -> None:
        """``jobs``: every run that was asked for; ``looks``, ``operated``: what is in."""
        self.plant, self.jobs, self.looks, self._operated = plant, jobs, looks, operated

    @property
    def title(self) -> str:
        """What the page calls it."""
        return {"cstr": "Reactor", "mixing_module": "Mixing Module"}.get(self.plant.name, self.plant.name)

    def part(self, name: str) -> list[Look]:
        """Looks of one part."""
        return [x for x in self.looks if x.job.part == name]

    def truly_unknown(self) -> list[Look]:
        """Looks at causes that are in no row of the fault list."""
        return [x for x in self.part(UNKNOWN) if not x.job.cause.known]

    def operated(self, name: str) -> list[Operated]:
        """Runs of one part with everything on; of unknown causes only those that are truly unknown."""
        mine = {j.name for j in self.jobs if j.part == name and not j.cause.known}
        return [one for one in self._operated if one.run in mine]

    def runs(self, name: str) -> str:
        """How many runs of a part are in."""
        there, wanted = of_runs(self.looks, (j for j in self.jobs if j.part == name))
        return f"{there} of {wanted}"


def page(studies: Sequence[Study], mismatch: str) -> str:
    """The whole page."""
    sections = [
        HEAD.format(commit=commit().rstrip("+"), mismatch=mismatch),
        "## Bars\n\n" + table(("bar", "plant", "asked for", "measured", "met", "runs in"), _bars(studies)),
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
before its first run. Nobody acts in these runs; the diagnosis is asked at the first symptom from the onset on that
the same plant does not raise by itself, and again later.

*Wrong*: another item or balance than the true one, at 0.9 or more. *Right*: the name, or an unknown on its balance.
*Set*: nothing else is sure, and what lies within 3 nats of the best holds the item. *Noticeable*: with nobody acting
some feature leaves its fault-free 99.9 % band, for 60 s at the reactor, as long as its symptom rules wait at the
module. A noticeable cause without a symptom counts as one of which nothing was said."""
VERDICTS = """Looks at causes that are in no row of the fault list, those that are not noticeable included. *Alike*:
of the wrong ones, those about what the instruments cannot tell from the truth, as the table of causes said before."""
KNOWN_TEXT = """Severity and onset are drawn at random, the severity from the range of the table. Right: the
component. The error of the severity is a share of its range, where the fault is named, 120 s after the first symptom
(fouling: 900 s)."""
CALIBRATION = """Every statement of every look, that nothing is wrong included, by its probability. The mix: causes
that no list names, known faults, harmless disturbances and fault-free runs.

![How often statements are right, by their probability](../images/unknown.png)"""


def _bars(studies: Sequence[Study]) -> list[Sequence[object]]:
    return [row for study in studies for row in _bars_of(study)]


def _bars_of(study: Study) -> list[Sequence[object]]:
    name, unknown, known = study.plant.name, [x for x in study.truly_unknown() if x.looked], study.part(KNOWN)
    first, second, later = LOOKS_S[name][0], LOOKS_S[name][1], LOOKS_S[name][2]
    rows: list[tuple[str, str, str, bool, str]] = []
    bad = Share.that(unknown, lambda x: x.bad)
    rows.append(("wrong at 0.9 or more", "<= 5 % of looks", str(bad), bad.value <= 0.05, UNKNOWN))
    right = right_from(study.truly_unknown(), second)
    rows.append((f"right where noticeable, from +{second} s on", ">= 90 %", str(right), right.value >= 0.9, UNKNOWN))
    for after_s in (first, later):
        mine = [x for x in known if x.looked and x.judged.after_s == after_s]
        good, wrong = Share.that(mine, lambda x: x.verdict is Verdict.RIGHT), Share.that(mine, lambda x: x.bad)
        rows.append((f"known faults named at +{after_s} s", ">= 85 %", str(good), good.value >= 0.85, KNOWN))
        rows.append((f"known faults named wrongly at +{after_s} s", "<= 2 %", str(wrong), wrong.value <= 0.02, KNOWN))
    errors = [e for f in study.plant.description.faults for e in severity_errors(_of(known, f.name), f)]
    typical = median(errors) if errors else math.nan
    text = f"{100 * typical:.0f} % of the range, {len(errors)} stated" if errors else "none"
    rows.append(("severity of known faults, median error", "<= 10 % of the range", text, typical <= 0.1, KNOWN))
    named = with_a_name(study.part(HARMLESS))
    rows.append(("harmless runs with a name at 0.5 or more, nobody acting", "0", str(len(named)), not named, HARMLESS))
    named = with_a_name(study.part(HEALTHY))
    rows.append(("fault-free runs with a name at 0.5 or more", "0", str(len(named)), not named, HEALTHY))
    told = _told(study)
    gap = abs(told.right - told.said)
    measured = f"{100 * told.right:.0f} % of {told.count} said with {100 * told.said:.0f} %" if told.count else "none"
    rows.append(("what is said with 90 % is true", "90 +- 5 %", measured, gap <= 0.05, KNOWN))
    told_of = [(text, bar, figure, met, study.runs(part)) for text, bar, figure, met, part in rows]
    return [
        (text, study.title, bar, figure, _met(met, runs), runs)
        for text, bar, figure, met, runs in (*told_of, *_bars_of_operation(study))
    ]


def _bars_of_operation(study: Study) -> list[tuple[str, str, str, bool, str]]:
    """Bars of runs with everything on, each with how many of its runs are in."""
    unknown, harmless = study.operated(UNKNOWN), study.operated(HARMLESS)
    wanted = sum(j.part == UNKNOWN and not j.cause.known for j in study.jobs)
    runs = f"{len(unknown)} of {wanted}"
    safe = sum(one.alone_safe for one in unknown)
    outside, poor, poorest = longer(unknown), poorer(unknown, SAME_LOSS), poorer(unknown, 0.1)
    written = sum(one.writes > 0 for one in harmless)
    named = sum(bool(one.names) for one in harmless)
    of_harmless = f"{len(harmless)} of {sum(j.part == HARMLESS for j in study.jobs)}"
    days, asked = study.operated(DAY), [j for j in study.jobs if j.part == DAY]
    of_days = f"{len(days)} of {len(asked)}"
    stirred = sum(one.alarms + one.writes + one.diagnoses for one in days)
    few = len(poor) <= 0.05 * max(safe, 1)
    return [
        ("longer outside a hard limit than left alone, by more than 10 s", "0", str(len(outside)), not outside, runs),
        ("more production lost than left alone", "<= 5 % of runs", f"{len(poor)} of {safe}", few, runs),
        ("the same by more than 10 points", "0", str(len(poorest)), not poorest, runs),
        ("harmless runs with a write", "0", str(written), not written, of_harmless),
        ("harmless runs with a name at 0.5 or more, everything on", "0", str(named), not named, of_harmless),
        ("alarms, diagnoses and writes in a fault-free day", "0", str(stirred), not stirred, of_days),
    ]


def _met(met: bool, runs: str) -> str:
    """Whether a bar is met; nobody can tell where nothing is in."""
    if runs.startswith("0 "):
        return "not measured"
    return "yes" if met else "**no**"


def _told(study: Study) -> Bin:
    """The bin of what is said with 90 %."""
    return next(b for b in reliability(statements(study.looks)) if (b.low, b.high) == LIKELY)


def _verdicts(study: Study) -> str:
    header = ("look", *(v.value for v in Verdict), "wrong", "of them alike", "looks")
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
    return (name, *(found[v] for v in Verdict), percent, sum(x.alike for x in looks), len(looks))


def _known(study: Study) -> str:
    after = KNOWN_LOOKS_S[study.plant.name]
    header = ("fault", "runs", "with a symptom", *(f"right at +{s} s" for s in after), "wrong looks", "severity error")
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
    right = (Share.that(at[s], lambda x: x.verdict is Verdict.RIGHT) for s in after_s)
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
