"""Layered drawing of a graph after Sugiyama, Tagawa and Toda (1981): boxes in layers, links between neighbouring ones.

A link over several layers gets a place of its own in each of those between, so that none crosses a box. Coordinates are
``along`` the layers, in the direction in which the links lead, and ``across`` them [px].
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, TypeAlias

from homeostat.plants.page.layers import (
    AS_FOUND,
    SWEEPS,
    Chain,
    Corrections,
    Link,
    in_order,
    layers,
    neighbours,
    ordered,
    turned,
)  # fmt: skip

_STRAIGHT: Final = 8.0
"""How much more a long link is kept straight than a box is centred between its neighbours [1]."""
_LANE: Final = 6.0
"""Room across for a link that passes a layer [px]."""

Point: TypeAlias = tuple[float, float]
"""Along, across [px]."""


@dataclass(frozen=True, slots=True)
class Box:
    """What is placed."""

    along: float
    """Size along the layers [px]."""
    across: float
    """Size across them [px]."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a box came to stand."""

    along: float
    """Where it begins [px]."""
    across: float
    """Where it begins [px]."""
    box: Box
    """Its size."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Boxes with their places, and the ways of the links."""

    places: Mapping[str, Place]
    """Name -> place."""
    routes: Mapping[Link, tuple[Point, ...]]
    """Link -> points: pairs of one point where it leaves a layer and one where it enters the next."""
    along: float
    """Size of the drawing [px]."""
    across: float
    """Size of the drawing [px]."""


def layered(
    boxes: Mapping[str, Box],
    links: Sequence[Link],
    gap: Point,
    start: str = "",
    corrections: Corrections = AS_FOUND,
) -> Layout:
    """Place ``boxes``; ``gap`` is the least distance between layers, and between boxes of one layer [px].

    Of links that close a circle the later ones lead back, and so does every link to the box ``start``. Links from a box
    to itself, and repeated ones, are left out.
    """
    wanted = [link for link in dict.fromkeys(links) if link[0] != link[1]]
    back = turned(wanted, start)
    forward = [(b, a) if (a, b) in back else (a, b) for a, b in wanted]
    layer = layers(boxes, forward, corrections.later)
    sizes, chains = dict(boxes), []
    for number, (a, b) in enumerate(forward):
        lanes = [f"\0{number} {at}" for at in range(layer[a] + 1, layer[b])]
        layer |= {lane: layer[a] + 1 + at for at, lane in enumerate(lanes)}
        sizes |= dict.fromkeys(lanes, Box(0.0, _LANE))
        chains.append([a, *lanes, b])
    rows = in_order(ordered(layer, chains), corrections.order)
    middle = _aligned(rows, chains, sizes, set(boxes), gap[1])
    return _placed(rows, chains, sizes, middle, (boxes, wanted, back, gap[0]))


def _aligned(
    rows: Sequence[Sequence[str]], chains: Sequence[Chain], sizes: Mapping[str, Box], boxes: set[str], gap: float
) -> dict[str, float]:
    """The middle of each name across its layer: near its neighbours', in order, and ``gap`` apart."""
    before, after = neighbours(chains)
    middle = {name: 0.0 for row in rows for name in row}
    for sweep in range(2 * SWEEPS + 1):
        for row in rows if sweep % 2 == 0 else reversed(rows):
            wish, weight = [], []
            for name in row:
                near = [*before[name], *after[name]] if sweep else before[name]
                pulls = [(_STRAIGHT if {name, x} - boxes else 1.0, middle[x]) for x in near]
                total = sum(pull for pull, _ in pulls)
                wish.append(sum(pull * x for pull, x in pulls) / total if total else middle[name])
                weight.append(max(total, 1.0))
            room = [(sizes[a].across + sizes[b].across) / 2.0 + gap for a, b in pairwise(row)]
            middle |= dict(zip(row, _apart(wish, weight, room), strict=True))
    return middle


def _apart(wish: Sequence[float], weight: Sequence[float], room: Sequence[float]) -> list[float]:
    """Values in order, each at least ``room`` after the one before, nearest to ``wish`` by weighted least squares.

    Less the room that is due, they are the isotonic regression of the wishes: neighbours that violate are pooled.
    """
    due = [sum(room[:i]) for i in range(len(wish))]
    pools: list[tuple[float, float, int]] = []
    for value, heavy in zip((w - d for w, d in zip(wish, due, strict=True)), weight, strict=True):
        pool = (value, heavy, 1)
        while pools and pools[-1][0] > pool[0]:
            mean, mass, count = pools.pop()
            pool = ((mean * mass + pool[0] * pool[1]) / (mass + pool[1]), mass + pool[1], count + pool[2])
        pools.append(pool)
    level = [mean for mean, _, count in pools for _ in range(count)]
    return [value + d for value, d in zip(level, due, strict=True)]


def _placed(
    rows: Sequence[Sequence[str]],
    chains: Sequence[Chain],
    sizes: Mapping[str, Box],
    middle: Mapping[str, float],
    drawn: tuple[Mapping[str, Box], Sequence[Link], set[Link], float],
) -> Layout:
    """Everything at its place; the drawing begins at 0, 0."""
    boxes, links, back, gap = drawn
    top = min((middle[n] - sizes[n].across / 2.0 for row in rows for n in row), default=0.0)
    ends: list[Point] = []
    begin = 0.0
    for row in rows:
        wide = max(sizes[name].along for name in row)
        ends.append((begin, begin + wide))
        begin += wide + gap
    layer = {name: at for at, row in enumerate(rows) for name in row}
    places = {}
    for name, box in boxes.items():
        first, last = ends[layer[name]]
        places[name] = Place((first + last - box.along) / 2.0, middle[name] - box.across / 2.0 - top, box)
    ports = _ports(chains, middle, places)
    routes = {}
    for number, (link, chain) in enumerate(zip(links, chains, strict=True)):
        begins, stops = places[chain[0]], places[chain[-1]]
        at = [ports[number, True], *(middle[lane] - top for lane in chain[1:-1]), ports[number, False]]
        points = [(begins.along + begins.box.along, at[0])]
        for a, b, here, there in zip(chain, chain[1:], at, at[1:], strict=False):
            points += [(ends[layer[a]][1], here), (ends[layer[b]][0], there)]
        points.append((stops.along, at[-1]))
        routes[link] = tuple(reversed(points)) if link in back else tuple(points)
    across = max((middle[n] + sizes[n].across / 2.0 - top for row in rows for n in row), default=0.0)
    return Layout(places, routes, ends[-1][1] if ends else 0.0, across)


def _ports(
    chains: Sequence[Chain], middle: Mapping[str, float], places: Mapping[str, Place]
) -> dict[tuple[int, bool], float]:
    """Number of a chain, and whether its begin is meant -> where it meets its box, across.

    Links of one side are spread over it in the order of where they lead.
    """
    sides: dict[tuple[str, bool], list[tuple[float, int]]] = defaultdict(list)
    for number, chain in enumerate(chains):
        sides[chain[0], True].append((middle[chain[1]], number))
        sides[chain[-1], False].append((middle[chain[-2]], number))
    return {
        (number, begins): places[name].across + places[name].box.across * at / (len(others) + 1)
        for (name, begins), others in sides.items()
        for at, (_, number) in enumerate(sorted(others), start=1)
    }
