"""Nothing but the guard's writer commands a plant: read from the sources, and measured inside the plant."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import homeostat
from homeostat.domain.events.writes import WriteIntended
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import scenario
from homeostat.guard.settings import GuardSettings
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.links.simulated import SimulatedLink
from homeostat.plants.plant import load_plant
from homeostat.plants.wired.assembly import Arrangement, wire

SOURCES = Path(homeostat.__file__).parent
WRITER = "guard/writing/writer.py"
PASSES_ON = "guard/writing/bounded.py"
"""The writer's wire over a link that may block: what it is given to send, it sends in a thread of its own."""
MAKES_PLANTS = ("links/", "evaluate/", "plants/teaching/learning.py", "cli/")
"""Where a simulated plant may be made: outside everything that takes part in a recovery."""


def modules() -> Iterator[tuple[str, ast.Module]]:
    for path in sorted(SOURCES.rglob("*.py")):
        yield path.relative_to(SOURCES).as_posix(), ast.parse(path.read_text(encoding="utf-8"))


def sends(tree: ast.AST) -> list[int]:
    """Lines that may command a plant: ``send`` of something named like a wire, or ``send`` looked up by its name."""
    lines = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr == "send" and "wire" in ast.unparse(node.value).lower():
            lines.append(node.lineno)
        if isinstance(node, ast.Call) and any(isinstance(a, ast.Constant) and a.value == "send" for a in node.args):
            lines.append(node.lineno)
    return sorted(set(lines))


def test_the_search_finds_every_way_to_send() -> None:
    caught = """
def f(wire, x):
    wire.send(())
    self._wire.send(())
    send = wire.send
    getattr(x, "send")(())
    x.read()
"""
    assert sends(ast.parse(caught)) == [3, 4, 5, 6]


def test_only_the_writer_sends() -> None:
    found = {name: sends(tree) for name, tree in modules() if not name.startswith("links/")}
    assert found[WRITER], "the writer sends"
    assert {name: lines for name, lines in found.items() if lines and name not in (WRITER, PASSES_ON)} == {}
    bounded = next(tree for name, tree in modules() if name == PASSES_ON)
    passed = [sends(n) for n in ast.walk(bounded) if isinstance(n, ast.FunctionDef) and n.name == "send"]
    assert passed == [found[PASSES_ON]], "it sends only what it was told to send"


def test_nobody_who_takes_part_in_a_recovery_knows_a_simulated_plant() -> None:
    for name, tree in modules():
        imports = [
            alias.name if isinstance(node, ast.Import) else f"{node.module}.{alias.name}"
            for node in ast.walk(tree)
            if isinstance(node, ast.Import | ast.ImportFrom)
            for alias in node.names
        ]
        knows = [i for i in imports if "homeostat.links.simulated" in i or "homeostat.links.truth" in i]
        assert not knows or name.startswith(MAKES_PLANTS), f"{name} imports {knows}"


@pytest.mark.parametrize(
    ("plant", "fault", "onset_s", "end_s"),
    [
        ("mixing_module", "none", None, 420.0),
        ("mixing_module", "pump_failure", 100.0, 420.0),
        pytest.param("cstr", "pump_degrade", 1450.0, 1700.0, marks=pytest.mark.wide),
    ],
)
def test_what_arrives_on_the_wire_is_what_the_journal_intends_one_for_one(
    plant: str, fault: str, onset_s: float | None, end_s: float
) -> None:
    case = load_plant(plant)
    process = open_process(case, scenario(case, fault, 3, onset_s=onset_s, end_s=end_s))
    link, trace = SimulatedLink(process), MemoryTrace()
    wire(case, link, DeclaredClock(1.0), trace, 3, Arrangement(guard=GuardSettings(sync_s=10.0))).run(link.source)
    intended = [(e.at_s, e.event.commands) for e in trace.entries if isinstance(e.event, WriteIntended)]
    assert [(a.at_s, a.commands) for a in link.wire_log] == intended
    assert len(intended) >= 1
