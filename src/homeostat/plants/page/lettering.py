"""How wide a text is, and how it is broken, without knowing the font: on the wide side, so that nothing is clipped."""

import unicodedata
from typing import Final

_NARROW: Final = frozenset("iljtfrI.,:;'|!()[]{} -")
_WIDE: Final = frozenset("mwMW@%&—→")
_CUT: Final = "…"


def width(text: str, size: float) -> float:
    """About how wide ``text`` is in a common sans-serif font of ``size`` [px]; rather too wide than too narrow."""
    return size * sum(map(_ems, text))


def broken(text: str, size: float, most: float, rows: int) -> list[str]:
    """``text`` in at most ``rows`` lines, none wider than ``most`` [px]; what does not fit is cut, and that is seen."""
    lines: list[str] = []
    rest = " ".join(text.split())
    while rest and len(lines) < rows:
        line, rest = _first(rest, size, most)
        lines.append(line)
    if rest:
        kept = lines[-1]
        while kept and width(kept + _CUT, size) > most:
            kept = kept[:-1]
        lines[-1] = kept.rstrip() + _CUT
    return lines


def _first(text: str, size: float, most: float) -> tuple[str, str]:
    """What fits into one line, broken at a space, after a dot or underscore, or else anywhere; and the rest."""
    end = len(text)
    while end > 1 and width(text[:end], size) > most:
        end -= 1
    if end == len(text):
        return text, ""
    if text[end] != " ":
        space = text.rfind(" ", 0, end)
        end = space if space > 0 else max(text.rfind(mark, 0, end) + 1 for mark in "._") or end
    return text[:end].rstrip(), text[end:].lstrip()


def _ems(character: str) -> float:
    if character in _NARROW:
        return 0.36
    if character in _WIDE or unicodedata.east_asian_width(character) in "WF":
        return 1.0
    return 0.7 if character.isupper() else 0.6
