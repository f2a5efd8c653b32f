"""Reading rows about things: every mistake becomes a GraphError that names the thing and says what is missing."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

from pyoxigraph import NamedNode

from homeostat.domain.plant.tag import Range, Tag
from homeostat.knowledge.questions.query import template
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.store.store import GraphStore, Solution, UnexpectedAnswer
from homeostat.stl.formula import Expression, Formula, FormulaError, parse, parse_expression

_T = TypeVar("_T")
_Rule = TypeVar("_Rule", Formula, Expression)
_Word = TypeVar("_Word", bound=StrEnum)


@dataclass(frozen=True, slots=True)
class Entry:
    """One row about one thing."""

    kind: str
    """What the thing is, for messages: ``tag``, ``limit``."""
    name: str
    """Its name."""
    row: Solution
    """The row."""

    @property
    def thing(self) -> str:
        """The thing, for messages."""
        return f"{self.kind} {self.name!r}"

    def text(self, column: str) -> str:
        """A text that must be there."""
        return self._need(column, self.row.optional_text)

    def number(self, column: str) -> float:
        """A finite number that must be there."""
        return self._need(column, self.optional_number)

    def flag(self, column: str) -> bool:
        """A yes or no that must be there."""
        return self._need(column, self.row.optional_flag)

    def whole(self, column: str) -> int:
        """A whole number that must be there."""
        value = self.number(column)
        if value != int(value):
            raise GraphError(Code.BAD_NUMBER, self.thing, f"{column} {value!r} must be a whole number")
        return int(value)

    def words(self, column: str) -> str:
        """A text for people; empty where there is none."""
        return self._read(column, self.row.optional_text) or ""

    def optional_text(self, column: str) -> str | None:
        """A text, or None."""
        return self._read(column, self.row.optional_text)

    def optional_number(self, column: str) -> float | None:
        """A finite number, or None."""
        value = self._read(column, self.row.optional_number)
        if value is not None and not math.isfinite(value):
            raise GraphError(Code.BAD_NUMBER, self.thing, f"{column} {value!r} must be finite")
        return value

    def word(self, column: str, words: type[_Word]) -> _Word:
        """One of a few words."""
        text = self._read(column, self.row.optional_text)
        if text not in set(words):
            found = repr(text) if text else "none of the known words"
            raise GraphError(Code.BAD_WORD, self.thing, f"{column} is {found}, must be one of {', '.join(words)}")
        return words(text)

    def reference(self, column: str, code: Code) -> str:
        """The name of another thing that must be there; ``code`` where it is in no table."""
        name = self.optional_reference(column, code)
        if name is None:
            raise GraphError(Code.MISSING_VALUE, self.thing, f"has no {column}; fill the cell")
        return name

    def optional_reference(self, column: str, code: Code) -> str | None:
        """The name of another thing, or None where none is referred to."""
        name = self._read(f"{column}_name", self.row.optional_text)
        if name is not None:
            return name
        node = self._read(column, self.row.optional_iri)
        if node is None:
            return None
        local = node.value.rpartition("#")[2].partition("_")[2]
        raise GraphError(code, self.thing, f"{column} {local!r} is in no table; correct it or add its row")

    def range(self, low: str, high: str) -> Range:
        """A range whose ends must be there, in order."""
        ends = self.number(low), self.number(high)
        try:
            return Range(*ends)
        except ValueError as error:
            raise GraphError(Code.REVERSED_RANGE, self.thing, str(error)) from error

    def formula(self, column: str, tags: Mapping[str, Tag]) -> Formula:
        """A condition over ``tags``."""
        return self._rule(self.text(column), tags, parse)

    def expression(self, column: str, tags: Mapping[str, Tag]) -> Expression:
        """An arithmetic term over ``tags``."""
        return self._rule(self.text(column), tags, parse_expression)

    def optional_formula(self, column: str, tags: Mapping[str, Tag]) -> Formula | None:
        """A condition over ``tags``, or None."""
        text = self._read(column, self.row.optional_text)
        return None if text is None else self._rule(text, tags, parse)

    def optional_expression(self, column: str, tags: Mapping[str, Tag]) -> Expression | None:
        """An arithmetic term over ``tags``, or None."""
        text = self._read(column, self.row.optional_text)
        return None if text is None else self._rule(text, tags, parse_expression)

    def made(self, make: Callable[[], _T], code: Code) -> _T:
        """What ``make`` gives; its ValueError becomes ``code``."""
        try:
            return make()
        except GraphError:
            raise
        except ValueError as error:
            raise GraphError(code, self.thing, str(error)) from error

    def _need(self, column: str, read: Callable[[str], _T | None]) -> _T:
        value = self._read(column, read)
        if value is None:
            raise GraphError(Code.MISSING_VALUE, self.thing, f"has no {column}; fill the cell")
        return value

    def _read(self, column: str, read: Callable[[str], _T | None]) -> _T | None:
        try:
            return read(column)
        except UnexpectedAnswer as error:
            raise GraphError(Code.MISSING_VALUE, self.thing, str(error)) from error

    def _rule(
        self, text: str, tags: Mapping[str, Tag], read: Callable[[str, Mapping[str, Tag] | None], _Rule]
    ) -> _Rule:
        try:
            return read(text, tags)
        except FormulaError as error:
            raise GraphError(_formula_code(text, tags, read), self.thing, str(error)) from error


def _formula_code(text: str, tags: Mapping[str, Tag], read: Callable[[str, None], Formula | Expression]) -> Code:
    """Why a rule was refused: it reads well without tags and one of its tags is unknown, or it is wrong by itself."""
    try:
        names = read(text, None).tags
    except FormulaError:
        return Code.BAD_FORMULA
    return Code.BAD_FORMULA if names <= tags.keys() else Code.UNKNOWN_TAG


def entries(store: GraphStore, question: str, kind: str, system: NamedNode) -> tuple[Entry, ...]:
    """The rows of template ``question`` about ``system``; GraphError for a thing without a name."""
    found = []
    for row in template(question).select(store, system=system):
        name = row.optional_text("name")
        if name is None:
            local = row.iri("thing").value.rpartition("#")[2]
            raise GraphError(Code.MISSING_VALUE, f"{kind} {local!r}", "has no name; it is used but in no table")
        found.append(Entry(kind, name, row))
    return tuple(found)


def unique(found: Iterable[Entry]) -> tuple[Entry, ...]:
    """The entries; GraphError where two are about the same thing, which has then two values of something."""
    seen: dict[str, Solution] = {}
    for entry in found:
        if (other := seen.get(entry.name)) is not None:
            differing = [n for n, a, b in zip(other.variables, other.terms, entry.row.terms, strict=True) if a != b]
            what = " and ".join(differing) or "nothing"
            raise GraphError(Code.DUPLICATE_ID, entry.thing, f"is stated more than once; {what} differs")
        seen[entry.name] = entry.row
    return tuple(found)
