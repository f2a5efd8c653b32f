"""Do table of loops and flowsheet say the same of each controller: what it reads, follows and moves?

Nothing is said of what cannot be told apart: a controller that is written as own equations, one that stands in for
another one, an inner one that the tables leave out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from homeostat.domain.plant.description import ControlLoop, PlantDescription, Relation
from homeostat.evaluate.lint.finding import Finding, Severity
from homeostat.evaluate.lint.own_code import written
from homeostat.evaluate.lint.places import Places
from homeostat.knowledge.build.derived.tables import stated_tables
from homeostat.plants.files.folder import PlantFiles
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.flowsheet import Flowsheet
from homeostat.process.blocks.parts import Actuator, Controller, Delay, Network, held
from homeostat.process.blocks.term import Leaf, Term, leaves


@dataclass(frozen=True)
class Looped:
    """A plant's loops, in its tables and in its flowsheet."""

    plant: PlantDescription
    model: ComposedModel
    files: PlantFiles
    places: Places
    module: str
    """File of the flowsheet; empty where it is none of the folder."""

    @property
    def sheet(self) -> Flowsheet:
        """What the model follows from."""
        return self.model.flowsheet

    @cached_property
    def following(self) -> frozenset[str]:
        """Tags and symbols that the model lacks, or does not need, only because of what is found here."""
        found = set[str]()
        reported = [s for s in self.plant.signals if s.relation is Relation.REPORTS]
        for loop in (*self._otherwise_read, *self._nowhere):
            found |= {loop.setpoint, *(s.tag.name for s in reported if s.component == loop.controller)}
        for loop in self._nowhere:
            manual = [tag for tag, command in self.plant.overridden.items() if command in self._stated(loop)]
            found |= {loop.gain, loop.reset, *manual}
        return frozenset(found)

    @cached_property
    def _nowhere(self) -> tuple[ControlLoop, ...]:
        """Loops without a controller; none where one may only have another name, which its parameters tell."""
        symbols = {p.symbol for p in self.plant.parameters}
        if any(c.gain("Kp").value not in symbols for c in self.sheet.controllers.values()):
            return ()
        lone = [each for each in self.plant.loops if each.name not in self._carried_out]
        return tuple(each for each in lone if each.gain not in self.model.parameters)

    @cached_property
    def _otherwise_read(self) -> tuple[ControlLoop, ...]:
        """Loops that hold something else than their controllers read."""
        variables, found = self.plant.variables, self._carried_out
        read = [(each, variables[each.process_variable]) for each in self.plant.loops if each.name in found]
        return tuple(each for each, held in read if held in self.sheet.sensors and held != found[each.name].measured)

    def findings(self) -> Iterator[Finding]:
        """Everything in which the two differ."""
        for loop in self.plant.loops:
            if loop in self._nowhere:
                yield self._lacks(loop)
            elif loop in self._otherwise_read:
                yield self._reads(loop, self._carried_out[loop.name])
            elif loop.name in self._carried_out:
                yield from self._follows(loop, self._carried_out[loop.name])
            if loop.name in self._carried_out:
                yield from self._moves(loop, self._carried_out[loop.name])
        yield from self._without_row()

    @cached_property
    def _carried_out(self) -> dict[str, Controller]:
        """Loop -> controller of the flowsheet: that of its name, or that whose gain it has."""
        found = {}
        for loop in self.plant.loops:
            every = self.sheet.controllers
            named = [every[name] for name in (loop.controller, loop.name) if name in every]
            likely = [*named, *(c for c in every.values() if c.gain("Kp").value == loop.gain)]
            held = self.plant.variables[loop.process_variable]
            agreed = [c for c in likely if c.measured == held]
            if likely:
                found[loop.name] = (agreed or likely)[0]
        return found

    @cached_property
    def _commands(self) -> Mapping[str, Sequence[str]]:
        """Loop -> the tags that its row says it moves, which may be several."""
        rows = stated_tables(self.files.folder)[0]["loops"].rows
        return {row.get("id", ""): row.get("mv", "").replace("|", " ").split() for row in rows}

    def _stated(self, loop: ControlLoop) -> Sequence[str]:
        """What its row says that it moves."""
        return self._commands.get(loop.name) or [loop.manipulated_variable]

    def _lacks(self, loop: ControlLoop) -> Finding:
        code = self.module or "the model"
        what = f"loop {loop.name!r} has no controller in {code}: nothing holds {loop.process_variable!r} there"
        held, moved = (self.plant.variables[tag] for tag in (loop.process_variable, loop.manipulated_variable))
        how = f'FLOWSHEET.controller("{loop.gain.removeprefix("Kp_")}", measured="{held}", acts=...)'
        remedy = f"add {how} and let its output move {moved!r}, or remove the row and its parameters"
        return Finding(Severity.ERROR, "loops", self.places.row("loops", id=loop.name), what, remedy)

    def _reads(self, loop: ControlLoop, by: Controller) -> Finding:
        read = self._tag(by.measured)
        what = (
            f"loop {loop.name!r} holds {loop.process_variable!r} here, and in {self._line(by)} its controller reads "
            f"{read!r}: its setpoint and its deviation would be taken for those of another quantity"
        )
        remedy = f'write pv {read!r} here, or measured="{self.plant.variables[loop.process_variable]}" there'
        return Finding(Severity.ERROR, "loops", self.places.row("loops", id=loop.name), what, remedy)

    def _follows(self, loop: ControlLoop, by: Controller) -> Iterator[Finding]:
        """Where its setpoint is that of another controller."""
        setpoint = self.plant.variables[loop.setpoint]
        others = {c.given for c in self.sheet.controllers.values()} - {by.given}
        if setpoint not in others or (
            by.setpoint is not None and Term(Leaf.INPUT, value=setpoint) in leaves(by.setpoint)
        ):
            return
        what = (
            f"loop {loop.name!r} has the setpoint {loop.setpoint!r} here, and in {self._line(by)} its controller "
            f"follows {self._tag(by.given)!r}: whoever sets {loop.setpoint!r} moves another loop"
        )
        remedy = f"write sp {self._tag(by.given)!r} here, or correct the controller there"
        yield Finding(Severity.ERROR, "loops", self.places.row("loops", id=loop.name), what, remedy)

    def _moves(self, loop: ControlLoop, by: Controller) -> Iterator[Finding]:
        """Where the row and the flowsheet differ in what the output moves."""
        actuators, inner = self._reached(by)
        reached = {name for a in actuators for name in (a.command, a.manual)} | {c.given for c in inner}
        known = {name for a in self.sheet.actuators.values() for name in (a.command, a.manual)}
        known |= {c.given for c in self.sheet.controllers.values()}
        variables = self.plant.variables
        wrong = [tag for tag in self._stated(loop) if variables.get(tag) in known - reached]
        if wrong:
            yield self._other(loop, by, wrong)
        listed = {variables.get(tag) for tags in self._commands.values() for tag in tags}
        direct = [a for a in actuators if a.automatic is not None and by.output in leaves(a.automatic)]
        lone = [a for a in direct if a.manual not in variables.values()]
        left = [self._tag(a.command) for a in lone if a.command in {*variables.values()} - listed]
        if left and not wrong:
            yield self._left(loop, by, left)

    def _other(self, loop: ControlLoop, by: Controller, wrong: Sequence[str]) -> Finding:
        actuators, inner = self._reached(by)
        tags = sorted({self._tag(a.command) for a in actuators} | {self._tag(c.given) for c in inner})
        goes = f"goes to {' and '.join(map(repr, tags))}" if tags else "goes nowhere"
        what = (
            f"loop {loop.name!r} moves {' and '.join(map(repr, wrong))} here, and in {self._line(by)} the output of "
            f"its controller {goes}: it would be taken over by hand at the wrong place"
        )
        here = f"write mv {'|'.join(tags)} here, or " if tags else ""
        remedy = f"{here}let the controller drive there what it moves here"
        return Finding(Severity.ERROR, "loops", self.places.row("loops", id=loop.name), what, remedy)

    def _left(self, loop: ControlLoop, by: Controller, left: Sequence[str]) -> Finding:
        told = " and ".join(map(repr, left))
        what = (
            f"the output of loop {loop.name!r} goes to {told} as well in {self._line(by)}, and no row says so: nobody "
            "could command that by hand"
        )
        remedy = f"add {'|'.join(left)} to its mv, with | between them, or let something else drive that"
        return Finding(Severity.WARNING, "loops", self.places.row("loops", id=loop.name), what, remedy)

    def _without_row(self) -> Iterator[Finding]:
        """Controllers that only a row could give a setpoint, and that have none."""
        carried = self._carried_out.values()
        bound, symbols = {*self.plant.variables.values()}, {p.symbol for p in self.plant.parameters}
        for c in self.sheet.controllers.values():
            instead = any(c.measured == each.measured for each in carried)
            if c in carried or instead or c.setpoint is not None or c.given in bound:
                continue
            if c.gain("Kp").value not in symbols:  # a misspelt name, which is told with its parameters
                continue
            what = (
                f"no row has the controller {c.name!r} of {self._line(c)}: nothing gives it a setpoint, and nobody "
                f"sees that {self._tag(c.measured)!r} is off it"
            )
            remedy = f"add its row (id {c.name}, pv {self._tag(c.measured)}), or take it out of the flowsheet"
            yield Finding(Severity.WARNING, "loops", self.places.row("loops", id=c.name), what, remedy)

    def _reached(self, by: Controller) -> tuple[list[Actuator], list[Controller]]:
        """Actuators and inner controllers that an output goes to, through whatever lies between but another loop.

        An inner controller that the tables leave out lies between.
        """
        sheet, carried = self.sheet, {c.name for c in self._carried_out.values()}
        through = {by.output}

        def reads(*terms: Term | None) -> bool:
            return any(through & leaves(each) for each in terms if each is not None)

        while True:
            found = {held(s.name) for s in sheet.sensors.values() if reads(s.of)}
            found |= {held(m.name) for m in sheet.memories.values() if reads(m.update)}
            found |= {held(name) for name in sheet.switches if reads(sheet.quantities[name].of)}
            for each in sheet.lags.values():
                if isinstance(each, Network):
                    continue
                if reads(each.of):
                    found.add(held(each.oldest if isinstance(each, Delay) else each.name))
            for c in sheet.controllers.values():
                own = (c.forward, c.law.beside, c.law.meanwhile)
                if reads(*own) or (c.name not in carried and reads(c.setpoint)):
                    found.add(c.output)
            if found <= through:
                break
            through |= found
        actuators = [a for a in sheet.actuators.values() if reads(a.automatic)]
        return actuators, [c for c in sheet.controllers.values() if c != by and reads(c.setpoint)]

    def _tag(self, variable: str) -> str:
        """The tag that a variable of the model carries; the variable where there is none."""
        return next((s.tag.name for s in self.plant.signals if s.variable == variable), variable)

    def _line(self, by: Controller) -> str:
        """Where the controller is in the plant's code."""
        place = written(self.files, [by.name]) if self.module else None
        return str(place) if place else f"{self.module or 'the model'} ({by.name})"
