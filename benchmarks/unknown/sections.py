"""Sections of the page about runs with everything on, and what the study costs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from statistics import median

from benchmarks.unknown.bars import Study
from benchmarks.unknown.causes import HARMLESS
from benchmarks.unknown.forced import Forced
from benchmarks.unknown.jobs import DAY, LABELLED, PAIRED, UNKNOWN
from benchmarks.unknown.operated import longer, poorer
from benchmarks.unknown.pairs import Paired
from homeostat.evaluate.score.scoring import SAME_LOSS

MOST_SHOWN = 40
"""Most single runs that the page lists of one part."""


def operated_section(study: Study) -> str:
    """How runs with everything on ended, and which of them did harm."""
    header = ("part", "runs in", "outcomes", "with a write", "with a name", "longer outside", "more lost")
    rows = []
    for part in (UNKNOWN, HARMLESS, DAY):
        mine = study.operated(part)
        ended = Counter(one.outcome for one in mine)
        outcomes = ", ".join(f"{count} {outcome}" for outcome, count in ended.most_common())
        writes, names = sum(one.writes > 0 for one in mine), sum(bool(one.names) for one in mine)
        harm = len(longer(mine)), len(poorer(mine, SAME_LOSS))
        rows.append((part, study.runs_operated(part), outcomes, writes, names, *harm))
    harmed = {one.run: one for one in (*longer(study.operated(UNKNOWN)), *poorer(study.operated(UNKNOWN), 0.1))}
    told = (f"`{r.run}`: {r.longer_outside_s:+.0f} s outside, {100 * r.lost_more:+.0f} % lost" for r in harmed.values())
    stirred = [one for one in study.operated(HARMLESS) if one.names or one.writes]
    named = (f"`{r.run}`: {r.writes} writes, {', '.join(r.names) or 'no name'}" for r in stirred)
    left_out = f"{len(study.harmful)} harmless runs that violate something with nobody acting do not count"
    return f"{study.title}; {left_out}:\n\n{table(header, rows)}{listed([*told, *named])}"


def pairs_section(study: Study) -> str:
    """Runs with two faults: how many are outside, and what keeps the limit."""
    runs, header = (
        study.paired,
        ("runs in", "noticed", "outside", "of them avoidable", "kept by", "never noticed, outside"),
    )
    ways = Counter(one.kept_by.partition(" ")[0] for one in runs if one.avoidable)
    outside = [one for one in runs if one.outside]
    row = (
        study.runs_operated(PAIRED),
        sum(one.noticed for one in runs),
        len(outside),
        sum(one.avoidable for one in runs),
        ", ".join(f"{count} {way}" for way, count in ways.most_common()),
        sum(not one.noticed for one in outside),
    )
    told = (_pair_told(one) for one in outside if one.avoidable or not one.noticed)
    return f"{study.title}:\n\n{table(header, [row])}{listed(told)}"


def _pair_told(one: Paired) -> str:
    seen = f"kept by {one.kept_by}" if one.noticed else "never noticed"
    return f"`{one.run}`: {one.outcome}, outside {', '.join(one.outside)}, {seen}"


def forced_section(study: Study) -> str:
    """Runs with a wrong label: how many release anything, and which releases violate a limit."""
    runs, header = study.forced, ("runs in", "with a release", "outside after it", "caught", "not caught")
    outside = [one for one in runs if one.outside]
    row = (
        study.runs_operated(LABELLED),
        sum(one.releases > 0 for one in runs),
        len(outside),
        sum(one.caught for one in outside),
        sum(one.missed for one in runs),
    )
    told = (_label_told(one) for one in sorted(outside, key=lambda one: one.caught))
    return f"{study.title}:\n\n{table(header, [row])}{listed(told)}"


def _label_told(one: Forced) -> str:
    caught = "caught" if one.caught else "**not caught**"
    return (
        f"`{one.run}`: {one.outcome}, outside {', '.join(one.outside)} for {one.outside_s:.0f} s "
        f"({one.alone_s:.0f} s left alone), {caught}"
    )


def costs(studies: Sequence[Study]) -> str:
    """Processor time of looks and runs."""
    rows = []
    for study in studies:
        spent = {"a look": [x.judged.cpu_s for x in study.looks if x.looked]}
        for part in (UNKNOWN, HARMLESS, DAY):
            spent[f"a run of '{part}' with everything on"] = [one.cpu_s for one in study.operated(part)]
        spent["a pair of faults"] = [one.cpu_s for one in study.paired]
        spent["what else could have been done about a pair"] = [one.tried_cpu_s for one in study.paired if one.outside]
        spent["a wrong label"] = [one.cpu_s for one in study.forced]
        for what, each in spent.items():
            if each:
                hours = f"{sum(each) / 3600.0:.2f} h"
                rows.append((study.title, what, len(each), f"{median(each):.1f} s", f"{max(each):.1f} s", hours))
    return table(("plant", "what", "number", "median", "largest", "all"), rows)


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join([*lines, *("| " + " | ".join(str(c) for c in r) + " |" for r in rows)])


def listed(texts: Iterable[str]) -> str:
    """Single runs below a table, as many as a page bears; empty for none."""
    every = [f"- {text}" for text in texts]
    more = [f"- and {len(every) - MOST_SHOWN} more"] if len(every) > MOST_SHOWN else []
    return "\n\n" + "\n".join([*every[:MOST_SHOWN], *more]) if every else ""
