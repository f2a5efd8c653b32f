"""Generic code knows no plant: no tag, fault, state, parameter or strategy of any stands in it, nor how they are spelt.

Searched are names and string constants of every module outside the plants' own folders, for what the plants' graphs,
models and settings name. Not counted are:

- names that are one plain word, like the state ``held`` or the fault ``leak``: they are English, and generic code has
  its own use for them. They do count where something is compared with them or looked up by them.
- names of at most two characters, like the tag ``T1`` or the transition ``t0``, but for whole strings: they are
  variables and formats, too. A single letter never counts.
- docstrings: examples show what a tag looks like.

So that no rule can be made of how a plant spells its names, an ending that several of them share (``_man``, ``.sp``)
counts as a whole string as well.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

import homeostat
from homeostat.plants.files.places import plant_names
from homeostat.plants.plant import Plant, load_plant

SOURCES = Path(homeostat.__file__).parent
PLAIN = re.compile(r"[a-z]+")
SHORT = 2
"""Longest name that counts as a whole string only, in characters."""
TOKEN = re.compile(r"\w+(?:[.-]\w+)*")
ENDING = re.compile(r"[._][A-Za-z]+$")


def names_of(plant: Plant) -> Iterator[str]:
    """Everything that one plant has a name for."""
    d, model = plant.description, plant.model
    yield from (*model.variables, *model.inputs, *model.states, *model.parameters, *model.faults)
    yield from (*plant.totals, *plant.totals.values(), *plant.delivered)
    parts = (d.tags, d.faults, d.machine.states, d.machine.transitions, d.fallback_strategies, d.components, d.loops)
    yield from (thing.name for part in (*parts, d.limits.limits, d.features, d.symptom_rules) for thing in part)
    yield from (p.symbol for p in d.parameters)
    yield from (t.event for t in d.machine.transitions)


@dataclass(frozen=True, slots=True)
class Search:
    """What is looked for."""

    names: frozenset[str]
    """What plants name, single letters left out."""
    endings: frozenset[str]
    """What several of the names end with."""

    @classmethod
    def of(cls, names: set[str]) -> Search:
        """The search for ``names``."""
        endings = Counter(m.group() for name in names if (m := ENDING.search(name)))
        return cls(
            frozenset(n for n in names if len(n) > 1),
            frozenset(e for e, n in endings.items() if n > 1 and len(e) > SHORT),
        )

    def found(self, tree: ast.Module) -> list[str]:
        """What stands in ``tree``, each as its line and what it is."""
        ignored = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr)}  # docstrings
        asked = {id(c) for n in ast.walk(tree) for c in asked_for(n)}
        lines: set[tuple[int, str]] = set()
        for node in ast.walk(tree):
            line = getattr(node, "lineno", 0)
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in ignored:
                lines |= {(line, hit) for hit in self._in_text(node.value, id(node) in asked)}
            for field in ("id", "attr", "arg", "name"):
                name = getattr(node, field, None)
                if isinstance(name, str) and self._marked(name):
                    lines.add((line, name))
        return [f"{line}: {hit}" for line, hit in sorted(lines)]

    def _in_text(self, text: str, asked: bool) -> Iterator[str]:
        if text in self.endings or (text in self.names and (asked or not PLAIN.fullmatch(text))):
            yield text
        yield from filter(self._marked, TOKEN.findall(text))

    def _marked(self, name: str) -> bool:
        return name in self.names and len(name) > SHORT and not PLAIN.fullmatch(name)


def asked_for(node: ast.AST) -> Iterator[ast.AST]:
    """What ``node`` compares with, or looks up."""
    match node:
        case ast.Compare():
            for side in (node.left, *node.comparators):
                yield from ast.walk(side)
        case ast.Subscript():
            yield node.slice
        case ast.Call(func=ast.Attribute(attr="get" | "index" | "startswith" | "endswith")):
            yield from node.args
        case ast.MatchValue():
            yield node.value


@pytest.fixture(scope="module")
def search() -> Search:
    return Search.of({name for plant in plant_names() for name in names_of(load_plant(plant, learned=False))})


def test_the_search_finds_what_it_is_for() -> None:
    search = Search.of({"T1", "V1_man", "V2_man", "T1.sp", "L1.sp", "held", "spilled_L", "V", "LIM-T-HIGH"})
    caught = '''
"""As in T1.sp."""
a = b if name.endswith("_man") else name.replace(".sp", "")
c = row.spilled_L + totals["T1"]
def f(spilled_L): return f"see LIM-T-HIGH: {a}", state == "held"
'''
    assert search.found(ast.parse(caught)) == ["3: .sp", "3: _man", "4: T1", "4: spilled_L", "5: LIM-T-HIGH", "5: held",
                                               "5: spilled_L"]  # fmt: skip
    spared = """
T1 = V = "held"
usepackage = "[T1]{fontenc}"
"""
    assert search.found(ast.parse(spared)) == []


def test_every_plant_is_looked_for(search: Search) -> None:
    assert {
        "T1.sp",
        "V2_man",
        "fault_diagnosed",
        "temp_bias",
        "B201.level",
        "spilled_L",
        "stuck_open_VI202",
    } <= search.names
    assert {"_man", "_cmd", ".sp"} <= search.endings


NAMING = ("knowledge/build/derived", "process/blocks")
"""Rooms that call things by endings and defaults of their own, which plants may follow: they name no plant."""


def names_itself(path: str, hit: str) -> bool:
    """Whether ``hit`` is how a room of `NAMING` calls what follows from a part."""
    word = hit.partition(": ")[2]
    return path.startswith(NAMING) and (word[0] in "._" or word == "fault_diagnosed")


def test_generic_code_names_no_plant(search: Search) -> None:
    plants = [SOURCES / "plants" / name for name in (*plant_names(), "scaffolds")]  # plants to begin with are plants
    generic = [path for path in sorted(SOURCES.rglob("*.py")) if not any(map(path.is_relative_to, plants))]
    assert len(generic) > 100
    found = {path.relative_to(SOURCES).as_posix(): search.found(ast.parse(path.read_bytes())) for path in generic}
    found = {name: [hit for hit in lines if not names_itself(name, hit)] for name, lines in found.items()}
    assert {name: lines for name, lines in found.items() if lines} == {}
