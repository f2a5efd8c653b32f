"""A plant: one plant's graph, process model, reference values and settings, ready to be wired."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from homeostat.agents.monitoring.settings import MonitoringSettings
from homeostat.domain.mode import Side
from homeostat.domain.plant.baseline import Baseline
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.prices import Prices, prices_of
from homeostat.domain.plant.production import Production
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.recovery import open_setpoints
from homeostat.guard.settings import LEASE_WITHIN_S
from homeostat.knowledge.build.build import GRAPH
from homeostat.knowledge.store.store import GraphStore
from homeostat.plants.configuration import configuration_digest
from homeostat.plants.described import read_stated
from homeostat.plants.error import PlantError
from homeostat.plants.files.baselines import refuse_altered
from homeostat.plants.files.folder import BASELINES, SETTINGS, PlantFiles
from homeostat.plants.files.generated import with_baselines
from homeostat.plants.files.graph import refuse_other_model
from homeostat.plants.model import find_model
from homeostat.plants.settings.adopted import with_effects
from homeostat.plants.settings.balances import read_balances
from homeostat.plants.settings.check import refuse_misfit
from homeostat.plants.settings.figure_panel import read_panel
from homeostat.plants.settings.settings import Settings
from homeostat.process.model import ProcessModel
from homeostat.process.seeds import Stream, generator
from homeostat.process.types import Vec
from homeostat.record.figure.panel import Panel
from homeostat.recovery.bounds import InterventionBounds, RiskBounds
from homeostat.stl.formula import Formula
from homeostat.twin.isolation.modes import generated_modes
from homeostat.twin.settings import TwinSettings


@dataclass(frozen=True, slots=True, weakref_slot=True)
class Plant:
    """One plant, ready to be wired into a supervisor."""

    name: str
    """Name of the folder."""
    title: str
    """In the engineer's words."""
    files: PlantFiles
    """What its folder holds."""
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
    """How long monitoring waits before it speaks."""
    intervention: InterventionBounds
    """How eagerly it is improved."""
    risk: RiskBounds
    """How sure a release must be that no hard limit is violated."""
    prices: Prices
    """What production is, and what everything that does not forbid costs."""
    delivered: tuple[str, ...]
    """True quantities whose sum is what was produced so far."""
    totals: Mapping[str, str]
    """What is added up over a run -> the true quantity."""
    reported: tuple[str, ...]
    """Those of the totals that a study keeps of every run."""
    started: Formula
    """Holds once the plant has left start-up."""
    start: Vec
    """Inputs at the start of a run, shape (inputs,)."""
    end_s: float
    """Length of a run [s]."""
    onset_s: float
    """Default onset of a fault [s]."""
    panels: tuple[Panel, ...]
    """Panels of a run's figure."""
    lease_within_s: float = LEASE_WITHIN_S
    """Longest that the plant's link may need to give a lease [s]."""
    recipe: Side = Side.GUARD
    """Who runs the nominal sequence in modes that write; in the others the plant does."""
    remade: tuple[str, ...] = ()
    """Generated files that were older than their sources, and were made again when the plant was loaded."""

    @property
    def production(self) -> Production:
        """What production is."""
        return self.prices.production

    @property
    def configuration(self) -> str:
        """Digest of everything that configures the plant."""
        return configuration_digest(self.files)

    def true_parameters(self, seed: int, spread: float = 1.0) -> Vec:
        """Parameters of the plant that ``seed`` stands for, drawn from ``spread`` times the stated uncertainty."""
        by_symbol = {p.symbol: p for p in self.description.parameters}
        draws = generator(seed, Stream.TRUTH_PARAMETERS).standard_normal(len(self.model.parameters))
        stated = [by_symbol[symbol] for symbol in self.model.parameters]
        return np.array([p.value + spread * p.sd * z for p, z in zip(stated, draws, strict=True)])


