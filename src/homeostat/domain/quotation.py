"""Quotation: texts of the plant made safe to stand inside a prompt as data.

Prompts delimit data with guillemets, « and ». What stands between them is one line of visible characters, holds no
guillemet, opens no Markdown section, code fence or front matter, and spells no special token of a chat template.
"""

import re
import unicodedata
from typing import Final

_UNSEEN: Final = frozenset({"Cc", "Cf", "Cs", "Co", "Cn"})
"""Unicode categories without a glyph: control, format, surrogate, private use, unassigned."""
_SELECTORS: Final = (*range(0xFE00, 0xFE10), *range(0xE0100, 0xE01F0), *range(0x180B, 0x1810))
"""Variation selectors of Unicode."""
_IGNORED: Final = (0x034F, 0x115F, 0x1160, 0x17B4, 0x17B5, 0x3164, 0xFFA0)
"""Joiner and fillers that Unicode says to ignore."""
_BLANK: Final = frozenset(map(chr, (*_SELECTORS, *_IGNORED, 0x2800)))  # and a Braille cell without dots
"""Letters, marks and signs that show nothing, although their category says otherwise."""
_DELIMITERS: Final = re.compile("[«»‹›≪≫⋘⋙《》〈〉⟨⟩⟪⟫❬❭❮❯❰❱]|<<+|>>+")
_PIPED: Final = re.compile(r"<\|+|\|+>")
_BRACKETED: Final = re.compile(r"<(/?[A-Za-z_][\w-]*/?)>|\[(/?[A-Z_]{4,})\]")
"""Special tokens without a pipe: ``</s>``, ``<start_of_turn>``, ``[INST]``. Units, as in [W] or [kJ/kg], are none."""
_RUNS: Final = re.compile(r"([-=#`~])\1{2,}")
_MOST_MARKS: Final = 2
"""Combining marks that a letter may carry."""
_CUT: Final = "..."
"""Stands where a text was cut off: what normalisation makes of an ellipsis."""
_READ: Final = 40
"""Characters that are looked at for every one that may stay: what comes after is cut off in any case."""


def quoted(text: str, limit: int = 120) -> str:
    """``text`` in one line of at most ``limit`` visible characters; quoting it again changes nothing.

    Letters and signs keep the form that Unicode normalisation (NFKC) gives them: units and formulas stay readable,
    full-width and other look-alike forms become plain. Letters of other alphabets stay what they are.

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


def printable(text: str) -> str:
    """``text`` in one line of visible characters: what a terminal would obey or hide is written as an escape.

    >>> printable("T1\\x1b[2J\\nreleased")
    'T1\\\\x1b[2J\\\\nreleased'
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(_escaped(c) if not c.isprintable() or c in _BLANK else c for c in text)


def is_unseen(character: str) -> bool:
    """Whether nobody sees ``character``: it has no glyph, or an empty one. A space is seen, a line break is not."""
    return character in _BLANK or unicodedata.category(character) in _UNSEEN


def most_marks(text: str) -> int:
    """The most combining marks that a letter of ``text`` carries, once letters and marks are taken apart (NFD)."""
    most = marks = 0
    for character in unicodedata.normalize("NFD", text):
        marks = marks + 1 if _is_mark(character) else 0
        most = max(most, marks)
    return most


def _escaped(character: str) -> str:
    return character.encode("unicode_escape").decode()


def _once(text: str) -> str:
    plain = unicodedata.normalize("NFKC", "".join(" " if c.isspace() else c for c in text))
    seen = _thinned("".join(c for c in plain if not is_unseen(c)))
    seen = _PIPED.sub(lambda found: "< " if found[0][0] == "<" else " >", _DELIMITERS.sub("'", seen))
    seen = _BRACKETED.sub(lambda found: f"{found[0][0]} {found[0][1:-1]} {found[0][-1]}", seen)
    return " ".join(_RUNS.sub(r"\1", seen).split())


def _thinned(text: str) -> str:
    """``text`` without the marks that are too many for their letter."""
    kept, marks = [], 0
    for character in text:
        marks = marks + 1 if _is_mark(character) else 0
        if marks <= _MOST_MARKS:
            kept.append(character)
    return "".join(kept)


def _is_mark(character: str) -> bool:
    return unicodedata.category(character) in ("Mn", "Me")
