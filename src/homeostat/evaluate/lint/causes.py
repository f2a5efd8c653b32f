"""One mistake, one finding: what of a plant's inconsistencies is the cause, and what only follows from it."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from homeostat.knowledge.store.error import Code, Mistake

_FOLLOWING: Final[Mapping[Code, frozenset[Code]]] = {
    Code.LIMIT_OUTSIDE_RANGE: frozenset({Code.LIMIT_NEVER_VIOLATED, Code.GUARD_NEVER_TRUE}),
    Code.LIMIT_WITHOUT_VALUE: frozenset({Code.READING_NOT_RATED, Code.LIMIT_NEVER_VIOLATED}),
    Code.LIMIT_NEVER_VIOLATED: frozenset({Code.LIMIT_NEVER_VIOLATED}),
    Code.UNKNOWN_FAULT: frozenset({Code.FAULT_WITHOUT_SYMPTOM}),
}
"""Mistake of a thing -> those of the same thing that follow from it."""
_NEVER: Final = (Code.LIMIT_OUTSIDE_RANGE, Code.LIMIT_NEVER_VIOLATED)
_ALIKE: Final = 0.75
"""Share of two names that is the same where one is taken for the other's misspelling [1]."""


def first_causes(mistakes: Sequence[Mistake]) -> list[Mistake]:
    """``mistakes`` in their order, without what follows from another one of them; of two alike the first stays."""
    return [each for place, each in enumerate(mistakes) if not any(_causes(mistakes, place))]


def _causes(mistakes: Sequence[Mistake], place: int) -> Iterator[Mistake]:
    """What that in this ``place`` follows from."""
    each = mistakes[place]
    for other, cause in enumerate(mistakes):
        if other != place and _follows(each, cause) and (other < place or not _follows(cause, each)):
            yield cause


def misspelt(missing: str, known: Sequence[str]) -> str:
    """The name in ``known`` that is almost ``missing``; empty where none is."""
    close = difflib.get_close_matches(missing.lower(), [name.lower() for name in known], n=1, cutoff=_ALIKE)
    return next((name for name in known if close and name.lower() == close[0]), "")


def _follows(each: Mistake, cause: Mistake) -> bool:
    if each.thing == cause.thing and each.code in _FOLLOWING.get(cause.code, frozenset()):
        return each.code is not Code.READING_NOT_RATED or _tag(each) == _tag(cause)
    if cause.code in _NEVER and each.code is Code.BAD_NUMBER and each.thing.endswith(f", {cause.thing}"):
        return True  # what may stay of a violation that there cannot be
    if cause.code is Code.FALLBACK_TAG_NOT_COMMANDABLE and each.code in _COMMANDS:
        tag = _tag(cause)
        return tag == _tag(each) or each.thing == f"writable tag {tag!r}"
    if cause.code in (Code.FALLBACK_OUTSIDE_RANGE, Code.SETPOINT_OUTSIDE_RANGE):
        return each.code is Code.FALLBACK_NOT_ADMITTED and _tag(cause) == _tag(each)
    return False


_COMMANDS: Final = (Code.FALLBACK_NOT_ADMITTED, Code.NOT_COMMANDABLE, Code.TAG_NOT_WRITABLE)


def _tag(each: Mistake) -> str:
    """The first name that a mistake quotes."""
    found = re.search(r"'([^']+)'", each.message)
    return found[1] if found else ""


def pairs(missing: Sequence[str], idle: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Each symbol that is missing with the one that is idle and almost the same; empty where there is none.

    One that is missing and one that is idle are taken for each other whatever they are called.
    """
    if len(missing) == len(idle) == 1:
        yield missing[0], idle[0]
        return
    left = list(idle)
    for name in missing:
        found = misspelt(name, left)
        left = [each for each in left if each != found]
        yield name, found