def load_plant(name: str, learned: bool = True, kept: bool = True) -> Plant:
    """Read the plant called ``name``: its graph, its model and, unless not ``learned`` yet, its reference values.

    ``name`` may be a path of a plant's folder; it has a ``/`` then. A generated file that is older than its sources is
    made again, and unless not ``kept`` written to the folder: `Plant.remade` names it.

    Raises:
        PlantError: the plant is unknown, or its settings are wrong or do not fit the plant.
        GraphError: a generated file was altered, or graph, tables, model and reference values disagree.
    """
    stated = read_stated(name, kept)
    files, settings, description = stated.files, stated.settings, stated.description
    _check_choices(description.machine)
    if BASELINES in files.contents:
        refuse_altered(files.contents[BASELINES])
    model = find_model(files, settings.model, description)  # its code runs after what can be checked without it
    refuse_other_model(description, model, settings.twin.settings.horizon_s)
    refuse_misfit(files.folder.name, settings, description, model)
    plant = _with_generated(_case(settings, files, stated.graph, description, model), settings)
    if files is not stated.read:
        plant = replace(plant, remade=(GRAPH,))
    return with_baselines(plant, kept) if learned else plant


def _case(
    settings: Settings, files: PlantFiles, graph: GraphStore, description: PlantDescription, model: ProcessModel
) -> Plant:
    """The plant without its reference values."""
    return Plant(
        name=files.folder.name,
        title=settings.title,
        files=files,
        graph=graph,
        namespace=settings.namespace,
        description=description,
        model=model,
        baselines={},
        twin=replace(settings.twin.settings, delivered=_counted(settings, description)),
        intervention=settings.intervention.settings,
        monitoring=settings.monitoring.settings,
        risk=replace(settings.risk.settings, shared_s=description.timing.time_s(RiskBounds().shared_s)),
        prices=_prices(settings, description),
        delivered=tuple(settings.objective.delivered),
        totals=dict(settings.objective.totals),
        reported=tuple(settings.objective.reported),
        started=next(t.guard for t in description.machine.transitions if t.name == settings.run.started_by),
        start=_start(settings.start or {}, description, model),
        lease_within_s=settings.link.lease_within_s,
        recipe=Side(settings.recipe),
        end_s=settings.run.end_s,
        onset_s=settings.run.onset_s,
        panels=tuple(read_panel(table.model_dump(exclude_none=True), description) for table in settings.figure or ()),
    )


def _prices(settings: Settings, plant: PlantDescription) -> Prices:
    objective = settings.objective
    told = objective.production, objective.currency, plant.limits, plant.machine
    return prices_of(plant.prices, *told, plant.timing)


def _counted(settings: Settings, plant: PlantDescription) -> tuple[str, ...]:
    """The variables behind what is delivered, where decisions are priced by it."""
    delivered = settings.objective.production.delivered
    return tuple(plant.variables.get(name, name) for name in delivered)


def _with_generated(plant: Plant, settings: Settings) -> Plant:
    """``plant`` with the balances of its twin, and the fault modes that no process model has an equation of."""
    balances = read_balances(f"{plant.name}/{SETTINGS}", settings.twin.balances, plant.description, plant.model)
    twin = replace(plant.twin, balances=balances)
    generated = generated_modes(plant.description, twin)
    faults = with_effects(plant.description.faults, generated)
    return replace(plant, twin=twin, description=replace(plant.description, faults=faults, generated=generated))


def _check_choices(machine: StateMachine) -> None:
    """PlantError where what is chosen once for a whole route has no value that all its states admit."""
    for state in machine.states:
        for way in machine.paths(state.name, {}, "", blocked=(), longest=0):
            try:
                open_setpoints((state, *(machine.state(t.target) for t in way)))
            except ValueError as error:
                raise PlantError(f"{error}; give the states ranges that overlap") from None


def _start(values: Mapping[str, float], description: PlantDescription, model: ProcessModel) -> Vec:
    """Inputs at the start; those that are not given are on automatic."""
    row = np.full(len(model.inputs), np.nan)
    for tag, value in values.items():
        row[model.inputs.index(description.variables[tag])] = value
    return row
