"""Cells: names, texts, words, numbers with bounds and units, formulas, and references to rows of other tables."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from typing import Annotated, Final, TypeAlias

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, ValidationInfo

from homeostat.domain.plant.timing import REFERENCE, Timing
from homeostat.knowledge.description.guarding import times_s
from homeostat.knowledge.store.error import Code
from homeostat.stl.formula import FormulaError, parse, parse_expression
from homeostat.stl.spelling import near_matches

_LONGEST_NAME: Final = 120
_LONGEST_TEXT: Final = 2000
_SHOWN: Final = 80
_NUMBER: Final = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_WHOLE: Final = re.compile(r"-?(0|[1-9]\d*)", re.ASCII)
_TAG: Final = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*", re.ASCII)

BIG: Final = 1e9
"""No quantity of a plant is larger in a unit that somebody would choose for it."""
SMALL: Final = 1e-9
"""What must be more than nothing is at least this, in its unit."""
KEPT: Final = 3_600
"""Readings that the twin keeps."""


class CellError(ValueError):
    """What is wrong with a cell or with a row; the message names the value, what is allowed, and the remedy."""

    def __init__(self, code: Code, message: str) -> None:
        """``code`` says which mistake it is."""
        super().__init__(message)
        self.code = code
        """Which mistake it is."""


class TableRow(BaseModel):
    """A row of a table: its fields are the table's columns, those with a default may be empty."""

    model_config = ConfigDict(frozen=True)


@dataclass(frozen=True, slots=True)
class Refers:
    """Marks a column whose cell is the name of something that another row states."""

    kind: str
    """What is referred to; see `homeostat.knowledge.build.tables.check`."""


@dataclass(frozen=True, slots=True)
class Reads:
    """Marks a column with a formula or expression."""

    read: Callable[[str], frozenset[str]]
    """Names that a text reads."""
    kinds: frozenset[str]
    """What these may be."""
    code: Code
    """The mistake where one is none of them."""


def shown(cell: str) -> str:
    """A cell for a message: in one line, and not without end."""
    text = ascii(cell)
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."


def number(low: float, high: float, unit: str, why: str) -> BeforeValidator:
    """A number from ``low`` to ``high`` in ``unit``; ``why`` says where the ends come from."""

    return BeforeValidator(lambda cell: _number(cell, (low, high), unit, why))


def _number(cell: str, ends: tuple[float, float], unit: str, why: str) -> float:
    if not _NUMBER.fullmatch(cell):
        raise CellError(Code.BAD_NUMBER, f"{shown(cell)} is no number; write one in {unit}, with a decimal point")
    if not ends[0] <= float(cell) <= ends[1]:
        message = f"{shown(cell)} is outside {ends[0]:g} to {ends[1]:g} {unit}: {why}; correct the cell"
        raise CellError(Code.BAD_NUMBER, message)
    return float(cell)


def seconds(column: str, why: str) -> BeforeValidator:
    """A time inside the bounds of ``column`` for the plant's timing [s]; ``why`` says where they come from.

    Where the row says before how often its instrument is sampled, they go by that.
    """

    def check(cell: str, info: ValidationInfo) -> float:
        timing, reason = _timing(info), why
        if timing.response_s != REFERENCE.response_s:
            reason += (
                f", and the plant responds in {timing.response_s:g} s ([time] response_s, or else the longest Kp / Ki)"
            )
        every_s = info.data.get("every_s")
        if every_s is not None:
            reason += f", and a sample is taken every {every_s:g} s"
        return _number(cell, times_s(column, timing, every_s), "s", reason)

    return BeforeValidator(check)


def _timing(info: ValidationInfo) -> Timing:
    """The timing of the plant whose row is validated."""
    return info.context if isinstance(info.context, Timing) else Timing()


def whole(low: int, high: int, what: str) -> BeforeValidator:
    """A whole number from ``low`` to ``high``."""

    def check(cell: str) -> int:
        if not _WHOLE.fullmatch(cell) or len(cell) > 9 or not low <= int(cell) <= high:
            raise CellError(Code.BAD_NUMBER, f"{shown(cell)} is no whole number from {low} to {high}: {what}")
        return int(cell)

    return BeforeValidator(check)


def one_of(*words: str) -> BeforeValidator:
    """One of a few words."""

    def check(cell: str) -> str:
        if cell not in words:
            hint = near_matches(cell[:_LONGEST_NAME], words)
            raise CellError(Code.BAD_WORD, f"{shown(cell)} is none of {', '.join(words)}{hint}")
        return cell

    return BeforeValidator(check)


def words_of(enumeration: type[StrEnum]) -> BeforeValidator:
    """A word of an enumeration of the domain."""
    return one_of(*(item.value for item in enumeration))


def _name(cell: str) -> str:
    if len(cell) > _LONGEST_NAME or not cell.isprintable() or " " in cell:
        message = f"{shown(cell)} is no name; write at most {_LONGEST_NAME} printable characters without blanks"
        raise CellError(Code.BAD_TABLE, message)
    return cell


def _tag_name(cell: str) -> str:
    if len(cell) > _LONGEST_NAME or not _TAG.fullmatch(cell):
        message = f"{shown(cell)} is no name that formulas can use; write letters, digits, _ and dots, as in 'TIC7.sp'"
        raise CellError(Code.BAD_TABLE, message)
    return cell


