"""Do the settings fit the plant? Every tag, variable, state and transition that they name must be there."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.tag import Range, Role
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import SETTINGS
from homeostat.plants.settings.settings import Settings
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.units import Unit, UnitError, read
from homeostat.process.model import ProcessModel
from homeostat.stl.spelling import near_matches
from homeostat.stl.units import in_unit

MOST_NAMES = 12
"""Names of states that a message lists."""
ROUND = 1e-9
"""Share by which a converted number may be off."""


def refuse_misnamed(name: str, settings: Settings, plant: PlantDescription) -> None:
    """PlantError where the completed settings of the plant called ``name`` name what the plant does not have.

    So it is, too, where a value is outside what the plant says about its tag. Nothing of the plant's code is needed.
    """
    check = _Check(f"{name}/{SETTINGS}", plant)
    transitions = [t.name for t in plant.machine.transitions]
    check.known("run, started_by", "transition", [settings.run.started_by or ""], transitions)
    check.start(settings.start or {})
    check.throughput(settings)
    check.twin(settings)
    check.times(settings)


def refuse_misfit(name: str, settings: Settings, plant: PlantDescription, model: ProcessModel) -> None:
    """PlantError where the completed settings of the plant called ``name`` name what its ``model`` does not have."""
    check = _Check(f"{name}/{SETTINGS}", plant)
    inputs = {tag.name for tag in plant.tags if plant.variables[tag.name] in model.inputs}
    check.known("start", "tag that can be commanded", settings.start or {}, inputs)
    check.quantities(settings, model)
    check.known("twin, errors", "variable", settings.twin.errors, model.variables)
    misnamed = next((name for name in settings.twin.initial if name not in model.states), None)
    if misnamed is not None:
        hint, names = near_matches(misnamed, model.states), balanced(model)
        there = f"{', '.join(names[:MOST_NAMES])}{', ...' if len(names) > MOST_NAMES else ''}"
        have = f"the plant has no state variable {misnamed!r}{hint}; there are {there}"
        show = f"'homeostat plant show {name} --table model' shows all"
        raise PlantError(f"{check.where}: twin, initial: {have} ({show})")
    check.deviations(settings, model)


def balanced(model: ProcessModel) -> tuple[str, ...]:
    """The states that are integrated, where a flowsheet says which those are, or else all."""
    return tuple(model.flowsheet.states) if isinstance(model, ComposedModel) else model.states


def _known_unit(symbol: str) -> Unit | None:
    """The unit that is written so; None where it is none that can be converted."""
    try:
        return read(symbol)
    except UnitError:
        return None


@dataclass(frozen=True, slots=True)
class _Check:
    """Checks of one file against one plant."""

    where: str
    """The file, for messages."""
    plant: PlantDescription
    """What the graph says."""

    def known(self, place: str, what: str, names: Iterable[str], known: Iterable[str]) -> None:
        """PlantError for the first of ``names`` that is not ``known``, or stands there twice."""
        have, seen = sorted(set(known)), set[str]()
        for name in names:
            if name not in have:
                hint = near_matches(name, have)
                raise PlantError(f"{self.where}: {place}: the plant has no {what} {name!r}{hint}")
            if name in seen:
                raise PlantError(f"{self.where}: {place}: {what} {name!r} is named twice")
            seen.add(name)

    def start(self, start: Mapping[str, float]) -> None:
        """What is commanded at the start can be commanded, within its range."""
        tags = {t.name: t for t in self.plant.tags if t.role in (Role.SP, Role.MV)}
        self.known("start", "tag that can be commanded", start, tags)
        for name, value in start.items():
            self.inside(f"start, {name}", value, tags[name].range, tags[name].unit)

    def inside(self, place: str, value: float, allowed: Range, unit: str) -> None:
        """PlantError where ``value`` is outside ``allowed``."""
        if not allowed.contains(value):
            raise PlantError(
                f"{self.where}: {place}: {value:.6g}{in_unit(unit)} is outside {allowed.low:.6g} to "
                f"{allowed.high:.6g}{in_unit(unit)}, what its tag can be"
            )

    def throughput(self, settings: Settings) -> None:
        """What production is measured by is there."""
        objective, tags = settings.objective, self.plant.tags_by_name
        self.known("objective, throughput", "tag", [objective.throughput], tags)
        tag = tags[objective.throughput]
        some = Range(tag.range.span * 1e-3, tag.range.high)
        self.inside("objective, design_rate", objective.production.design_rate, some, tag.unit)

    def quantities(self, settings: Settings, model: ProcessModel) -> None:
        """What production is counted in is there."""
        objective = settings.objective
        rows = np.zeros((1, 1, len(model.states))), np.zeros((1, 1, len(model.inputs)))
        quantities = {*self.plant.tags_by_name, *model.truth(*rows)}
        self.known("objective, delivered", "quantity", objective.delivered, quantities)
        for name, quantity in objective.totals.items():
            self.known(f"objective, totals, {name}", "quantity", [quantity], quantities)

    def twin(self, settings: Settings) -> None:
        """What the twin is judged by is measured, and no error is larger than the instrument's range."""
        twin = settings.twin
        measured = {s.variable: s.tag for s in self.plant.signals}
        self.known("twin, errors", "variable", twin.errors, measured)
        self.known("twin, ignored", "variable", twin.ignored, measured)
        if both := sorted({*twin.ignored} & {*twin.errors}):
            raise PlantError(f"{self.where}: twin, ignored: {both[0]!r} has an entry in errors; leave out one of them")
        self.known("twin, corrected", "variable with an entry in errors", twin.corrected, twin.errors)
        for name, deviation in twin.initial.items():
            if not 0.0 < deviation < math.inf:
                raise PlantError(
                    f"{self.where}: twin, initial, {name}: {deviation:.6g} must be more than 0, and finite"
                )
        for name, (noise, error) in twin.errors.items():
            tag, most = measured[name], measured[name].range.span / 4.0
            if not (most * 1e-6 <= noise <= most and error <= most):
                allowed = f"{most * 1e-6:.6g} to {most:.6g}{in_unit(tag.unit)}, a quarter of the tag's range"
                size = f"{noise:.6g}{in_unit(tag.unit)}"
                message = f"noise {size} must be from {allowed}, and model error {error:.6g} at most that"
                raise PlantError(f"{self.where}: twin, errors, {name}: {message}")

    def deviations(self, settings: Settings, model: ProcessModel) -> None:
        """No state deviates by more than what instruments can show of its kind; of others nothing says how much it is.

        Shares, and whatever else has no dimension, are not all of one kind.
        """
        states = model.flowsheet.states if isinstance(model, ComposedModel) else {}
        for name, deviation in settings.twin.initial.items():
            own = _known_unit(states[name].unit) if name in states else None
            if own is None or not own.kind:
                continue
            shown = [(t, _known_unit(t.unit)) for t in self.plant.tags if t.role is Role.PV]
            alike = [
                t.range.span * u.size / own.size for t, u in shown if u and u.kind == own.kind and u.size and own.size
            ]
            if alike and deviation > max(alike) * (1.0 + ROUND):
                unit = in_unit(states[name].unit)
                message = f"{deviation:.6g}{unit} must be at most {max(alike):.6g}{unit}, the widest range of a tag"
                raise PlantError(f"{self.where}: twin, initial, {name}: {message} that is measured in such a unit")

    def times(self, settings: Settings) -> None:
        """What is waited for comes before the run ends; a stretch that is averaged may be meant never to be full."""
        end_s = settings.run.end_s
        for table, filled in (("monitoring", settings.monitoring), ("intervention", settings.intervention)):
            for name, value in filled.given().items():
                if name.endswith("_s") and name != "centre_s" and value >= end_s:
                    message = f"{value:.6g} s must be less than the run's end_s = {end_s:.6g} s: it would never be over"
                    raise PlantError(f"{self.where}: {table}, {name}: {message}")
        if (settle_s := settings.monitoring.settings.settle_s) >= end_s:
            message = f"{settle_s:.6g} s (the default) must be less than the run's end_s = {end_s:.6g} s"
            raise PlantError(f"{self.where}: monitoring, settle_s: {message}")
