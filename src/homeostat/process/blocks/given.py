"""What the parts of a flowsheet are given: where it must be a number now, and where a symbol or a term may stand."""

from __future__ import annotations

import math
import re
from collections.abc import Container, Mapping
from numbers import Real
from typing import Final

from homeostat.process.blocks.term import Operand, Term, term

_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,40}")


class FlowsheetError(ValueError):
    """A flowsheet that cannot be a model; the message says what is wrong and what to do."""


def plain_number(who: str, name: str, value: object) -> float:
    """``value`` of the argument ``name`` of the part ``who``; FlowsheetError where it is no finite number.

    It is for what says how large a part is or how it begins: that is needed before there are values of parameters.
    """
    if isinstance(value, str | Term):
        what = f"the symbol {value!r:.60}" if isinstance(value, str) else "a term"
        raise FlowsheetError(
            f"{who}: {name} is {what}, and is needed before parameters have values; write the number itself"
        )
    if isinstance(value, bool) or not isinstance(value, Real):
        raise FlowsheetError(f"{who}: {name} = {value!r:.60} is no number; write one")
    if not math.isfinite(value):
        raise FlowsheetError(f"{who}: {name} = {float(value)!r} has no end; write a finite number")
    return float(value)


def operand(who: str, name: str, value: Operand) -> Term:
    """``value`` of the argument ``name`` of the part ``who`` as a term; FlowsheetError where it cannot be one."""
    try:
        return term(value)
    except (TypeError, ValueError):
        what = f"{name} = {value!r:.60} is no term"
        raise FlowsheetError(f"{who}: {what}; give a term, a finite number, or the symbol of a parameter") from None


def positive(who: str, name: str, value: Operand, zero: bool = False) -> Term:
    """The same where a number must be more than 0, such as a time constant [s]; ``zero``: or 0."""
    made = operand(who, name, value)
    if made.op == "number" and (float(made.value) < 0.0 or (float(made.value) == 0.0 and not zero)):
        least = "at least 0" if zero else "more than 0"
        raise FlowsheetError(f"{who}: {name} = {float(made.value):g} must be {least}; correct it")
    return made


def refuse_name(name: str, taken: Container[str], kinds: Mapping[str, Container[str]]) -> None:
    """FlowsheetError where ``name`` is no name, or is among ``taken``; ``kinds`` say what has it, as ``a state``."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise FlowsheetError(f"{name!r:.60} is no name; write letters, digits and _, beginning with a letter")
    if name in taken:
        known_as = next((f" as {kind}" for kind, parts in kinds.items() if name in parts), "")
        raise FlowsheetError(f"{name!r} is there already{known_as}; give each part a name of its own")
