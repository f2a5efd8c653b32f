"""Followed: whether an actuator stands where it was told to, whatever the process does meanwhile.

After a release the process moves, and what it raises is awaited. That an actuator does not do what it was told is no
transient of the process. One that is on its way is none either: it stands between what it was told lately.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from homeostat.agents.monitoring.symptoms import SymptomWatch
from homeostat.domain.diagnosis import Feature
from homeostat.domain.plant.description import ComponentKind, PlantDescription, Relation
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.stl.formula import Expression

LAGS = 5.0
"""Time constants after which an actuator has arrived to less than a per cent of its way [1]."""


@dataclass(slots=True)
class _Told:
    """A symptom that says of one actuator that it does not stand where it was told to."""

    watch: SymptomWatch
    expression: Expression
    actuator: str
    commands: frozenset[str]
    """What it reads of what the actuator was told."""
    travel_s: float
    """How long the actuator takes from one end to the other [s]."""
    since_s: float | None = None
    """Since when nothing that it was told within that time explains where it stands [s]."""
    disobeys: bool = False


class Followed:
    """Says which of the symptoms are about actuators that do not do what they were told."""

    def __init__(self, plant: PlantDescription, watches: Sequence[SymptomWatch]) -> None:
        """``watches``: those of the plant's symptoms, with their references as they are learned."""
        features, driven = {f.name: f for f in plant.features}, _driven(plant)
        self._told: dict[str, _Told] = {}
        for watch in watches:
            feature = features[watch.rule.feature]
            commands = frozenset(feature.expression.tags) & driven.get(feature.component, frozenset())
            if commands and _of_position(feature, commands, plant):
                travel_s = max(watch.rule.on_delay_s, _travel_s(feature.component, plant))
                told = _Told(watch, feature.expression, feature.component, commands, travel_s)
                self._told[watch.rule.name] = told
        self._actuator = {
            s.tag.name: s.component for s in plant.signals if s.relation in (Relation.DRIVES, Relation.OVERRIDES)
        }
        self._command = {actuator: next(iter(tags)) for actuator, tags in driven.items()}
        self._kept = frozenset[str]().union(*(told.commands for told in self._told.values()))
        self._longest_s = max((told.travel_s for told in self._told.values()), default=0.0)
        self._lately: deque[tuple[float, Mapping[str, float]]] = deque()
        self._ramps_until_s: dict[str, float] = {}

    def disobeyed(self, rule: str) -> bool:
        """Whether the symptom ``rule`` is there because an actuator does not do what it was told."""
        told = self._told.get(rule)
        return told is not None and told.disobeys

    def released(self, commands: Iterable[Command], at_s: float) -> None:
        """Take note of ``commands`` that were written at ``at_s`` [s]: what is ramped is on its way for so long."""
        values = self._lately[-1][1] if self._lately else {}
        for command in commands:
            actuator = self._actuator.get(command.tag)
            if actuator is None or command.value is None or not command.rate:
                continue
            way = abs(command.value - values.get(self._command.get(actuator, ""), math.nan))
            if math.isfinite(way):
                self._ramps_until_s[actuator] = at_s + way / command.rate

    def take(self, snapshot: Snapshot) -> None:
        """Take one more snapshot, after the watches have."""
        if not self._told:
            return
        self._lately.append((snapshot.at_s, {tag: snapshot.values.get(tag, math.nan) for tag in self._kept}))
        while len(self._lately) > 1 and self._lately[1][0] <= snapshot.at_s - self._longest_s:
            self._lately.popleft()
        for told in self._told.values():
            if told.watch.pending:
                self._judge(told, snapshot)
            else:
                told.since_s, told.disobeys = None, False

    def _judge(self, told: _Told, snapshot: Snapshot) -> None:
        at_s, values = snapshot.at_s, snapshot.values
        if at_s < self._ramps_until_s.get(told.actuator, -math.inf) + told.travel_s:
            told.since_s, told.disobeys = None, False
            return
        within = [was for was_s, was in self._lately if was_s >= at_s - told.travel_s]
        where = [told.expression.value({**values, **{tag: was[tag] for tag in told.commands}}) for was in within]
        if not all(map(math.isfinite, where)) or told.watch.least_excess(where) < 1.0:
            told.since_s, told.disobeys = None, False
            return
        told.since_s = at_s if told.since_s is None else told.since_s
        told.disobeys = at_s - told.since_s >= told.watch.rule.on_delay_s


def _driven(plant: PlantDescription) -> dict[str, frozenset[str]]:
    """Actuator -> tags that drive it."""
    actuators = {c.name for c in plant.components if c.kind is ComponentKind.ACTUATOR}
    found: dict[str, set[str]] = {}
    for signal in plant.signals:
        if signal.relation is Relation.DRIVES and signal.component in actuators:
            found.setdefault(signal.component, set()).add(signal.tag.name)
    return {actuator: frozenset(tags) for actuator, tags in found.items()}


def _of_position(feature: Feature, commands: frozenset[str], plant: PlantDescription) -> bool:
    """Whether ``feature`` reads nothing but ``commands`` of its actuator and where that stands, in the same unit."""
    shown = frozenset(feature.expression.tags) - commands
    measured = {s.tag.name: s.tag.unit for s in plant.signals if s.relation is Relation.MEASURES}
    units = {plant.tag(tag).unit for tag in commands}
    return feature.accumulation is None and bool(shown) and all(measured.get(tag) in units for tag in shown)


def _travel_s(actuator: str, plant: PlantDescription) -> float:
    """How long ``actuator`` takes from one end to the other, as the tables say [s]."""
    own = [p for p in plant.parameters if p.component == actuator and p.value > 0.0]
    lags_s = LAGS * sum(p.value for p in own if p.unit == "s")
    strokes_s = [1.0 / p.value for p in own if p.unit == "1/s"]
    for signal in plant.signals:
        rule = plant.writables.get(signal.tag.name)
        if signal.component == actuator and rule is not None and rule.fastest:
            strokes_s.append(signal.tag.range.span / rule.fastest)
    return max(strokes_s, default=0.0) + lags_s
