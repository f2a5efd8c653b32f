"""What the settings leave open and the plant's graph says: starts, production, errors, times, and figures."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, NoReturn

from homeostat.domain.plant.description import ControlLoop, PlantDescription, Relation, Signal
from homeostat.domain.plant.limits import Criterion, Limit
from homeostat.domain.plant.state_machine import State
from homeostat.domain.plant.tag import Role, Tag
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import SETTINGS
from homeostat.plants.settings.settings import FigureTable, Settings, TwinTable, with_times
from homeostat.record.figure.limits import thresholds
from homeostat.stl.formula import Formula
from homeostat.stl.units import is_rate

LEAST_NOISE: Final = 0.1
"""Noise of an instrument that has none, in scales of its tag [1]."""
MODEL_SHARE: Final = 0.5
"""The model is wrong by this share of an instrument's noise at least [1]."""
ROOM: Final = 0.2
"""Share of a figure's window that is left free beyond what must be seen [1]."""
WIDE: Final = 0.25
"""Share of an instrument's range that is shown on each side of what a criterion compares it with [1]."""


def completed(name: str, settings: Settings, plant: PlantDescription) -> Settings:
    """``settings`` of the plant called ``name`` with what they leave open, but for `TwinTable.initial`.

    Raises PlantError naming the key where nothing follows from the ``plant`` and it must be stated.
    """
    where, run, twin = f"{name}/{SETTINGS}", settings.run, settings.twin
    run = run.model_copy(update={"started_by": run.started_by or _started_by(where, plant)})
    way = next((t for t in plant.machine.transitions if t.name == run.started_by), None)
    first = None if way is None else plant.machine.state(way.target)
    lasts = way is not None and bool(way.guard.tags)  # else the initial state is left at once, as before a batch
    answers = _Answers(where, settings.objective.throughput, plant, first, plant.machine.initial if lasts else None)
    rate = settings.objective.design_rate or answers.design_rate()
    priced = settings.objective.priced or answers.priced()
    errors = answers.errors(twin)
    filled = {
        "run": run,
        "objective": settings.objective.model_copy(update={"design_rate": rate, "priced": priced}),
        "twin": with_times(twin, plant.timing).model_copy(
            update={"errors": errors, "corrected": twin.corrected or answers.corrected(errors)},
        ),
        "monitoring": with_times(settings.monitoring, plant.timing),
        "intervention": with_times(settings.intervention, plant.timing),
        "start": settings.start if settings.start is not None else answers.start(),
        "figure": settings.figure if settings.figure is not None else answers.figure(),
    }
    return settings.model_copy(update=filled)


def _started_by(where: str, plant: PlantDescription) -> str:
    """The only transition by which the plant leaves its initial state by itself."""
    machine = plant.machine
    ways = [t.name for t in machine.transitions if t.source == machine.initial.name and not t.on_decision]
    if len(ways) != 1:
        there = f"{', '.join(map(repr, ways))} lead" if ways else "no transition without a decision leads"
        _refuse(where, "run", "started_by", f"{there} out of {machine.initial.name!r}")
    return ways[0]


def _refuse(where: str, table: str, key: str, why: str) -> NoReturn:
    """PlantError: ``key`` must be stated, because nothing follows."""
    raise PlantError(f"{where}: {table}: {key!r} is missing, and {why}; state it")


