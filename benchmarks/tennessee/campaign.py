"""The campaign's 13 scenarios in three seeds, as ``campaigns/tennessee.toml`` was run, for the page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from benchmarks.tennessee.bars import NOT_MEASURED, SEEDS
from benchmarks.tennessee.qualify import WANTED, Kind
from benchmarks.unknown.sections import table
from homeostat.evaluate.study.ledger import DATASET, read_dataset
from homeostat.record.row import DO_NOTHING, HINDSIGHT, SEARCH, WHOLE, Row

EPISODES: Final = SEEDS * sum(WANTED.values())
GRADE: Final = "ACC-G"
"""The soft criterion that the product has the grade which is asked for."""


def rows_of(folder: Path | None, kinds: dict[str, Kind]) -> list[Row]:
    """Rows of the 13 scenarios of the study in ``folder`` with nothing left out; none where it was not run."""
    if folder is None or not (folder / DATASET).exists():
        return []
    return [r for r in read_dataset(folder / DATASET) if r.scenario in kinds and r.ablation == WHOLE]


def safe(row: Row) -> bool:
    """Whether every trip limit was kept."""
    return row.exposure_s == 0.0


def at_grade(row: Row) -> bool:
    """Whether the product had its grade at the end; not where that was not looked at."""
    return row.missed is not None and GRADE not in row.missed.split("+")


def told(rows: Sequence[Row], kinds: dict[str, Kind]) -> str:
    """One line for each scenario; of each proposer how many seeds keep every trip limit, and what they lose."""
    proposers = list(dict.fromkeys(row.proposer for row in rows))
    lines = []
    for name, kind in kinds.items():
        mine = [row for row in rows if row.scenario == name]
        lines.append((name, kind.value, *(_cell([r for r in mine if r.proposer == who], kinds) for who in proposers)))
    everything = ("all", "", *(_cell([r for r in rows if r.proposer == who], kinds) for who in proposers))
    return table(("scenario", "kind", *proposers), [*lines, everything])


def _cell(rows: Sequence[Row], kinds: dict[str, Kind]) -> str:
    if not rows:
        return "not in"
    lost = [row.production_loss for row in rows if row.production_loss is not None]
    parts = [f"{sum(map(safe, rows))} of {len(rows)} kept"]
    acted = sum(row.acted for row in rows)
    parts += [f"{acted} acted"] if acted else []
    graded = _of(rows, kinds, Kind.QUALITY)
    parts += [f"{sum(map(at_grade, graded))} of {len(graded)} at the grade"] if graded else []
    parts += [f"{sum(lost) / len(lost):.1%} lost"] if lost else []
    return ", ".join(parts)


def missing(rows: Sequence[Row], kinds: dict[str, Kind]) -> Iterator[str]:
    """What was asked of the campaign and does not follow from ``rows``."""
    search = [row for row in rows if row.proposer == SEARCH]
    quiet, graded = (_of(search, kinds, kind) for kind in (Kind.NOTHING, Kind.QUALITY))
    looked = [row for row in graded if row.missed is not None]
    yield from _short("inside the trip limits by search", sum(map(safe, search)), len(search), EPISODES)
    needless = [row for row in quiet if row.acted]
    if needless:
        where = ", ".join(f"{row.scenario} seed {row.seed}" for row in needless)
        yield f"no action where nothing is needed: there was one in {len(needless)} episodes ({where})"
    else:
        wanted = SEEDS * WANTED[Kind.NOTHING]
        yield from _short("without an action where nothing is needed", len(quiet), len(quiet), wanted)
    wanted = SEEDS * WANTED[Kind.QUALITY]
    yield from _short("of quality at their grade in the end", sum(map(at_grade, looked)), len(looked), wanted)
    for who in (HINDSIGHT, DO_NOTHING):
        count = sum(row.proposer == who for row in rows)
        if count < EPISODES:
            yield f"`{who}` beside each episode: {count} of {EPISODES} are in"


def _short(what: str, met: int, count: int, wanted: int) -> Iterator[str]:
    if met < wanted:
        yield f"{wanted} of {wanted} episodes {what}: {f'{met} of {count} that are in' if count else NOT_MEASURED}"


def _of(rows: Sequence[Row], kinds: dict[str, Kind], kind: Kind) -> list[Row]:
    return [row for row in rows if kinds[row.scenario] is kind]
