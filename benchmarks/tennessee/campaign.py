"""The campaign's 13 scenarios in three seeds, as ``campaigns/tennessee.toml`` was run, for the page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from benchmarks.tennessee.qualify import WANTED, Kind
from benchmarks.unknown.sections import table
from homeostat.evaluate.study.ledger import DATASET, read_dataset
from homeostat.record.row import DO_NOTHING, HINDSIGHT, SEARCH, WHOLE, Row

SEEDS: Final = 3
EPISODES: Final = SEEDS * sum(WANTED.values())


def rows_of(folder: Path | None, kinds: dict[str, Kind]) -> list[Row]:
    """Rows of the 13 scenarios of the study in ``folder`` with nothing left out; none where it was not run."""
    if folder is None or not (folder / DATASET).exists():
        return []
    return [r for r in read_dataset(folder / DATASET) if r.scenario in kinds and r.ablation == WHOLE]


def safe(row: Row) -> bool:
    """Whether every trip limit was kept."""
    return row.exposure_s == 0.0


def told(rows: Sequence[Row], kinds: dict[str, Kind]) -> str:
    """One line for each scenario; of each proposer how many seeds keep every trip limit, and what they lose."""
    proposers = list(dict.fromkeys(row.proposer for row in rows))
    lines = []
    for name, kind in kinds.items():
        mine = [row for row in rows if row.scenario == name]
        lines.append((name, kind.value, *(_cell([r for r in mine if r.proposer == who]) for who in proposers)))
    everything = ("all", "", *(_cell([r for r in rows if r.proposer == who]) for who in proposers))
    return table(("scenario", "kind", *proposers), [*lines, everything])


def _cell(rows: Sequence[Row]) -> str:
    if not rows:
        return "not in"
    lost = [row.production_loss for row in rows if row.production_loss is not None]
    parts = [f"{sum(map(safe, rows))} of {len(rows)} kept"]
    acted = sum(row.acted for row in rows)
    parts += [f"{acted} acted"] if acted else []
    parts += [f"{sum(lost) / len(lost):.1%} lost"] if lost else []
    return ", ".join(parts)


def missing(rows: Sequence[Row], kinds: dict[str, Kind]) -> Iterator[str]:
    """What was asked of the campaign and does not follow from ``rows``."""
    search = [row for row in rows if row.proposer == SEARCH]
    kept = sum(map(safe, search))
    if kept < EPISODES:
        yield f"{EPISODES} of {EPISODES} episodes inside the trip limits by search: {kept} of {len(search)} that are in"
    needless = [row for row in search if kinds[row.scenario] is Kind.NOTHING and row.acted]
    if needless:
        where = ", ".join(f"{row.scenario} seed {row.seed}" for row in needless)
        yield f"no action where nothing is needed: there was one in {len(needless)} episodes ({where})"
    for who in (HINDSIGHT, DO_NOTHING):
        count = sum(row.proposer == who for row in rows)
        if count < EPISODES:
            yield f"`{who}` beside each episode: {count} of {EPISODES} are in"
