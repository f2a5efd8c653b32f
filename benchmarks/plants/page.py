"""The page of plants, which several commands write a part of."""

from __future__ import annotations

import re

from benchmarks.host import ROOT

PAGE = ROOT / "docs" / "results" / "plants.md"
LAST = "Where it was measured"
"""Section that stays the last one, with what the page says of its host."""


def section(page: str, title: str) -> str:
    """The section called ``title`` with its heading, up to the next heading; empty where there is none."""
    found = re.search(rf"^## {re.escape(title)}\n.*?(?=^## |\Z)", page, re.MULTILINE | re.DOTALL)
    return "" if found is None else found[0]


def with_section(page: str, title: str, body: str) -> str:
    """``page`` with ``body`` as the section ``title``, in its place, or before the last one where it is new."""
    written, former = f"## {title}\n\n{body}\n\n", section(page, title)
    if former:
        return page.replace(former, written)
    last = section(page, LAST)
    return page.replace(last, written + last) if last else f"{page.rstrip()}\n\n{written.rstrip()}\n"
