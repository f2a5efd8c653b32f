"""What commands of studies are given: names, and numbers as a list or a stretch."""

from __future__ import annotations

MISMATCHES = ("none", "plant", "twice", "thrice")
"""How a true plant may not be its model: what the shipped plants both have."""


def names(text: str) -> list[str]:
    """Names that commas separate."""
    return [name for name in text.split(",") if name]


def numbers(text: str) -> list[int]:
    """Whole numbers as ``1,2`` or ``1-3``; ValueError for anything else."""
    found: list[int] = []
    for part in names(text):
        first, stretch, last = part.partition("-")
        found += range(int(first), int(last if stretch else first) + 1)
    return found