def _text(cell: str) -> str:
    if len(cell) > _LONGEST_TEXT or not cell.isprintable():
        message = f"{shown(cell)} is no text; write at most {_LONGEST_TEXT} printable characters in one line"
        raise CellError(Code.BAD_TABLE, message)
    return cell


@lru_cache(maxsize=4096)  # tables repeat their formulas, and each is read twice: as a cell, and for what it names
def _condition_reads(cell: str) -> frozenset[str]:
    try:
        return parse(_text(cell)).tags
    except FormulaError as error:
        raise CellError(Code.BAD_FORMULA, str(error)) from None


@lru_cache(maxsize=4096)
def _expression_reads(cell: str) -> frozenset[str]:
    try:
        return parse_expression(_text(cell)).tags
    except FormulaError as error:
        raise CellError(Code.BAD_FORMULA, str(error)) from None


def _readable(read: Callable[[str], frozenset[str]]) -> AfterValidator:
    def check(cell: str) -> str:
        read(cell)
        return cell

    return AfterValidator(check)


Name: TypeAlias = Annotated[str, AfterValidator(_name)]
"""What tables, formulas, prompts and code call a thing."""
TagName: TypeAlias = Annotated[str, AfterValidator(_tag_name)]
"""Name of a tag: formulas can use it."""
Text: TypeAlias = Annotated[str, AfterValidator(_text)]
"""Words for people."""
YesNo: TypeAlias = Annotated[str, one_of("yes", "no")]
"""``yes`` or ``no``."""

_CONDITION: Final = Reads(_condition_reads, frozenset({"tag", "parameter"}), Code.UNKNOWN_TAG)
_EXPRESSION: Final = Reads(_expression_reads, frozenset({"tag", "parameter"}), Code.UNKNOWN_TAG)
_EQUATION: Final = Reads(_expression_reads, frozenset({"tag", "parameter"}), Code.UNKNOWN_SYMBOL)
Condition: TypeAlias = Annotated[str, _readable(_condition_reads), _CONDITION]
"""A formula over tags and parameters."""
OptionalCondition: TypeAlias = Annotated[str | None, _readable(_condition_reads), _CONDITION]
"""A formula over tags and parameters, or nothing."""
Term: TypeAlias = Annotated[str, _readable(_expression_reads), _EXPRESSION]
"""An arithmetic term over tags and parameters."""
OptionalTerm: TypeAlias = Annotated[str | None, _readable(_expression_reads), _EXPRESSION]
"""An arithmetic term over tags and parameters, or nothing."""
Equation: TypeAlias = Annotated[str, _readable(_expression_reads), _EQUATION]
"""An arithmetic term over tags and parameters."""

Component: TypeAlias = Annotated[str, Refers("component")]
"""Name of a component."""
OptionalComponent: TypeAlias = Annotated[str | None, Refers("component")]
"""Name of a component, or nothing."""
Tag: TypeAlias = Annotated[str, Refers("tag")]
"""Name of a tag."""
OptionalTag: TypeAlias = Annotated[str | None, Refers("tag")]
"""Name of a tag, or nothing."""
Operator: TypeAlias = Annotated[str, Refers("operator")]
"""Name of a process operator."""
OptionalOperator: TypeAlias = Annotated[str | None, Refers("operator")]
"""Name of a process operator, or nothing."""
Parameter: TypeAlias = Annotated[str, Refers("parameter")]
"""Symbol of a parameter."""
StateName: TypeAlias = Annotated[str, Refers("state")]
"""Name of a state."""
LimitName: TypeAlias = Annotated[str, Refers("limit")]
"""Name of a limit."""

Value: TypeAlias = Annotated[float, number(-BIG, BIG, "(its unit)", "nothing in a plant is larger")]
"""A value of any sign, in the unit of what it is about."""
OptionalValue: TypeAlias = Annotated[float | None, number(-BIG, BIG, "(its unit)", "nothing in a plant is larger")]
"""A value of any sign, or nothing."""
Positive: TypeAlias = Annotated[float, number(SMALL, BIG, "(its unit)", "it must be more than 0")]
"""A value above 0, in the unit of what it is about."""
OptionalPositive: TypeAlias = Annotated[float | None, number(SMALL, BIG, "(its unit)", "it must be more than 0")]
"""A value above 0, or nothing."""
OptionalRate: TypeAlias = Annotated[
    float | None,
    number(SMALL, BIG, "(unit of the tag) per s", "a rate must be more than 0, and an empty cell states none"),
]
"""A change above 0 in the tag's unit per second, or nothing."""
Size: TypeAlias = Annotated[float, number(0.0, BIG, "(its unit)", "it cannot be negative")]
"""A value that is not negative, in the unit of what it is about."""
OptionalSize: TypeAlias = Annotated[
    float | None, number(0.0, BIG, "(its unit)", "it cannot be negative, and an empty cell is 0")
]
"""A value that is not negative, or nothing."""


def _wait(cell: str, info: ValidationInfo) -> float:
    return _number(cell, (0.0, KEPT * _timing(info).tick_s), "s", f"the twin keeps {KEPT} readings")


Wait: TypeAlias = Annotated[float, BeforeValidator(_wait)]
"""A time that may be none [s]."""


def in_order(low: float, high: float, columns: str, equal: bool = False) -> None:
    """CellError where the ends of a range are not in order; ``columns`` names them."""
    if not (low < high or (equal and low == high)):
        needed = "must not be above" if equal else "must be below"
        message = f"{columns}: {low:g} {needed} {high:g}; exchange or correct them"
        raise CellError(Code.REVERSED_RANGE, message)