@dataclass(frozen=True, slots=True)
class _Answers:
    """What follows from one plant for its settings."""

    where: str
    """The file, for messages."""
    throughput: str
    """Tag that production is measured by."""
    plant: PlantDescription
    """What the graph says."""
    first: State | None
    """The first state after start-up; None where the settings name a transition that is not there."""

    begins: State | None
    """The state in which it starts up; None where that is left at once."""

    def start(self) -> dict[str, float]:
        """The design values of start-up, and of the first state after it what start-up says nothing of.

        What has none is on automatic.
        """
        later, now = ({} if s is None else {r.tag: r.design for r in s.setpoints} for s in (self.first, self.begins))
        return {tag: value for tag, value in (later | now).items() if value is not None}

    def design_rate(self) -> float:
        """Where the loop of the throughput holds it by design."""
        if (rate := self._design(self.throughput)) is None:
            why = f"no loop holds {self.throughput!r} at a design value after start-up"
            _refuse(self.where, "objective", "design_rate", why)
        return rate

    def priced(self) -> str:
        """By the total delivered where the throughput is a rate; an amount says how soon a batch makes it."""
        tag = self.plant.tags_by_name.get(self.throughput)
        return "total" if tag is not None and is_rate(tag.unit) else "throughput"

    def errors(self, twin: TwinTable) -> dict[str, list[float]]:
        """What is stated; of every other instrument its noise, and its calibration error or half its noise."""
        stated = {*twin.errors, *twin.ignored}
        measured = [signal for signal in self.plant.signals if signal.relation is Relation.MEASURES]
        found = twin.errors | {s.variable: self._error(s) for s in measured if s.variable not in stated}
        if not found:
            _refuse(self.where, "twin", "errors", "no tag is measured that 'ignored' leaves as evidence")
        return found

    def corrected(self, errors: Mapping[str, list[float]]) -> list[str]:
        """What the loops hold, but for the throughput; every process variable where that is nothing."""
        variables, loops = self.plant.variables, self.plant.loops
        held = [variables[loop.process_variable] for loop in loops if loop.process_variable != self.throughput]
        measured = [signal.variable for signal in self.plant.signals if signal.tag.role is Role.PV]
        return [name for name in dict.fromkeys(held or measured) if name in errors] or list(errors)

    def figure(self) -> list[FigureTable]:
        """A panel for every loop, for what else a limit or a criterion compares, and one for where actuators stand."""
        panels = [self._panel(loop) for loop in self.plant.loops]
        panels += self._compared_by_rules({tag for panel in panels for tag in panel.tags})
        shown = [tag for tag in map(self.plant.tag, self._outputs()) if tag.unit == "1"][:40]
        if shown:
            low, high = min(t.range.low for t in shown), max(t.range.high for t in shown)
            names = [tag.name for tag in shown]
            panels.append(FigureTable(title="Actuators", tags=names, window=[low, high]))
        return panels

    def _error(self, signal: Signal) -> list[float]:
        own = [p for p in self.plant.parameters if p.component == signal.component]
        noise, bias = max((abs(p.value) for p in own), default=0.0), max((p.sd for p in own), default=0.0)
        if signal.tag.unit != "1" and any(p.unit == "1" for p in own):  # relative to the reading
            noise, bias = (part * self._typical(signal.tag) for part in (noise, bias))
        most = signal.tag.range.span / 4.0
        noise = min(noise or LEAST_NOISE * signal.tag.scale, most)
        return [noise, min(max(bias, MODEL_SHARE * noise), most)]

    def _typical(self, tag: Tag) -> float:
        """What a tag reads by design, or in the middle of its range."""
        middle = abs(tag.range.low + tag.range.high) / 2.0
        return abs(self._design(tag.name) or 0.0) or middle or tag.range.span / 2.0

    def _design(self, tag: str) -> float | None:
        """Where a loop holds a tag by design in the first state after start-up."""
        loop = next((loop for loop in self.plant.loops if loop.process_variable == tag), None)
        row = self.first.setpoint(loop.setpoint) if self.first is not None and loop is not None else None
        return None if row is None else row.design

    def _panel(self, loop: ControlLoop) -> FigureTable:
        held = self.plant.tag(loop.process_variable)
        rules = {rule.name: _compared(rule.formula, held.name) for rule in self.plant.limits.limits}
        limits = [name for name, values in rules.items() if values]
        rows = [s.setpoint(loop.setpoint) for s in self.plant.machine.states]
        seen = [value for row in rows if row is not None for value in (row.low, row.high)]
        seen += [value for values in rules.values() for value in values]
        low, high = min(seen, default=held.range.low), max(seen, default=held.range.high)
        room = max(ROOM * (high - low), 5.0 * held.scale)
        window = [max(low - room, held.range.low), min(high + room, held.range.high)]
        if not window[0] < window[1]:  # what it is compared with is outside its range, which is said elsewhere
            window = [held.range.low, held.range.high]
        title = loop.label or held.name
        return FigureTable(title=title[:200], tags=[held.name, loop.setpoint], limits=limits, window=window)

    def _compared_by_rules(self, shown: set[str]) -> Iterator[FigureTable]:
        """A panel for each measured tag that a limit or a criterion compares with a number, if not ``shown``."""
        standing, rules = set(self.plant.positions.values()), self.plant.limits
        measured = {s.tag.name: s.tag for s in self.plant.signals if s.relation is Relation.MEASURES}
        every: tuple[Limit | Criterion, ...] = (*rules.limits, *rules.criteria)
        named = dict.fromkeys(name for rule in every for name in sorted(rule.formula.tags & measured.keys()))
        for name in named:
            seen = [value for rule in every for value in _compared(rule.formula, name)]
            if not seen or name in shown or name in standing:
                continue
            tag, room = measured[name], WIDE * measured[name].range.span
            window = [max(min(seen) - room, tag.range.low), min(max(seen) + room, tag.range.high)]
            if not window[0] < window[1]:
                window = [tag.range.low, tag.range.high]
            limits = [limit.name for limit in rules.limits if _compared(limit.formula, name)]
            title = tag.description or name
            yield FigureTable(title=title[:200], tags=[name], limits=limits, window=window)

    def _outputs(self) -> Iterator[str]:
        """Of every actuator its position, or else its command."""
        positions = self.plant.positions
        for signal in self.plant.signals:
            if signal.relation is Relation.DRIVES:
                yield positions.get(signal.component, signal.tag.name)


def _compared(formula: Formula, tag: str) -> list[float]:
    """Numbers that a rule compares a tag with."""
    return [threshold.value for threshold in thresholds(formula, (tag,))]
