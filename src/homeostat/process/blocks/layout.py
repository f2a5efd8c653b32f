"""Where everything of a flowsheet stands in the engine's arrays."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from homeostat.process.blocks.flowsheet import LONGEST_DELAY, Flowsheet, FlowsheetError
from homeostat.process.blocks.parts import Delay, Disturbance
from homeostat.process.blocks.term import Leaf, Term, leaves


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

    @classmethod
    def of(cls, sheet: Flowsheet, faults: Collection[str], tick_s: float = 1.0) -> Layout:
        """The layout of ``sheet`` for a plant of this tick [s] whose tables have ``faults``.

        FlowsheetError where it is not complete, or a dead time takes too many ticks.
        """
        for each in sheet.lags.values():
            if isinstance(each, Delay) and each.seconds > LONGEST_DELAY * tick_s:
                long = f"delay {each.name}: {each.seconds:g} s are more than {LONGEST_DELAY} ticks of {tick_s:g} s"
                raise FlowsheetError(f"{long}; shorten it, or give [time] a longer tick_s")
        made = cls(sheet, sheet.complete(), tuple(name for name in sheet.faults if name in faults), tick_s)
        twice = [name for i, name in enumerate(made.states) if name in made.states[:i]]
        if twice:
            raise FlowsheetError(f"{twice[0]!r} is the column of two parts; give a sensor or a quantity another name")
        return made

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Columns of the states."""
        shown = [name for s in self.sheet.sensors.values() for name in (s.true, s.ideal, s.name)]
        return (*self.sheet.columns(self.tick_s), *shown, *self.sheet.quantities)

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """Columns of the inputs: setpoints, commands from outside, and what instruments said of what comes in."""
        sheet = self.sheet
        setpoints = [c.given for c in sheet.controllers.values()]
        commands = [a.manual for a in sheet.actuators.values()]
        return (*dict.fromkeys(setpoints), *commands, *(d.reading for d in self.measured))

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """Columns of the parameters: everything that a term names."""
        return tuple(
            sorted({str(leaf.value) for of in self.terms() for leaf in leaves(of) if leaf.op is Leaf.PARAMETER})
        )

    @cached_property
    def measured(self) -> tuple[Disturbance, ...]:
        """Disturbances whose instrument says what they are."""
        return tuple(d for d in self.sheet.disturbances.values() if d.measured is not None)

    @cached_property
    def column(self) -> Mapping[str, int]:
        """State column -> its position."""
        return {name: i for i, name in enumerate(self.states)}

    def terms(self) -> Iterator[Term]:
        """Every term that the kernel works out."""
        sheet = self.sheet
        yield from self.rates.values()
        yield from (s.start for s in sheet.states.values())
        for a in sheet.actuators.values():
            yield from (*a.lags, *([] if a.automatic is None else [a.automatic]))
        for c in sheet.controllers.values():
            yield from (c.forward, *([] if c.setpoint is None else [c.setpoint]))
            yield from (c.gain(kind) for kind in ("Kp", "Ki", *(["Kd"] if c.derivative else [])))
        yield from (m.update for m in sheet.memories.values())
        for each in sheet.lags.values():
            yield each.of
            tau = getattr(each, "tau", None)
            if tau is not None:
                yield tau
        for d in sheet.disturbances.values():
            yield Term(Leaf.PARAMETER, value=d.name)
            yield from (of for of in (d.sd, d.tau) if of is not None)
        for s in sheet.sensors.values():
            yield from (s.of, s.bias, s.noise)
        yield from (q.of for q in sheet.quantities.values())
