"""Where a setting stands: the line of ``case.toml`` that states a key, so that a message can name it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

_HEADER: Final = re.compile(r"\s*(?P<marks>\[\[?)\s*(?P<keys>[^\]]+?)\s*\]")
_STATED: Final = re.compile(r"\s*(?P<keys>(?:[\w-]+|\"[^\"]*\"|'[^']*')(?:\s*\.\s*(?:[\w-]+|\"[^\"]*\"|'[^']*'))*)\s*=")
_KEY: Final = re.compile(r"\"([^\"]*)\"|'([^']*)'|([\w-]+)")


def line_of(text: str, place: Sequence[int | str]) -> int | None:
    """The line of ``text`` that states what stands at ``place``, or else the nearest table or key around it.

    ``place``: keys from the outside in; a number is that of an item of a list, from 0. None where nothing of it is
    there.

    >>> line_of("title = 'x'\\n[twin]\\ndraws = 3\\n[twin.errors]\\nT1 = 3.5", ("twin", "errors", "T1"))
    5
    >>> line_of("[[figure]]\\ntitle = 'x'\\n[[figure]]\\ntitle = 'y'", ("figure", 1, "title"))
    4
    >>> line_of("[run]\\nend_s = 3", ("start",)) is None
    True
    """
    wanted, found, deepest = tuple(place), None, 0
    table: tuple[int | str, ...] = ()
    items: dict[tuple[int | str, ...], int] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        stated: tuple[int | str, ...]
        if header := _HEADER.match(line):
            table = _keys(header["keys"])
            if header["marks"] == "[[":
                items[table] = items.get(table, -1) + 1
                table = (*table, items[table])
            stated = table
        elif key := _STATED.match(line):
            stated = (*table, *_keys(key["keys"]))
        else:
            continue
        common = _common(stated, wanted)
        if deepest < common and common == len(stated):
            found, deepest = number, common
    return found


def _keys(text: str) -> tuple[int | str, ...]:
    return tuple("".join(parts) for parts in _KEY.findall(text))


def _common(stated: tuple[int | str, ...], wanted: tuple[int | str, ...]) -> int:
    """How many keys the two have in common from the outside in."""
    pairs = zip(stated, wanted, strict=False)
    return next((n for n, (one, other) in enumerate(pairs) if one != other), min(len(stated), len(wanted)))
