"""Which layer each box of a drawing is in, and in which order those of one layer stand, with few crossings."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Final, TypeAlias

SWEEPS: Final = 12
"""How often the layers are put in order, and how often they are aligned, in either direction."""
Link: TypeAlias = tuple[str, str]
"""From one box to another."""
Chain: TypeAlias = "list[str]"
"""A link as the names at its ends and its places in the layers between."""


def turned(links: Sequence[Link], start: str) -> set[Link]:
    """Links to ``start``, and those that would close a circle with the ones before them."""
    after: dict[str, set[str]] = defaultdict(set)
    back = set()
    for a, b in sorted(links, key=lambda link: link[1] != start):
        seen, found = {b}, [b]
        while found:
            more = after[found.pop()] - seen
            seen |= more
            found += more
        if a in seen or b == start:
            back.add((a, b))
            a, b = b, a
        after[a].add(b)
    return back


def layers(boxes: Iterable[str], links: Sequence[Link]) -> dict[str, int]:
    """The layer of each box: as early as its links allow, and what only gives close to what takes it."""
    layer = dict.fromkeys(boxes, 0)
    for _ in boxes:
        for a, b in links:
            layer[b] = max(layer[b], layer[a] + 1)
    takers = {b for _, b in links}
    for name in boxes:
        later = [layer[b] for a, b in links if a == name]
        if later and name not in takers:
            layer[name] = min(later) - 1
    first = min(layer.values(), default=0)
    return {name: at - first for name, at in layer.items()}


def ordered(layer: Mapping[str, int], chains: Sequence[Chain]) -> list[list[str]]:
    """The names of each layer in an order with few crossings, by the means of their neighbours' places."""
    rows: list[list[str]] = [[] for _ in range(max(layer.values(), default=-1) + 1)]
    for name, at in layer.items():
        rows[at].append(name)
    before, after = neighbours(chains)
    best, fewest = [list(row) for row in rows], _crossings(rows, after)
    for sweep in range(2 * SWEEPS):
        down = sweep % 2 == 0
        for at in range(len(rows)) if down else reversed(range(len(rows))):
            places = {name: float(i) for row in rows for i, name in enumerate(row)}
            near = before if down else after
            means = {n: sum(places[x] for x in near[n]) / len(near[n]) if near[n] else places[n] for n in rows[at]}
            rows[at].sort(key=lambda name: means[name])
        if (count := _crossings(rows, after)) < fewest:
            best, fewest = [list(row) for row in rows], count
    return best


def neighbours(chains: Sequence[Chain]) -> tuple[Mapping[str, list[str]], Mapping[str, list[str]]]:
    """Name -> what is next to it in the layer before, and in the one after."""
    before, after = defaultdict(list), defaultdict(list)
    for chain in chains:
        for a, b in pairwise(chain):
            after[a].append(b)
            before[b].append(a)
    return before, after


def _crossings(rows: Sequence[Sequence[str]], after: Mapping[str, Sequence[str]]) -> int:
    places = {name: i for row in rows for i, name in enumerate(row)}
    total = 0
    for row in rows:
        ends = [(places[a], places[b]) for a in row for b in after[a]]
        total += sum((a < c and b > d) or (a > c and b < d) for i, (a, b) in enumerate(ends) for c, d in ends[:i])
    return total
