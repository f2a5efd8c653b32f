"""The page of what detectors do on real data."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from benchmarks.host import commit, measured_on
from benchmarks.monitor.on_skab import Score
from benchmarks.monitor.on_tep import Detection
from benchmarks.monitor.texts import BY_COMMAND, CHOSEN, HEAD, ON_SKAB, ON_TEP, PUBLISHED_MIN, PUBLISHED_SKAB, TRIED
from benchmarks.unknown.sections import table
from homeostat.detectors.catalogue import USUAL

TOGETHER = " + ".join(USUAL)
PLAIN = "pca"
WITHIN = 0.02
"""How far below plain PCA a disturbance may be [1]."""


def write(
    path: Path,
    scores: Mapping[tuple[str, float], Score],
    folders: Mapping[str, Score],
    equal: Mapping[str, Detection],
    stated: Mapping[str, Detection],
) -> None:
    """Write the page."""
    head = HEAD.format(commit=commit("src/homeostat/detectors", "benchmarks/monitor"))
    sections = (head, _bars(scores, equal), _skab(scores, folders), _tep(equal, stated), CHOSEN, TRIED, measured_on())
    path.write_text("\n\n".join(sections) + "\n", encoding="utf-8")


def _bars(scores: Mapping[tuple[str, float], Score], equal: Mapping[str, Detection]) -> str:
    rate = max(rate for names, rate in scores if names == PLAIN)
    best, together = scores[TOGETHER, rate], equal[TOGETHER]
    below = {n: equal[PLAIN].rates[n] - value for n, value in together.rates.items()}
    worst = max(below, key=lambda n: below[n])
    rows = [
        ("SKAB, F1", "> 0.80", f"{best.f1:.3f}", _met(best.f1 > 0.80)),
        ("SKAB, false alarms", "< 14 %", f"{best.far:.1%}", _met(best.far < 0.14)),
        (
            "Tennessee Eastman, mean detection rate at 1.0 %",
            ">= 0.90",
            f"{together.mean:.3f}",
            _met(together.mean >= 0.9),
        ),
        (
            "the same, most that a disturbance is below plain PCA",
            "< 2 points",
            f"{100 * below[worst]:+.1f} points (IDV {worst})",
            _met(below[worst] < WITHIN),
        ),
    ]
    return f"## Bars\n\nOf {TOGETHER}, which the command combines by default.\n\n" + table(
        ("bar", "asked for", "measured", "met"), rows
    )


def _met(is_met: bool) -> str:
    return "yes" if is_met else "**no**"


def _skab(scores: Mapping[tuple[str, float], Score], folders: Mapping[str, Score]) -> str:
    rows = [(names, f"{rate:.1%}", *_told(found)) for (names, rate), found in scores.items()]
    rows += [(f"{name} (published)", "", *told) for name, told in PUBLISHED_SKAB.items()]
    heads = ("F1", "false alarms", "missed")
    of_folders = [(name, *_told(found)) for name, found in folders.items()]
    return "\n\n".join(
        (
            ON_SKAB,
            table(("detectors", "stated", *heads), rows),
            f"{TOGETHER} at the rate of the bars, folder by folder:",
            table(("folder", *heads), of_folders),
        )
    )


def _told(found: Score) -> tuple[str, str, str]:
    return f"{found.f1:.3f}", f"{found.far:.1%}", f"{found.mar:.1%}"


def _tep(equal: Mapping[str, Detection], stated: Mapping[str, Detection]) -> str:
    numbers = list(equal[PLAIN].rates)
    rows = [
        (name, f"{d.mean:.3f}", f"{d.false_alarms:.1%}", *(f"{d.rates[n]:.3f}" for n in numbers))
        for name, d in equal.items()
    ]
    delays = [(name, *(f"{d.delays_min[n]:.0f}" for n in numbers)) for name, d in equal.items()]
    delays += [(f"{name} (published)", *(str(told[n]) for n in numbers)) for name, told in PUBLISHED_MIN.items()]
    by_command = [(name, f"{d.mean:.3f}", f"{d.false_alarms:.1%}") for name, d in stated.items()]
    idv = [f"IDV {n}" for n in numbers]
    return "\n\n".join(
        (
            ON_TEP,
            table(("detectors", "mean", "before the fault", *idv), rows),
            "Minutes from the onset, 8 h into the recording, to the first of six rows in a row beyond the limit; the "
            "first row with the fault is that of 8 h 03 min, so that no delay is below 3:",
            table(("detectors", *idv), delays),
            BY_COMMAND,
            table(("detectors", "mean", "false alarms"), by_command),
        )
    )
