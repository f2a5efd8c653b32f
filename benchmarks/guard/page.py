"""The page of the guard: each claim with its bar beside the figure, and what was missed."""

from __future__ import annotations

from benchmarks.guard.store import ROOT

PAGE = ROOT / "docs" / "results" / "guard.md"


def page(names: list[str]) -> str:
    """The page."""
    return ""
