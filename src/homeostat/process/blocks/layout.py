"""Where everything of a flowsheet stands in the engine's arrays."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final

from homeostat.process.blocks.flowsheet import LONGEST_DELAY, Flowsheet
from homeostat.process.blocks.given import FlowsheetError
from homeostat.process.blocks.hydraulics.solver import room
from homeostat.process.blocks.parts import Delay, Disturbance, Hold, Network
from homeostat.process.blocks.stabilised import Stage, stages_of
from homeostat.process.blocks.term import TIME, Leaf, Term, leaves
from homeostat.process.departures import ACTUATOR_STATES, BEFORE_ACTUATOR, NOISE_LAW, Departures

MOST_APART: Final = 20
"""States up to which each is a variable of the kernel's source."""


@dataclass(frozen=True)
class Beyond:
    """What a true plant has beside its model, whose columns come first."""

    model: Layout
    """Columns of the model."""
    departures: Departures
    """What stands before actuators and behind instruments, and parameters of the plant's own."""

    @property
    def states(self) -> tuple[str, ...]:
        """Columns of the model, then those of the departures."""
        return (*self.model.states, *(f"departure {k}" for k in range(self.departures.states)))

    @property
    def first_parameter(self) -> int:
        """Column of the first parameter of its own: the noise law."""
        return len(self.model.parameters)

    def before(self, actuator: str) -> tuple[int, int] | None:
        """First state and first parameter of what stands before an actuator; None where nothing does."""
        if actuator not in self.departures.actuators:
            return None
        i = self.departures.actuators.index(actuator)
        first = self.first_parameter + len(NOISE_LAW)
        return len(self.model.states) + i * ACTUATOR_STATES, first + i * len(BEFORE_ACTUATOR)

    def behind(self) -> tuple[int, int]:
        """First state and first parameter of what stands behind the first instrument."""
        actuators = len(self.departures.actuators)
        first = self.first_parameter + len(NOISE_LAW) + actuators * len(BEFORE_ACTUATOR)
        return len(self.model.states) + actuators * ACTUATOR_STATES, first


