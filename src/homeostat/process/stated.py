"""The numbers that a plant's tables state of its model, for what a model must know before it is given parameters."""

import csv
from pathlib import Path


def stated_values(folder: Path) -> dict[str, float]:
    """Symbol -> best estimate in its unit, of every parameter that the plant in ``folder`` states."""
    with (folder / "engineering" / "parameters.csv").open(newline="", encoding="utf-8") as file:
        return {row["symbol"]: float(row["value"]) for row in csv.DictReader(file)}
