"""Nothing but the gate commands a plant: read from the sources, and watched at run time."""

from __future__ import annotations

import ast
import asyncio
import sys
from collections.abc import Iterator
from pathlib import Path

import homeostat
from homeostat.campaign.scenario import scenario
from homeostat.campaign.unattended import build_plant
from homeostat.cases.case import Case, load_case
from homeostat.cases.wiring import new_sequencer, wire
from homeostat.domain.guard_events import FellBack
from homeostat.domain.ports import Plant
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.links.clock import DeclaredClock
from homeostat.trace import MemoryTrace
from homeostat.trace.decisions import ReleasedActions

SOURCES = Path(homeostat.__file__).parent
GATE = "guard/gate.py"
BUILDS_PLANTS = ("plant/", "campaign/", "cases/learn_baselines.py", "__main__.py", "console/", "cli/")
"""Where a simulated plant may be made: outside everything that takes part in a recovery."""


def modules() -> Iterator[tuple[str, ast.Module]]:
    for path in sorted(SOURCES.rglob("*.py")):
        yield path.relative_to(SOURCES).as_posix(), ast.parse(path.read_text(encoding="utf-8"))


def plant_writes(tree: ast.AST) -> list[int]:
    """Lines that may command a plant: ``write`` of something named like a plant, or any awaited ``write``."""
    lines = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr == "write" and "plant" in ast.unparse(node.value).lower():
            lines.append(node.lineno)
        if isinstance(node, ast.Await) and isinstance(node.value, ast.Call):
            function = node.value.func
            if isinstance(function, ast.Attribute) and function.attr == "write":
                lines.append(node.lineno)
        if isinstance(node, ast.Call) and any(isinstance(a, ast.Constant) and a.value == "write" for a in node.args):
            lines.append(node.lineno)
    return sorted(set(lines))


def without_forwarding(tree: ast.Module) -> ast.Module:
    """The module without ``write`` methods: a plant in front of another plant hands commands on in its own."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            node.body = [b for b in node.body if not (isinstance(b, ast.AsyncFunctionDef) and b.name == "write")] or [
                ast.Pass()
            ]
    return tree


def test_the_search_finds_every_way_to_write() -> None:
    caught = """
async def f(plant, x):
    await x.write(())
    await self._plant.write(())
    asyncio.run(plant.write(()))
    send = plant.write
    getattr(x, "write")(())
    file.write("text")
    await x.read()
"""
    assert plant_writes(ast.parse(caught)) == [3, 4, 5, 6, 7]


def test_only_the_gate_writes_to_a_plant() -> None:
    found = {name: plant_writes(without_forwarding(tree)) for name, tree in modules()}
    assert len(found[GATE]) == 2, "one release, one fallback"
    assert {name: lines for name, lines in found.items() if lines and name != GATE} == {}


def test_only_plants_forward_commands() -> None:
    """A ``write`` method that hands commands on belongs to a plant: it has the other methods of the port, too."""
    for name, tree in modules():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                methods = {b.name for b in node.body if isinstance(b, ast.FunctionDef | ast.AsyncFunctionDef)}
                forwards = [b for b in node.body if getattr(b, "name", "") == "write" and plant_writes(b)]
                assert not forwards or {"snapshots", "since"} <= methods, f"{name}: {node.name}"
                assert not forwards or name.startswith(("plant/", "campaign/")), f"{name}: {node.name}"


def test_nobody_who_takes_part_in_a_recovery_knows_the_simulated_plant() -> None:
    for name, tree in modules():
        imports = [
            alias.name if isinstance(node, ast.Import) else f"{node.module}.{alias.name}"
            for node in ast.walk(tree)
            if isinstance(node, ast.Import | ast.ImportFrom)
            for alias in node.names
        ]
        knows = [i for i in imports if "plant.simulated" in i or i.endswith("SimulatedPlant")]
        assert not knows or name.startswith(BUILDS_PLANTS), f"{name} imports {knows}"


class RecordingPlant:
    """Implements the plant's port in front of a simulated one and notes every command with its caller."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self.written: list[tuple[Command, ...]] = []
        self.callers: list[str] = []

    async def snapshots(self):  # type: ignore[no-untyped-def]
        async for snapshot in self._plant.snapshots():
            yield snapshot

    async def since(self, at_s: float) -> tuple[Snapshot, ...]:
        return await self._plant.since(at_s)

    async def write(self, commands: tuple[Command, ...]) -> None:
        self.callers.append(Path(sys._getframe(1).f_code.co_filename).relative_to(SOURCES).as_posix())
        self.written.append(commands)
        await self._plant.write(commands)


def watched_run(case: Case, fault: str) -> tuple[RecordingPlant, MemoryTrace]:
    clock, trace = DeclaredClock(1.0), MemoryTrace()
    short = scenario(case, fault, 3, onset_s=None if fault == "none" else 1450.0, end_s=1600.0)
    sequencer = new_sequencer(case)
    plant = RecordingPlant(build_plant(case, short, clock, sequencer))
    asyncio.run(wire(case, plant, sequencer, clock, trace, seed=3).supervise())
    return plant, trace


def test_at_run_time_every_command_comes_from_the_gate_and_stands_in_the_trace() -> None:
    plant, trace = watched_run(load_case("cstr"), "pump_degrade")
    decided = [
        e.commands for e in (entry.event for entry in trace.entries) if isinstance(e, ReleasedActions | FellBack)
    ]
    assert plant.written == decided and len(decided) >= 1
    assert set(plant.callers) == {GATE}


def test_a_healthy_plant_is_never_commanded() -> None:
    plant, trace = watched_run(load_case("cstr"), "none")
    assert plant.written == [] and trace.of(ReleasedActions) == ()
