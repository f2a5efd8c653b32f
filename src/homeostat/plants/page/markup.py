"""HTML and SVG by construction: whatever is not markup already is escaped, and everything that is opened is closed."""

from html import escape
from typing import TypeAlias

from homeostat.domain.quotation import printable


class Markup(str):
    """Text that is HTML already; joined to another text it is none any more."""

    __slots__ = ()


Child: TypeAlias = "str | Markup | list[Markup]"


def element(_name: str, *children: Child, **attributes: str | float | None) -> Markup:
    """``<name attributes>children</name>``, well-formed as XML as well; an attribute that is None is left out.

    A trailing underscore of an attribute's name is dropped and others become hyphens: ``class_``, ``aria_label``.

    >>> element("td", "T1 <= 313", class_="n")
    '<td class="n">T1 &lt;= 313</td>'
    """
    said = "".join(f' {_named(name)}="{_attribute(value)}"' for name, value in attributes.items() if value is not None)
    inside = "".join(map(_inside, children))
    return Markup(f"<{_name}{said}>{inside}</{_name}>" if inside or _name not in _EMPTY else f"<{_name}{said}/>")


def together(parts: list[Markup]) -> Markup:
    """The ``parts``, one after the other."""
    return Markup("\n".join(parts))


_EMPTY = frozenset({"meta", "rect", "path", "circle", "polygon", "line", "br"})
"""Elements that never hold anything."""


def _inside(child: Child) -> str:
    if isinstance(child, list):
        return "".join(child)
    return child if isinstance(child, Markup) else escape(printable(child), quote=False)


def _attribute(value: str | float) -> str:
    return escape(printable(value)) if isinstance(value, str) else f"{value:.6g}"


def _named(name: str) -> str:
    return name.rstrip("_").replace("_", "-")
