"""Which layer each box of a drawing is in, and in which order those of one layer stand, with few crossings."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final, TypeAlias

SWEEPS: Final = 12
"""How often the layers are put in order, and how often they are aligned, in either direction."""
Link: TypeAlias = tuple[str, str]
"""From one box to another."""
Chain: TypeAlias = "list[str]"
"""A link as the names at its ends and its places in the layers between."""


@dataclass(frozen=True, slots=True)
class Corrections:
    """What somebody who looked at a drawing would have otherwise: still no box overlaps, and no link crosses one."""

    later: Mapping[str, int] = field(default_factory=dict)
    """Box -> by how many layers it stands further on, and whatever follows it."""
    order: tuple[str, ...] = ()
    """Boxes in the order in which they stand wherever they share a layer."""


AS_FOUND: Final = Corrections()
"""Nothing is corrected."""


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


def layers(boxes: Iterable[str], links: Sequence[Link], later: Mapping[str, int]) -> dict[str, int]:
    """The layer of each box: as early as its links allow, and what only gives close to what takes it.

    Those in ``later`` stand by so many further on.
    """
    layer = {name: later.get(name, 0) for name in boxes}
    for _ in boxes:
        for a, b in links:
            layer[b] = max(layer[b], layer[a] + 1 + later.get(b, 0))
    takers = {b for _, b in links}
    for name in boxes:
        after = [layer[b] for a, b in links if a == name]
        if after and name not in takers and name not in later:
            layer[name] = min(after) - 1
    taken = {at: number for number, at in enumerate(sorted(set(layer.values())))}
    return {name: taken[at] for name, at in layer.items()}


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


def in_order(rows: Sequence[Sequence[str]], wanted: Sequence[str]) -> list[list[str]]:
    """``rows``, in each of which those of ``wanted`` take one another's places so that they stand in that order."""
    made = []
    for row in rows:
        named = iter([name for name in wanted if name in row])
        made.append([next(named) if name in wanted else name for name in row])
    return made


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
