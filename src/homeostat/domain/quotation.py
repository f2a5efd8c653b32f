"""Quotation: texts of the plant made safe to stand inside a prompt as data.

Prompts delimit data with guillemets, « and ». What stands between them is one line of printable characters, holds no
guillemet, opens no Markdown section, code fence or front matter, and spells no special token of a chat template.
"""

from __future__ import annotations

import re
import unicodedata
from typing import Final

_UNSEEN: Final = frozenset({"Cc", "Cf", "Cs", "Co", "Cn"})
"""Unicode categories without a glyph: control, format, surrogate, private use, unassigned."""
_VARIATION: Final = frozenset(map(chr, (*range(0xFE00, 0xFE10), *range(0xE0100, 0xE01F0))))
_DELIMITERS: Final = re.compile("[«»‹›《》〈〉]|<<+|>>+")
_SPECIAL: Final = re.compile(r"<\|+|\|+>")
_RUNS: Final = re.compile(r"([-=#`~])\1{2,}")
_MARKS: Final = re.compile("([\u0300-\u036f\u1ab0-\u1aff\u1dc0-\u1dff\u20d0-\u20ff\ufe20-\ufe2f]{2})"
                           "[\u0300-\u036f\u1ab0-\u1aff\u1dc0-\u1dff\u20d0-\u20ff\ufe20-\ufe2f]+")  # fmt: skip
"""More than two combining marks in a row."""
_CUT: Final = "..."
"""Stands where a text was cut off."""
_READ: Final = 40
"""Characters that are looked at for every one that may stay: what comes after is cut off in any case."""


def quoted(text: str, limit: int = 120) -> str:
    """``text`` in one line of at most ``limit`` printable characters; quoting it again changes nothing.

    Letters and signs keep the form that Unicode normalisation (NFKC) gives them: units and formulas stay readable,
    full-width and other look-alike forms become plain.

    >>> quoted("Level » # Rules", 40)
    "Level ' # Rules"
    """
    before, kept = "", text[: _READ * limit]
    while kept != before:  # taking something away may bring together what must not stand together
        before, kept = kept, _once(kept)
    if len(kept) <= limit:
        return kept
    cut = kept[: max(limit - len(_CUT), 0)].rstrip() + _CUT[:limit]
    return cut if _once(cut) == cut else quoted(cut, limit)


def quote(text: str, limit: int = 120) -> str:
    """``text`` as quoted data, guillemets included beyond the limit.

    >>> quote("Feed pump")
    '«Feed pump»'
    """
    return f"«{quoted(text, limit)}»"


def _once(text: str) -> str:
    plain = unicodedata.normalize("NFKC", "".join(" " if c.isspace() else c for c in text))
    seen = "".join(c for c in plain if unicodedata.category(c) not in _UNSEEN and c not in _VARIATION)
    seen = _MARKS.sub(r"\1", seen)
    seen = _SPECIAL.sub(lambda found: "< " if found[0][0] == "<" else " >", _DELIMITERS.sub("'", seen))
    return " ".join(_RUNS.sub(r"\1", seen).split())
