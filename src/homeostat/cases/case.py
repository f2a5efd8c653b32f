"""A case: one plant's graph, process model, reference values and settings, ready to be wired."""

from __future__ import annotations

import csv
import importlib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from homeostat.agents.bounds import Patience
from homeostat.agents.monitoring import MonitoringSettings
from homeostat.cases.error import CaseError
from homeostat.cases.graph import open_graph, read_description
from homeostat.cases.panel import Panel, read_panel
from homeostat.domain.baseline import Baseline
from homeostat.domain.behaviour import StateMachine
from homeostat.domain.plant_description import PlantDescription
from homeostat.domain.production import Production
from homeostat.domain.recovery import open_setpoints
from homeostat.knowledge.store import GraphStore
from homeostat.process.model import ProcessModel
from homeostat.process.seeds import Stream, generator
from homeostat.process.types import Row
from homeostat.stl.formula import Formula
from homeostat.stl.spelling import near_matches
from homeostat.twin.twin import TwinSettings

CASES = Path(__file__).parent


@dataclass(frozen=True, slots=True)
class Case:
    """One plant, ready to be wired into a supervisor."""

    name: str
    """Name of the folder."""
    title: str
    """In the engineer's words."""
    graph: GraphStore
    """The knowledge graph."""
    namespace: str
    """Where the plant's things live in it."""
    description: PlantDescription
    """What the graph says."""
    model: ProcessModel
    """The equations."""
    baselines: dict[str, Baseline]
    """Feature -> reference values."""
    twin: TwinSettings
    """How the twin is judged and used."""
    monitoring: MonitoringSettings
    """How patient monitoring is."""
    patience: Patience
    """How eagerly it is improved."""
    production: Production
    """What production is to the search."""
    delivered: tuple[str, ...]
    """True quantities whose sum is what was produced so far."""
    totals: Mapping[str, str]
    """What is added up over a run -> the true quantity."""
    started: Formula
    """Holds once the plant has left start-up."""
    start: Row
    """Inputs at the start of a run, shape (inputs,)."""
    end_s: float
    """Length of a run [s]."""
    onset_s: float
    """Default onset of a fault [s]."""
    panels: tuple[Panel, ...]
    """Panels of a run's figure."""

    def true_parameters(self, seed: int) -> Row:
        """Parameters of the plant that ``seed`` stands for, drawn from the stated uncertainty."""
        by_symbol = {p.symbol: p for p in self.description.parameters}
        draws = generator(seed, Stream.TRUTH_PARAMETERS).standard_normal(len(self.model.parameters))
        values = [by_symbol[s].value + by_symbol[s].sd * z for s, z in zip(self.model.parameters, draws, strict=True)]
        return np.array(values)


def case_names() -> tuple[str, ...]:
    """Names of every case that is installed."""
    return tuple(sorted(p.parent.name for p in CASES.glob("*/case.toml")))


def case_folder(name: str) -> Path:
    """Folder of the case called ``name``; CaseError naming near matches where there is none."""
    if name not in case_names():
        known = case_names()
        raise CaseError(f"unknown case {name!r}{near_matches(name, known)}; installed: {', '.join(known)}")
    return CASES / name


def load_case(name: str, learned: bool = True) -> Case:
    """Read the case called ``name``: its graph, its model and, unless not ``learned`` yet, its reference values.

    Raises:
        CaseError: the case is unknown, or its graph, tables, model and settings disagree.
    """
    folder = case_folder(name)
    settings = tomllib.loads((folder / "case.toml").read_text(encoding="utf-8"))
    module, _, attribute = settings["model"].partition(":")
    model: ProcessModel = getattr(importlib.import_module(module), attribute)()
    graph = open_graph(folder / "plant.ttl")
    description = read_description(graph, settings["system"], model, settings["twin"]["horizon_s"])
    _check_choices(description.machine)
    started = next(t.guard for t in description.machine.transitions if t.name == settings["run"]["started_by"])
    return Case(
        name=name,
        title=settings["title"],
        graph=graph,
        namespace=settings["system"].rpartition("#")[0] + "#",
        description=description,
        model=model,
        baselines=read_baselines(folder / "baseline.csv") if learned else {},
        twin=_twin_settings(settings["twin"]),
        patience=Patience(**settings.get("patience", {})),
        monitoring=MonitoringSettings(**settings.get("monitoring", {})),
        production=Production(settings["objective"]["throughput"], settings["objective"]["design_rate"]),
        delivered=tuple(settings["objective"]["delivered"]),
        totals=dict(settings["objective"].get("totals", {})),
        started=started,
        start=_start(settings["start"], description, model),
        end_s=settings["run"]["end_s"],
        onset_s=settings["run"]["onset_s"],
        panels=tuple(read_panel(table, description) for table in settings["figure"]),
    )


def _check_choices(machine: StateMachine) -> None:
    """CaseError where what is chosen once for a whole route has no value that all its states admit."""
    for state in machine.states:
        for way in machine.paths(state.name, {}, "", blocked=(), longest=0):
            try:
                open_setpoints((state, *(machine.state(t.target) for t in way)))
            except ValueError as error:
                raise CaseError(f"{error}; give the states ranges that overlap") from None


def read_baselines(path: Path) -> dict[str, Baseline]:
    """Feature -> reference values, from the file that ``learn_baselines`` wrote."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    numbers = [f.name for f in fields(Baseline) if f.name != "feature"]
    return {r["feature"]: Baseline(r["feature"], *(float(r[n]) for n in numbers)) for r in rows}


def _twin_settings(table: dict[str, Any]) -> TwinSettings:
    errors = {name: (pair[0], pair[1]) for name, pair in table["errors"].items()}
    rest = {k: v for k, v in table.items() if k not in ("errors", "initial", "corrected")}
    return TwinSettings(errors=errors, corrected=tuple(table["corrected"]), initial=dict(table["initial"]), **rest)


def _start(values: dict[str, float], description: PlantDescription, model: ProcessModel) -> Row:
    """Inputs at the start; those that are not given are on automatic."""
    row = np.full(len(model.inputs), np.nan)
    for tag, value in values.items():
        row[model.inputs.index(description.variables[tag])] = value
    return row
