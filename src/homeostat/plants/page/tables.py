"""Tables of the page, and how numbers and units stand in them."""

from collections.abc import Iterable, Sequence
from typing import TypeAlias

from homeostat.plants.page.markup import Markup, element

Cell: TypeAlias = "str | Sequence[str]"
"""A text or markup, or several that stand in lines of their own."""
NOTHING = "–"
"""Stands where there is nothing to say."""


def table(name: str, title: str, columns: Sequence[str], rows: Iterable[Sequence[Cell]], note: str = "") -> Markup:
    """A table under a heading; the first cell of a row names it. ``name`` is unique on the page."""
    body = [_row(cells) for cells in rows]
    heading = element("h3", title, id=f"{name}-heading")
    above = [heading] + ([element("p", note, class_="note")] if note else [])
    if not body:
        return element("section", above, element("p", "There are none.", class_="note"), id=name)
    head = element("tr", [element("th", column, scope="col") for column in columns])
    whole = element("table", element("thead", head), element("tbody", body))
    framed = element("div", whole, class_="scroll", tabindex="0", role="region", aria_labelledby=f"{name}-heading")
    return element("section", above, framed, id=name)


def code(text: str) -> Markup:
    """A formula or an expression."""
    return element("code", text)


def severe(text: str) -> Markup:
    """What must never be violated."""
    return element("strong", text, class_="hard")


def number(value: float | None) -> str:
    """A number as people write it, or that there is none."""
    return NOTHING if value is None else f"{value:.6g}"


def quantity(value: float | None, unit: str, per: str = "") -> str:
    """A number with its unit, such as ``0.5 K/s`` with ``/s`` as ``per``; a fraction has none."""
    if value is None:
        return NOTHING
    return f"{number(value)} {(_unit(unit) + per).strip()}".rstrip()


def span(low: float, high: float, unit: str) -> str:
    """From a number to another one, with their unit."""
    return f"{number(low)} to {number(high)} {_unit(unit)}".rstrip()


def joined(texts: Iterable[str]) -> str:
    """Texts after one another, or that there are none."""
    return ", ".join(texts) or NOTHING


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit


def _row(cells: Sequence[Cell]) -> Markup:
    first, *others = map(_lines, cells)
    return element("tr", element("th", first, scope="row"), [element("td", cell) for cell in others])


def _lines(cell: Cell) -> list[Markup]:
    """The lines of a cell."""
    if isinstance(cell, str):
        return [cell if isinstance(cell, Markup) else element("span", cell)]
    return [element("div", line) for line in cell] or [element("span", NOTHING)]
