"""A look at a recorded run: monitoring and twin see what the plant showed, and say what they hold to be wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import replace
from typing import TypeAlias

from benchmarks.unknown.causes import balance_of
from benchmarks.unknown.judge import NONE, UNKNOWN, Statement
from benchmarks.unknown.recorder import Recording
from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.monitoring.monitoring import TwinMonitoring
from homeostat.domain.diagnosis import FaultMode, Hypothesis, by_fault_set
from homeostat.journal.beside.archive import MemoryArchive
from homeostat.plants.plant import Plant
from homeostat.twin.twin import Twin

QUANTITIES = ("heat", "mass")
"""What is balanced."""
Look: TypeAlias = Callable[[Plant, Twin, TwinMonitoring], list[Statement]]
"""Says what is wrong as of the last snapshot."""


def look(plant: Plant, twin: Twin, monitoring: TwinMonitoring) -> list[Statement]:
    """What monitoring says is wrong as of the last snapshot."""
    return said(plant, monitoring.diagnose().hypotheses)


def said(plant: Plant, hypotheses: Sequence[Hypothesis]) -> list[Statement]:
    """What a diagnosis says, each set of faults once, the most probable first.

    With :func:`look` the one place that knows what a diagnosis is made of.
    """
    description = plant.description
    modes: Sequence[FaultMode] = getattr(description, "fault_modes", description.faults)
    components = {mode.name: mode.component for mode in modes}
    found = []
    for one in by_fault_set(hypotheses):
        about = "+".join(components[f.fault] for f in one.faults)
        alone = one.faults[0] if len(one.faults) == 1 else None
        balance = balance_said(plant.name, alone.fault, about) if alone else ""
        severity = alone.severity if alone else None
        name = one.name if one.faults else NONE
        found.append(Statement(name, about, balance, one.probability, severity, one.between))
    return found


def balance_said(plant: str, fault: str, component: str) -> str:
    """The balance that a fault is about; of an unknown one its name says so, as in 'unknown_heat_R1'."""
    words = fault.split("_")
    if words[0] == UNKNOWN:
        return f"{words[1]} {component}" if words[1] in QUANTITIES else ""
    return balance_of(plant, fault)


def monitored(plant: Plant, seed: int) -> tuple[Twin, TwinMonitoring]:
    """A twin and the monitoring of it, as a run has them; it does not wait for more evidence when it is asked."""
    d = plant.description
    twin = Twin(plant.model, d, plant.twin, seed)
    grounding = Grounding(plant.graph, plant.namespace, MemoryArchive())
    settings = replace(plant.monitoring, evidence_s=0.0)
    return twin, TwinMonitoring(twin, grounding, d, plant.baselines, plant.started, settings)


def at_looks(
    plant: Plant, seed: int, recording: Recording, after_s: Sequence[int], fresh: bool = False, ask: Look = look
) -> Iterator[tuple[int, float, list[Statement]]]:
    """Time after the first symptom, process time and what is said, for every look of ``after_s`` that the run saw.

    A diagnosis remembers the one before, as in operation; ``fresh``: each look forgets what was said before it.
    """
    looks = {at_s: round(at_s - recording.first_s) for at_s in recording.looks_s}
    wanted = {at_s for at_s, after in looks.items() if after in after_s}
    twin, monitoring = monitored(plant, seed)
    for snapshot in recording.snapshots(plant):
        monitoring.notices(snapshot)
        if snapshot.at_s in wanted:
            asked = copy(monitoring) if fresh else monitoring
            yield looks[snapshot.at_s], snapshot.at_s, ask(plant, twin, asked)
            wanted.remove(snapshot.at_s)
        if not wanted:
            return
