"""Ledgers: what one part of the study measured, a line for each run, so that a study that stopped goes on."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from typing import Generic, Protocol, TypeVar

from benchmarks.host import ROOT, commit
from benchmarks.unknown.causes import Cause
from homeostat.plants.plant import Plant

FOLDER = ROOT / "build" / "decisions"


class Row(Protocol):
    """What one run came to."""

    @property
    def fault(self) -> str:
        """The fault of the tables."""

    @property
    def seed(self) -> int:
        """The seed of the run."""


R = TypeVar("R", bound=Row)


class Ledger(Generic[R]):
    """What one part measured on one plant under one mismatch."""

    def __init__(
        self, part: str, plant: Plant, mismatch: str, kind: type[R], measured: Callable[[Plant, Cause, int, str], R]
    ) -> None:
        """``measured`` carries out one run of a cause, with a seed and under a mismatch."""
        sources = commit("src", "benchmarks/decisions")
        self._path = FOLDER / f"{part}-{plant.name}-{mismatch}-{sources}.jsonl"
        self._plant, self._mismatch, self._kind, self._measured = plant, mismatch, kind, measured

    def kept(self) -> Iterator[R]:
        """What is in."""
        for text in self._path.read_text(encoding="utf-8").splitlines() if self._path.exists() else ():
            yield self._kind(**json.loads(text))

    def fill(self, causes: Sequence[tuple[Cause, int]]) -> None:
        """Measure what is lacking, and print each run."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        known = {(row.fault, row.seed) for row in self.kept()}
        for cause, seed in causes:
            if (cause.fault, seed) in known:
                continue
            found = self._measured(self._plant, cause, seed, self._mismatch)
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(found)) + "\n")  # type: ignore[call-overload]  # rows are dataclasses
            print(found, flush=True)
