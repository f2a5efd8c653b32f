"""Whose unit is wrong where the units of a flowsheet do not agree: the cell that makes most of it agree once corrected.

One cell is read in many equations, and each of them disagrees. What another unit of one cell would put right is that
cell's; where several would do, all of them are named.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

from homeostat.process.blocks.agreement import Disagreement, StatedUnits, found_in
from homeostat.process.blocks.flowsheet import Flowsheet
from homeostat.process.blocks.term import Leaf, Term
from homeostat.process.blocks.units import Unit, UnitError, read

_COMMON: Final = (
    "1", "s", "min", "h", "1/s", "1/min", "1/h", "m", "mm", "cm", "m2", "m3", "L", "kg", "g", "t", "mol", "kmol", "K",
    "bar", "mbar", "kPa", "Pa", "MPa", "W", "kW", "MW", "J", "kJ", "MJ", "kg/s", "kg/h", "t/h", "g/s", "m3/s", "m3/h",
    "m3/min", "L/s", "L/min", "L/h", "mol/s", "kmol/h", "kg/m3", "kg/L", "mol/m3", "mol/L", "mmol/L", "1/K", "1/bar",
    "1/m", "1/L", "1/m3", "s/L", "s/m3", "s/kg",
)  # fmt: skip
"""Units that are tried beside those of the plant's own tables."""
_AMOUNTS: Final = ("kmol", "mol", "kg", "g", "m3", "L")
"""Measures of an amount, of which one is taken for another."""
_MOST: Final = 200
"""Most corrections that are tried for one mistake."""


class Cell(NamedTuple):
    """A cell of the tables that states a unit."""

    name: str
    """Symbol of the parameter, or variable of the reading."""
    reading: bool
    """Whether it is that of a reading, which its setpoint and deviation share."""
    unit: str
    """As it is stated."""
    needed: str
    """With which the rest agrees."""


@dataclass(frozen=True, slots=True)
class WrongUnit:
    """One mistake in the units."""

    said: str
    """What does not agree, in a sentence."""
    cells: tuple[Cell, ...]
    """Cells of which each alone would explain it; empty where none does."""
    lacking: bool = False
    """Whether it is only that something has no unit, for which no table has a row."""


def wrong_units(sheet: Flowsheet, stated: StatedUnits) -> Iterator[WrongUnit]:
    """Each mistake once; FlowsheetError where the flowsheet is not complete."""
    left = _told(sheet, stated)
    if not left:
        yield from (WrongUnit(each.said, (), lacking=True) for each in found_in(sheet, stated))
    while left:
        tried = _corrections(sheet, stated, left)
        fewest = min(map(len, tried.values()), default=len(left))
        if fewest >= len(left):
            yield from (WrongUnit(each.said, ()) for each in left)
            return
        explain = (cell for cell, rest in tried.items() if len(rest) == fewest)
        cells = tuple(sorted(explain, key=lambda cell: len(cell.needed)))  # a plain unit is mistaken more easily
        rest = tried[cells[0]]
        gone = [each.said for each in left if each.said not in {other.said for other in rest}]
        yield WrongUnit(min(gone, key=len), cells)
        stated, left = _with(sheet, stated, cells[0]), rest


def _told(sheet: Flowsheet, stated: StatedUnits) -> tuple[Disagreement, ...]:
    """What is worth saying: not what follows from a unit that is said to be none, or from a parameter without row."""
    return tuple({each.said: each for each in found_in(sheet, stated) if not each.lacking}.values())


def _corrections(
    sheet: Flowsheet, stated: StatedUnits, left: Collection[Disagreement]
) -> dict[Cell, tuple[Disagreement, ...]]:
    """Cell with another unit -> what does not agree then."""
    known = [*stated.parameters.values(), *stated.variables.values(), *(s.unit for s in sheet.states.values())]
    scaled = (*map(_thousandth, known), *map(_thousandfold, known))
    pool = _readable((*known, *_COMMON, *scaled, *(other for symbol in known for other in _per_another(symbol))))
    found: dict[Cell, tuple[Disagreement, ...]] = {}
    for each in left:
        for leaf in sorted(each.about, key=lambda leaf: str(leaf.value)):
            for cell in _cells(sheet, stated, leaf, each.apart, pool):
                if cell not in found and len(found) < _MOST:
                    found[cell] = _told(sheet, _with(sheet, stated, cell))
    return found


def _cells(
    sheet: Flowsheet, stated: StatedUnits, leaf: Term, apart: Unit | None, pool: Mapping[str, Unit]
) -> Iterator[Cell]:
    """The cell of a leaf with each unit that differs from its own by what two terms are apart."""
    parameter = leaf.op is Leaf.PARAMETER or str(leaf.value).removesuffix("_now") in sheet.disturbances
    name = str(leaf.value).removesuffix("_now") if parameter else str(leaf.value)
    name = name if parameter or name in sheet.sensors else re.sub("_(sp|err)$", "", name)
    unit = (stated.parameters if parameter else stated.variables).get(name)
    if apart is None or apart.size is None or unit is None or unit not in pool:
        return
    if not parameter and name not in sheet.sensors:
        return
    for power in (1.0, -1.0):
        wanted = pool[unit].times(apart, power)
        if needed := next((symbol for symbol, each in pool.items() if each.agrees(wanted) and symbol != unit), None):
            yield Cell(name, not parameter, unit, needed)


def _with(sheet: Flowsheet, stated: StatedUnits, cell: Cell) -> StatedUnits:
    """``stated`` with the unit that a cell needs, and whatever follows from that cell."""
    if not cell.reading:
        return replace(stated, parameters={**stated.parameters, cell.name: cell.needed})
    shared = {cell.name, f"{cell.name}_sp", f"{cell.name}_err"} & stated.variables.keys()
    errors = [str(each.value) for each in (sheet.sensors[cell.name].bias, sheet.sensors[cell.name].noise)]
    following = [symbol for symbol in errors if stated.parameters.get(symbol) == cell.unit]
    return StatedUnits(
        {**stated.parameters, **dict.fromkeys(following, cell.needed)},
        {**stated.variables, **dict.fromkeys(shared, cell.needed)},
        stated.faults,
    )


def _readable(symbols: Collection[str]) -> dict[str, Unit]:
    """Symbol -> the unit that it is; without those that are none."""
    found = {}
    for symbol in dict.fromkeys(filter(None, symbols)):
        try:
            found[symbol] = read(symbol)
        except UnitError:
            continue
    return found


def _thousandth(symbol: str) -> str:
    """The unit without a kilo in front of it; empty where it has none."""
    return symbol[1:] if re.match(r"k[A-Za-z]", symbol) else ""


def _thousandfold(symbol: str) -> str:
    """The unit with a kilo in front of it; empty where there is something already."""
    return f"k{symbol}" if re.match(r"(J|W|Pa|g|mol|m)\b", symbol) else ""


def _per_another(symbol: str) -> Iterator[str]:
    """The unit with another measure of an amount in place of the one that it has: per litre instead of per kilogram."""
    parts = re.split(f"(?<![A-Za-z])({'|'.join(_AMOUNTS)})(?![A-Za-z0-9])", symbol)
    for place in range(1, len(parts), 2):
        yield from (
            "".join((*parts[:place], other, *parts[place + 1 :])) for other in _AMOUNTS if other != parts[place]
        )
