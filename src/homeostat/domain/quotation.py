"""Quotation: text of the plant made safe to stand inside a prompt as data."""

from __future__ import annotations

import re
import unicodedata
from typing import Final

_DROPPED: Final = frozenset({"Cc", "Cf", "Cs", "Co", "Cn"})
_DELIMITERS: Final = re.compile("[«»‹›《》〈〉]|<<|>>")
_RUNS: Final = re.compile(r"([-=#`~])\1{2,}")
_TOKENS: Final = re.compile(r"<\|")


def quoted(text: str, limit: int = 120) -> str:
    """``text`` in one line of at most ``limit`` printable characters."""
    kept = "".join(" " if c.isspace() else c for c in unicodedata.normalize("NFKC", text[: 20 * limit]))
    kept = "".join(c for c in kept if unicodedata.category(c) not in _DROPPED)
    kept = _TOKENS.sub("< ", _RUNS.sub(r"\1", _DELIMITERS.sub("'", kept)))
    kept = " ".join(kept.split())
    return kept if len(kept) <= limit else f"{kept[: limit - 1]}…"


def quote(text: str, limit: int = 120) -> str:
    """``text`` as quoted data."""
    return f"«{quoted(text, limit)}»"