@dataclass(frozen=True)
class Layout:
    """A complete flowsheet, and the names of its columns in their order."""

    sheet: Flowsheet
    rates: Mapping[str, Term]
    """State -> its rate of change per second."""
    faults: tuple[str, ...]
    """Faults that the plant's tables have; the flowsheet's others are 0 for ever."""
    tick_s: float = 1.0
    """Time between two samples of the plant [s]."""
    beyond: Beyond | None = None
    """What it is beside a model; None where it is one."""

    @classmethod
    def true(cls, sheet: Flowsheet, model: Layout, departures: Departures) -> Layout:
        """The layout of a true plant; FlowsheetError where it is not complete, or has other inputs than its model."""
        made = cls(sheet, sheet.complete(), model.faults, model.tick_s, Beyond(model, departures))
        if made.inputs != model.inputs or set(model.states) - set(made._own_states):
            raise FlowsheetError("a true plant has the inputs and states of its model; add to it and take nothing away")
        return made

    @classmethod
    def of(cls, sheet: Flowsheet, faults: Collection[str], tick_s: float = 1.0) -> Layout:
        """The layout of ``sheet`` for a plant of this tick [s] whose tables have ``faults``.

        FlowsheetError where it is not complete, or a dead time takes too many ticks.
        """
        for each in sheet.lags.values():
            if isinstance(each, Delay) and each.seconds > LONGEST_DELAY * tick_s:
                long = f"delay {each.name}: {each.seconds:g} s are more than {LONGEST_DELAY} ticks of {tick_s:g} s"
                raise FlowsheetError(f"{long}; shorten it, or give [time] a longer tick_s")
        known = sorted((name for name in sheet.faults if name in faults), key=_place(sheet.first))
        made = cls(sheet, sheet.complete(), tuple(known), tick_s)
        twice = [name for i, name in enumerate(made.states) if name in made.states[:i]]
        if twice:
            raise FlowsheetError(f"{twice[0]!r} is the column of two parts; give a sensor or a quantity another name")
        return made

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Columns of the states; of a true plant those of its model, of its departures, and its own."""
        return self._own_states if self.beyond is None else (*self.beyond.states, *self.extra)

    @property
    def extra(self) -> tuple[str, ...]:
        """Columns that a true plant has and its model has not."""
        assert self.beyond is not None
        return tuple(name for name in self._own_states if name not in self.beyond.model.states)

    @cached_property
    def _own_states(self) -> tuple[str, ...]:
        shown = [name for s in self.sheet.sensors.values() for name in (s.true, s.ideal, s.name)]
        return (*self.sheet.columns(self.tick_s), *shown, *self.sheet.quantities)

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """Columns of the inputs: setpoints, commands from outside, and what instruments said of what comes in."""
        sheet = self.sheet
        setpoints = [c.given for c in sheet.controllers.values()]
        commands = [a.manual for a in sheet.actuators.values()]
        return (*dict.fromkeys(setpoints), *commands, *sheet.commands, *(d.reading for d in self.measured))

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """Columns of the parameters: everything that a term names."""
        if self.beyond is not None:
            return (*self.beyond.model.parameters, *self.beyond.departures.parameters)
        named = {str(leaf.value) for leaf in leaves(*self.terms()) if leaf.op is Leaf.PARAMETER}
        return tuple(sorted(sorted(named), key=_place(self.sheet.first)))

    @cached_property
    def measured(self) -> tuple[Disturbance, ...]:
        """Disturbances whose instrument says what they are."""
        return tuple(d for d in self.sheet.disturbances.values() if d.measured is not None)

    @cached_property
    def told(self) -> tuple[str, ...]:
        """Columns of what is the case though no instrument need show it: states, memories, what is held, quantities."""
        held = [each.columns if isinstance(each, Network) else (each.name,) for each in self.sheet.lags.values()
                if isinstance(each, Hold | Network)]  # fmt: skip
        return (*self.sheet.states, *self.sheet.memories, *(n for each in held for n in each), *self.sheet.quantities)

    @cached_property
    def rooms(self) -> Mapping[str, int]:
        """Network -> where its numbers begin in the kernel's room; "" -> the size of that."""
        rooms, at = {}, max(len(self.sheet.sensors), 1)
        for each in self.sheet.lags.values():
            if isinstance(each, Network):
                rooms[each.name], at = at, at + room(len(each.junctions), len(each.branches))
        return {**rooms, "": at if self.room_of_states is None else at + 4 * len(self.sheet.states)}

    @cached_property
    def stages(self) -> tuple[Stage, ...]:
        """All evaluations of a tick where the sheet states its fastest motion; empty for Runge-Kutta 4."""
        fastest_s = self.sheet.fastest_s
        try:
            return () if fastest_s is None else stages_of(self.tick_s, fastest_s)
        except ValueError as error:
            text = f"fastest_s = {fastest_s:g} beside a tick of {self.tick_s:g} s: {error}; leave out what is so fast"
            raise FlowsheetError(f"{text}, or give [time] a shorter tick_s") from None

    @property
    def room_of_states(self) -> int | None:
        """Where the states' numbers begin in the kernel's room; None where they are few and have variables.

        Of stages that are stable with fast motions there are too many for variables.
        """
        if len(self.sheet.states) <= MOST_APART and not self.stages:
            return None
        networks = [each for each in self.sheet.lags.values() if isinstance(each, Network)]
        return max(len(self.sheet.sensors), 1) + sum(room(len(n.junctions), len(n.branches)) for n in networks)

    @cached_property
    def healthy(self) -> Mapping[Term, float]:
        """What faults and time are where nothing is wrong, and nobody asks when."""
        none = {Term(kind, value=n): 0.0 for n in self.sheet.faults for kind in (Leaf.FAULT, Leaf.AGE)}
        return {**none, TIME: 0.0}

    @cached_property
    def column(self) -> Mapping[str, int]:
        """State column -> its position."""
        return {name: i for i, name in enumerate(self.states)}

    @cached_property
    def leaf(self) -> Mapping[Leaf, Mapping[str, Term]]:
        """Leaf of every column of the states, input and parameter, by its kind and name."""
        names = {Leaf.HELD: self.states, Leaf.INPUT: self.inputs, Leaf.PARAMETER: self.parameters}
        return {kind: {name: Term(kind, value=name) for name in each} for kind, each in names.items()}

    def terms(self) -> Iterator[Term]:
        """Every term that the kernel works out."""
        sheet = self.sheet
        yield from self.rates.values()
        yield sheet.parts
        yield from (of for s in sheet.states.values() for of in (s.start, s.usual))
        for a in sheet.actuators.values():
            yield from (*a.lags, a.withheld, *([] if a.automatic is None else [a.automatic]))
        for c in sheet.controllers.values():
            yield from c.terms()
            yield from (c.gain(kind) for kind in ("Kp", "Ki", *(["Kd"] if c.derivative else [])))
        yield from (m.update for m in sheet.memories.values())
        for each in sheet.lags.values():
            yield from each.terms if isinstance(each, Network) else (each.of,)
            tau = getattr(each, "tau", None)
            if tau is not None:
                yield tau
        for d in sheet.disturbances.values():
            yield Term(Leaf.PARAMETER, value=d.name)
            yield from (of for of in (d.sd, d.tau) if of is not None)
        for s in sheet.sensors.values():
            yield from (s.of, s.bias, s.noise, s.off)
        yield from (q.of for q in sheet.quantities.values())


def _place(first: tuple[str, ...]) -> Callable[[str], int]:
    """Place of a column: where it stands in ``first``, or behind all of them."""
    return lambda name: first.index(name) if name in first else len(first)
