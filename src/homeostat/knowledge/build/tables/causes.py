"""One mistake, one message: of the mistakes of a plant's tables, those that do not follow from another one.

From one cell of a loop or a thing follow tags, and rows that name those; where the cell is wrong, each of them names
what is not there.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from homeostat.knowledge.store.error import Code, GraphError

_PLACE: Final = re.compile(r"(?P<table>\w+)\.csv row (?P<row>\d+)")
_KEY: Final = re.compile(r"\('(?P<key>[^']*)'\)$")
_FOLLOWS: Final = "a row that follows from"
_MAKING: Final = frozenset({"equipment", "instruments", "loops"})
"""Tables from whose rows tags follow."""
_UNKNOWN: Final = re.compile(r"there is no (?P<kind>[\w ]+) '(?P<name>[^']*)'")


def first_causes(found: Sequence[GraphError]) -> list[GraphError]:
    """``found`` in its order, without what follows from another mistake in it, or says the same of the same row."""
    own = [error for error in found if _FOLLOWS not in error.thing]
    wrong = [error for error in own if _table(error) in _MAKING]
    wrong = [error for error in wrong if not _derived(error, wrong)]
    kept: list[GraphError] = []
    said = set[tuple[str, str]]()
    nameless = {error.thing for error in own if (name := unknown_name(error.message)) and name == _key(error)}
    for error in found:
        row, unknown = _row(error), unknown_name(error.message)
        follows = _FOLLOWS in error.thing and any(_row(each) == row for each in own)
        follows = follows or _derived(error, wrong)
        follows = follows or (error.code is Code.MISSING_VALUE and error.thing in nameless)  # it would have been filled
        if not follows and (row, unknown or error.message) not in said:
            said.add((row, unknown or error.message))
            kept.append(error)
    return kept


def _derived(error: GraphError, wrong: Sequence[GraphError]) -> bool:
    """Whether it misses a tag, such as ``V1.man``, of something that a mistake in ``wrong`` is about."""
    base, dot, _ = unknown_name(error.message).rpartition(".")
    if not dot or error.code not in (Code.UNKNOWN_TAG, Code.UNKNOWN_PARAMETER):
        return False
    about = re.compile(rf"(?<![\w.]){re.escape(base)}(?![\w])")
    return any(each is not error and about.search(f"{each.thing} {each.message}") for each in wrong)


def unknown_name(message: str) -> str:
    """What a message says that there is not; empty for any other one."""
    found = _UNKNOWN.search(message)
    return found["name"] if found else ""


def _key(error: GraphError) -> str:
    """What the row of a mistake is about."""
    found = _KEY.search(error.thing)
    return found["key"] if found else ""


def _row(error: GraphError) -> str:
    found = _PLACE.search(error.thing)
    return found[0] if found else error.thing


def _table(error: GraphError) -> str:
    found = _PLACE.search(error.thing)
    return found["table"] if found else ""
