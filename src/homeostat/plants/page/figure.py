"""A drawing in SVG: boxes of text in layers, joined by arrows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Final

from homeostat.plants.page.layered import Box, Layout, Place, Point, layered
from homeostat.plants.page.layers import AS_FOUND, Corrections
from homeostat.plants.page.lettering import broken, width
from homeostat.plants.page.markup import Markup, element, together

TITLE_PX: Final = 13.0
"""Size of the first lines of a box [px]."""
TEXT_PX: Final = 12.0
"""Size of its other lines [px]."""
_MOST_PX: Final = 140.0
"""Widest line [px]."""
_LINE_PX: Final = 17.0
_PAD: Final = 9.0
_ICON: Final = 17.0
_MARGIN: Final = 10.0
_SHORT: Final = 0.1
"""What is shorter has no direction, and a head after it would point anywhere [px]."""
_LEAST: Final = 0.8
"""Least size at which a drawing is shown; where there is less room it is moved [1]."""
_BOLD: Final = 1.16
"""How much wider bold letters are [1]."""
_BUBBLE: Final = 14.0
"""Room that the outline of a bubble takes beside its text [px]."""


class Direction(StrEnum):
    """Where the arrows lead."""

    RIGHT = "right"
    DOWN = "down"


@dataclass(frozen=True, slots=True)
class Line:
    """One line of a box."""

    text: str
    """The text."""
    bubble: str = ""
    """What stands before it in a bubble, as instruments do in a flowsheet (ISA-5.1)."""
    title: bool = False
    """Whether it is in large letters."""

    @property
    def size(self) -> float:
        """Size of its letters [px]."""
        return TITLE_PX if self.title else TEXT_PX

    @property
    def width(self) -> float:
        """Its width [px]."""
        before = width(self.bubble, TEXT_PX) + _BUBBLE + 5.0 if self.bubble else 0.0
        return before + width(self.text, self.size) * (_BOLD if self.title else 1.0)


@dataclass(frozen=True, slots=True)
class Shape:
    """A box with text."""

    kind: str
    """Class in the style sheet."""
    lines: tuple[Line, ...]
    """What stands in it."""
    tip: str
    """What is shown when somebody points at it."""
    icon: str = ""
    """Symbol before the first line: `circle`, `rhombus` or `hexagon` (VDI 3682), `initial` (UML); empty for none."""

    @property
    def width(self) -> float:
        """Its width [px]."""
        icon = _ICON if self.icon else 0.0
        widths = [line.width + (icon if at == 0 else 0.0) for at, line in enumerate(self.lines)]
        return max(widths, default=0.0) + 2 * _PAD

    @property
    def height(self) -> float:
        """Its height [px]."""
        return _LINE_PX * len(self.lines) + 2 * _PAD - 4.0


@dataclass(frozen=True, slots=True)
class Arrow:
    """A line with a head."""

    source: str
    """Name of the shape that it leaves."""
    target: str
    """Name of the shape that it enters."""
    kind: str
    """Class in the style sheet."""
    tip: str
    """What is shown when somebody points at it."""


def lines(text: str, title: bool = False, rows: int = 3) -> tuple[Line, ...]:
    """``text`` as lines of a box."""
    size = _BOLD * TITLE_PX if title else TEXT_PX
    return tuple(Line(part, title=title) for part in broken(text, size, _MOST_PX, rows))


def arranged(
    shapes: Mapping[str, Shape], arrows: Sequence[Arrow], direction: Direction, corrections: Corrections = AS_FOUND
) -> Layout:
    """Where everything stands, in layers that follow one another in ``direction``: first what the machine starts in."""
    down = direction is Direction.DOWN
    boxes = {n: Box(s.height, s.width) if down else Box(s.width, s.height) for n, s in shapes.items()}
    start = next((name for name, shape in shapes.items() if shape.icon == "initial"), "")
    links, gap = [(a.source, a.target) for a in arrows], (40.0, 18.0) if down else (44.0, 16.0)
    return layered(boxes, links, gap, start, corrections)


def drawing(
    name: str,
    words: tuple[str, str],
    shapes: Mapping[str, Shape],
    arrows: Sequence[Arrow],
    direction: Direction,
    corrections: Corrections = AS_FOUND,
) -> Markup:
    """The drawing as an SVG element called ``name``; ``words`` are its title, and what it shows in some sentences."""
    layout = arranged(shapes, arrows, direction, corrections)
    down = direction is Direction.DOWN
    wide, high = (layout.across, layout.along) if down else (layout.along, layout.across)
    wide, high = wide + 2 * _MARGIN, high + 2 * _MARGIN
    parts = [
        element("title", words[0], id=f"{name}-title"),
        element("desc", words[1], id=f"{name}-desc"),
        element("defs", [_head(name, kind) for kind in sorted({arrow.kind for arrow in arrows})]),
    ]
    for arrow in arrows:
        if arrow.source != arrow.target:
            points = [_turned(point, down) for point in layout.routes[arrow.source, arrow.target]]
            way = element("path", d=_way(points, down), marker_end=f"url(#{name}-{arrow.kind})")
            parts.append(element("g", element("title", arrow.tip), way, class_=f"arrow {arrow.kind}"))
    parts += [_drawn(shapes[n], _corner(place, down)) for n, place in layout.places.items()]
    return element(
        "svg",
        together(parts),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {wide:.0f} {high:.0f}",
        width=f"{wide:.0f}",
        height=f"{high:.0f}",
        style=f"min-width: {_LEAST * wide:.0f}px",
        role="img",
        aria_labelledby=f"{name}-title {name}-desc",
        class_="figure",
    )


def _turned(point: Point, down: bool) -> Point:
    """Across and along as x and y, or along and across."""
    along, across = point
    return (across + _MARGIN, along + _MARGIN) if down else (along + _MARGIN, across + _MARGIN)


def _corner(place: Place, down: bool) -> Point:
    return _turned((place.along, place.across), down)


def _way(points: Sequence[Point], down: bool) -> str:
    """Straight through the layers, and curved between them."""
    said = [f"M{points[0][0]:.1f} {points[0][1]:.1f}"]
    for at, ((x, y), (to_x, to_y)) in enumerate(pairwise(points)):
        end = f"{to_x:.1f} {to_y:.1f}"
        if at % 2 == 0:
            said += [f"L{end}"] if abs(to_x - x) + abs(to_y - y) > _SHORT else []
        elif down:
            said.append(f"C{x:.1f} {(y + to_y) / 2:.1f} {to_x:.1f} {(y + to_y) / 2:.1f} {end}")
        else:
            said.append(f"C{(x + to_x) / 2:.1f} {y:.1f} {(x + to_x) / 2:.1f} {to_y:.1f} {end}")
    return "".join(said)


def _head(name: str, kind: str) -> Markup:
    """The head of an arrow of one kind."""
    return element(
        "marker",
        element("path", d="M0 0L8 4L0 8Z", class_=f"head {kind}"),
        id=f"{name}-{kind}",
        viewBox="0 0 8 8",
        refX="8",
        refY="4",
        markerWidth="8",
        markerHeight="8",
        markerUnits="userSpaceOnUse",
        orient="auto",
    )


def _drawn(shape: Shape, corner: Point) -> Markup:
    x, y = corner
    parts = [element("title", shape.tip)]
    parts.append(element("rect", x=x, y=y, width=shape.width, height=shape.height, rx=_rounded(shape), class_="box"))
    base = y + _PAD + TITLE_PX - 3.0
    for at, line in enumerate(shape.lines):
        left = x + _PAD
        if at == 0 and shape.icon:
            parts.append(_icon(shape.icon, (left + 6.0, base - 4.5)))
            left += _ICON
        parts += _lettered(line, (left, base + at * _LINE_PX))
    return element("g", parts, class_=f"shape {shape.kind}")


def _rounded(shape: Shape) -> float:
    return {"operator": 0.0, "control": 0.0}.get(shape.kind.split()[0], 8.0)


def _lettered(line: Line, at: Point) -> list[Markup]:
    left, base = at
    parts = []
    if line.bubble:
        inside = width(line.bubble, TEXT_PX) + _BUBBLE
        outline = {"x": left, "y": base - 11.5, "width": inside, "height": 15.0, "rx": 7.5}
        parts.append(element("rect", class_="bubble", **outline))
        parts.append(element("text", line.bubble, x=left + inside / 2.0, y=base, text_anchor="middle"))
        left += inside + 5.0
    parts.append(element("text", line.text, x=left, y=base, class_="title" if line.title else None))
    return parts


def _icon(kind: str, at: Point) -> Markup:
    x, y = at
    if kind in ("circle", "initial"):
        return element("circle", cx=x, cy=y, r=5.0, class_=f"icon {kind}")
    corners = {
        "rhombus": [(x - 6, y), (x, y - 6), (x + 6, y), (x, y + 6)],
        "hexagon": [(x - 6, y), (x - 3, y - 5), (x + 3, y - 5), (x + 6, y), (x + 3, y + 5), (x - 3, y + 5)],
    }[kind]
    return element("polygon", points=" ".join(f"{a:.1f},{b:.1f}" for a, b in corners), class_="icon")
