"""The two heated tanks of the example, so many times slower or faster: the same plant in other seconds."""

from __future__ import annotations

import csv
import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Final

EXAMPLE: Final = Path(__file__).parents[3] / "examples" / "two_tanks"
EXPONENTS: Final = {"s": 1, "s/L": 1, "L/s": -1, "1/s": -1, "kW": -1, "1/(L s)": -1, "1/(K s)": -1}
"""Unit -> to which power of the stretch a number in it goes; 0 for every other unit."""
_FEED: Final = re.compile(r"(F1\.sp [<>]= )([\d.]+)")


@dataclass(frozen=True)
class Stretched:
    """A plant's folder."""

    folder: Path
    stretch: float
    """How many times slower than the example it is."""

    @classmethod
    def of(cls, stretch: float, where: Path) -> Stretched:
        """Sampled as many times more seldom, so that every tick is what it was."""
        made = cls(where / "tanks", stretch)
        shutil.copytree(EXAMPLE, made.folder, ignore=shutil.ignore_patterns("__pycache__", "plant.ttl", "baseline.csv"))
        for name in ("parameters", "instruments", "setpoints", "guards", "fallbacks", "fallback_limits", "states"):
            made._rewrite(name)
        settings = made.folder / "case.toml"
        text = settings.read_text("utf-8")
        for key in ("end_s", "onset_s"):
            text = re.sub(rf"{key} = ([\d.]+)", lambda found, k=key: f"{k} = {float(found[1]) * stretch!r}", text)
        settings.write_text(text.replace("[run]", f"[time]\ntick_s = {stretch!r}\n\n[run]"), "utf-8")
        return made

    def _rewrite(self, name: str) -> None:
        path = self.folder / "engineering" / f"{name}.csv"
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        units = {"F1.sp": "L/s"}
        for row in rows:
            unit = row.get("unit") or units.get(row.get("tag", ""), "")
            for column in ("value", "low", "high", "design"):
                self._scale(row, column, EXPONENTS.get(unit, 0))
            self._scale(row, "fastest", -1)
            for column in ("acts_within_s", "start_up_s"):
                self._scale(row, column, 1)
            if row.get("formula"):
                row["formula"] = _FEED.sub(lambda found: found[1] + self._of(found[2], -1), row["formula"])
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, rows[0], lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)

    def _scale(self, row: dict[str, str], column: str, power: int) -> None:
        if row.get(column) and power:
            row[column] = self._of(row[column], power)

    def _of(self, cell: str, power: int) -> str:
        return repr(float(cell) * self.stretch**power)
