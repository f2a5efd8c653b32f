"""A flowsheet: an engineer says what a plant is made of, and a process model follows from it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Container, Iterator, Mapping
from typing import Final, Literal, final

from homeostat.process.blocks.given import FlowsheetError, operand, plain_number, positive, refuse_name
from homeostat.process.blocks.parts import (
    Actuator,
    Controller,
    Delay,
    Disturbance,
    Hold,
    Lag,
    Law,
    Memory,
    Network,
    Quantity,
    Sensor,
    State,
    fault,
    held,
)
from homeostat.process.blocks.term import TIME, ZERO, Leaf, Operand, Term, exp, leaves, term, where

LONGEST_DELAY: Final = 600
"""Longest dead time, and analyser's time, in ticks: each of a dead time is a number that every member carries."""

COMMANDS: Final = "commands"
"""A record is followed by what was commanded."""
SETPOINTS: Final = "setpoints"
"""A record is followed by what was to be held."""


@final
class Flowsheet:
    """What a plant is made of; its methods add parts and give terms for equations.

    Wherever a term is taken, a string is the symbol of a parameter of the tables. All flows and rates are per second.
    """

    def __init__(
        self, parts: int = 1, replayed: Literal["commands", "setpoints"] = COMMANDS, fastest_s: float | None = None
    ) -> None:
        """``parts``: steps of the integration (Runge-Kutta 4) in a tick.

        ``fastest_s``: time of the fastest motion [s] where it would ask for many of them and does not swing, as flows
        between vessels with little gas do: a tick is integrated in growing steps that are stable with it in place of
        ``parts`` (:mod:`~homeostat.process.blocks.stabilised`).

        ``replayed``: what the twin is given when it follows a record. ``setpoints`` is for a plant that runs away under
        the commands of another one, however near: its own controllers act then.
        """
        if not 1 <= (steps := plain_number("flowsheet", "parts", parts)) <= 100 or steps % 1.0:
            raise FlowsheetError(f"parts = {parts}: a tick is integrated in 1 to 100 steps, a whole number of them")
        if fastest_s is not None and not plain_number("flowsheet", "fastest_s", fastest_s) > 0.0:
            raise FlowsheetError(f"fastest_s = {fastest_s}: it is a time in seconds, more than 0, or it is left out")
        self.parts = term(steps)
        """Steps of the integration in a tick, a whole number; a term where that depends on the states."""
        self.fastest_s = fastest_s
        """Time of the fastest motion [s], for which growing steps are taken; None for Runge-Kutta 4."""
        self.replayed = replayed
        """What the twin is given when it follows a record."""
        self.states: dict[str, State] = {}
        self.actuators: dict[str, Actuator] = {}
        self.controllers: dict[str, Controller] = {}
        self.lags: dict[str, Lag | Delay | Hold | Network] = {}
        self.memories: dict[str, Memory] = {}
        self.disturbances: dict[str, Disturbance] = {}
        self.sensors: dict[str, Sensor] = {}
        self.quantities: dict[str, Quantity] = {}
        self.faults: dict[str, Term] = {}
        self.resting: list[Term] = []
        """States that are taken to be at rest where a plant is found running."""
        self.switches: set[str] = set()
        self.contents: list[str] = []  # states that are what vessels hold
        self.commands: list[str] = []
        """What is commanded from outside beside setpoints and actuators."""
        self.first: tuple[str, ...] = ()
        """Parameters and faults whose columns come first, in this order: members are drawn column by column."""
        self._rates: dict[str, Callable[[], Term]] = {}
        self._names: set[str] = set()

    @property
    def time(self) -> Term:
        """Seconds since the plant was started."""
        return TIME

    def state(
        self, name: str, unit: str, start: Operand, least: float | None = None, usual: Operand | None = None
    ) -> Term:
        """A quantity that is integrated; :meth:`rate` says how it changes.

        ``start``: where a run begins; ``least``: what it cannot fall below, in ``unit``; ``usual``: where it is taken
        to be where no instrument tells, ``start`` where left out.
        """
        self._take(name)
        who, first = f"state {name}", operand(f"state {name}", "start", start)
        lowest = None if least is None else plain_number(who, "least", least)
        self.states[name] = State(name, unit, first, lowest, first if usual is None else operand(who, "usual", usual))
        return self.states[name].term

    def rate(self, state: Term, change: Term | Callable[[], Term]) -> None:
        """``state`` changes by ``change`` per second; a function is asked when the flowsheet is complete."""
        if state.op is not Leaf.STATE or state.value not in self.states:
            raise FlowsheetError(f"{state!r:.100} is no state of this flowsheet; add it with state(...)")
        if str(state.value) in self._rates:
            raise FlowsheetError(f"the rate of {state.value} is stated twice; state it once, as a sum")
        self._rates[str(state.value)] = change if callable(change) else lambda: term(change)

    def rests(self, state: Term) -> None:
        """``state`` is taken to be where its rate is 0 where a plant is found running and no instrument shows it.

        It is for what follows the rest of the plant in seconds, such as the inside of an exchanger or a tray.
        """
        self.resting.append(state)

    def equations(self, change: Callable[..., object], **given: Operand) -> None:
        """Own equations: a function of states and other terms by the names of its parameters.

        Its parameters are states of this flowsheet, or names in ``given``, or else symbols of parameters. It returns
        the rates of change of a dictionary, state -> rate per second.
        """
        names = inspect.signature(change).parameters
        known = {name: s.term for name, s in self.states.items()}
        rates = change(**{name: term(given.get(name, known.get(name, name))) for name in names})
        if not isinstance(rates, dict) or not rates:
            raise FlowsheetError(f"{change.__name__} returns {rates!r:.60}; return a dictionary, state -> rate")
        for name, value in rates.items():
            if name not in known:
                raise FlowsheetError(f"{change.__name__} gives a rate of {name!r}, which is no state; add it first")
            self.rate(known[name], term(value))

    def actuator(
        self,
        name: str,
        automatic: Term | None = None,
        lags: tuple[Operand, ...] | None = None,
        start: float = 0.0,
        faults: Mapping[str, str] | None = None,
        withheld: Term = ZERO,
    ) -> Actuator:
        """A valve, pump or heater with a command from 0 to 1, and its standard faults.

        ``automatic``: what commands it while nobody does by hand, such as a controller's output. ``lags``: its time
        constants [s]; the parameter ``tau_NAME`` where left out, two for second order. ``faults``: names of its faults
        in the tables where they are not ``NAME_weak``, ``NAME_stuck_open`` and ``NAME_stuck_closed``, as
        ``{"weak": "pump_wear"}``. ``withheld``: what an override takes off whatever it is commanded [1].
        """
        self._take(name)
        begins = plain_number(who := f"actuator {name}", "start", start)
        if not 0.0 <= begins <= 1.0:
            raise FlowsheetError(f"actuator {name}: start = {start:g} must be within 0 and 1")
        several = (lags,) if isinstance(lags, str | Term | float | int) else lags
        taus = tuple(positive(who, "lag", each) for each in (several if several is not None else (f"tau_{name}",)))
        if not 1 <= len(taus) <= 2:
            raise FlowsheetError(f"actuator {name}: {len(taus)} lags; give one or two time constants")
        by = automatic if automatic is None else operand(who, "automatic", automatic)
        off = operand(who, "withheld", withheld)
        made = self.actuators[name] = Actuator(name, taus, by, start, dict(faults or {}), off)
        for each in (made.stuck_open, made.stuck_closed, made.weak):
            self.fault(each)
        return made

    def controller(
        self,
        name: str,
        measured: str,
        acts: int,
        forward: Operand = 0.0,
        setpoint: Term | None = None,
        derivative: bool = False,
        law: Law | None = None,
    ) -> Controller:
        """A PI controller with gains ``Kp_NAME`` and ``Ki_NAME``, and ``Kd_NAME`` with ``derivative``.

        ``measured``: variable that it holds; ``acts``: 1 where more of it needs more output, -1 where less. ``law``:
        how its output becomes a command, where something is added to it or rests it.
        """
        self._take(name)
        if acts not in (1, -1):
            raise FlowsheetError(
                f"controller {name}: acts = {acts!r}; 1 where a higher reading needs more output, or -1"
            )
        if any(c.measured == measured for c in self.controllers.values()) and setpoint is None:
            raise FlowsheetError(f"controller {name}: {measured} has a controller already, and one setpoint")
        who = f"controller {name}"
        given = None if setpoint is None else operand(who, "setpoint", setpoint)
        made = self.controllers[name] = Controller(
            name, measured, acts, operand(who, "forward", forward), given, derivative, law or Law()
        )
        return made

    def loop(self, name: str, measured: str, drives: str, acts: int, forward: Operand = 0.0) -> Actuator:
        """A controller and the actuator that it drives."""
        return self.actuator(drives, self.controller(name, measured, acts, forward).output)

    def command(self, name: str) -> Term:
        """What is commanded from outside beside setpoints and actuators, such as a switch of control; NaN for nothing.

        ``s.command("FIC_on") < 0.5`` does not hold, and ``> 0.5`` neither, where nobody commands it.
        """
        self._take(name)
        self.commands.append(name)
        return Term(Leaf.INPUT, value=name)

    def output(self, controller: str) -> Term:
        """What ``controller`` puts out [1], also before that is added."""
        return held(f"{controller}_out")

    def reading(self, name: str) -> Term:
        """What the transmitter ``name`` shows, also before that is added."""
        return held(name)

    def setpoint(self, measured: str) -> Term:
        """The setpoint that is given from outside for what ``measured`` shows."""
        return Term(Leaf.INPUT, value=f"{measured}_sp")

    def sensor(
        self,
        name: str,
        of: Term,
        relative: bool = False,
        step: float = 0.0,
        every_s: float = 0.0,
        errors: tuple[str, str] | None = None,
        off: Term = ZERO,
    ) -> Term:
        """A transmitter of ``of`` with calibration error ``bias_NAME`` and noise ``sd_NAME``; gives its reading.

        ``relative``: both are shares of the reading; ``step``: what it rounds to; ``every_s``: an analyser's time [s],
        it shows something new with each tick where that is 0; ``errors``: symbols of both where they have others;
        ``off``: what faults of its own add to what it shows.
        """
        self._take(name)
        who = f"sensor {name}"
        if plain_number(who, "every_s", every_s) < 0.0 or plain_number(who, "step", step) < 0.0:
            raise FlowsheetError(f"sensor {name}: every_s = {every_s:g} s and step = {step:g} must be at least 0")
        bias, noise = map(term, errors or (f"bias_{name}", f"sd_{name}"))
        self.sensors[name] = Sensor(name, term(of), relative, step, every_s, bias, noise, operand(who, "off", off))
        for each in self.disturbances.values():
            if of == each.now and each.measured is None:
                self.disturbances[each.name] = Disturbance(each.name, each.sd, each.tau, name)
        return held(name)

    def disturbance(self, name: str, sd: Operand | None = None, tau: Operand | None = None) -> Term:
        """What comes from outside, such as a feed temperature: the parameter ``name``, and coloured noise around it.

        ``sd``: standard deviation of the unfiltered noise, drawn anew each tick; ``tau``: time constant of its filter
        [s]. What comes out spreads by sd sqrt(tanh(tick / (2 tau))), about sd sqrt(tick / (2 tau)): 0.1 of an sd of 1
        with 50 s and a tick of 1 s, and by sqrt(tau / (tau + T)) of that behind a vessel or lag with the time T.
        """
        self._take(f"{name}_now")
        who = f"disturbance {name}"
        noise = None if sd is None else positive(who, "sd", sd, zero=True)
        self.disturbances[name] = Disturbance(name, noise, None if tau is None else positive(who, "tau", tau), None)
        return self.disturbances[name].now

    def lag(self, name: str, of: Term, tau: Operand) -> Term:
        """A quantity that follows ``of`` with the time constant ``tau`` [s]."""
        self._take(name)
        self.lags[name] = Lag(name, operand(f"lag {name}", "of", of), positive(f"lag {name}", "tau", tau))
        return held(name)

    def delay(self, name: str, of: Term, seconds: float) -> Term:
        """``of`` as it was ``seconds`` ago, in whole ticks; a number, because as many values are remembered."""
        self._take(name)
        if plain_number(f"delay {name}", "seconds", seconds) <= 0.0:
            raise FlowsheetError(f"delay {name}: {seconds!r} s must be more than 0 s, and have an end")
        made = self.lags[name] = Delay(name, operand(f"delay {name}", "of", of), seconds)
        return held(made.oldest)

    def hold(self, name: str, of: Term) -> Term:
        """``of`` as it is at the start of a tick, for the whole of it."""
        self._take(name)
        self.lags[name] = Hold(name, operand(f"hold {name}", "of", of))
        return held(name)

    def networks(self, network: Network) -> None:
        """Add a network of pipes; see :class:`homeostat.process.blocks.hydraulics.piping.Piping`."""
        self._take(network.name)
        self.lags[network.name] = network

    def named(self, name: str) -> str:
        """``name`` as that of a column, which no other part may have."""
        self._take(name)
        return name

    def memory(self, name: str, update: Callable[[Term], Term], start: float = 0.0, usual: float | None = None) -> Term:
        """A number that is kept; each tick it becomes ``update`` of what it was.

        A latch: ``memory("tripped", lambda was: where(level > "L_trip", 1.0, was))``. ``usual``: what it is taken to be
        where nothing tells, ``start`` where left out.
        """
        self._take(name)
        who, first = f"memory {name}", plain_number(f"memory {name}", "start", start)
        found = first if usual is None else plain_number(who, "usual", usual)
        self.memories[name] = Memory(name, first, operand(who, "update", update(held(name))), found)
        return held(name)

    def quantity(self, name: str, of: Term) -> Term:
        """Something of the true plant that results and totals may name though no instrument shows it."""
        self._take(name)
        self.quantities[name] = Quantity(name, operand(f"quantity {name}", "of", of))
        return self.quantities[name].of

    def switch(self, name: str, condition: Term) -> Term:
        """A switch of the plant, as of a dry pump: 1 where ``condition`` holds, which control may know, else 0."""
        self.quantity(name, where(condition, 1.0, 0.0))
        self.switches.add(name)
        return held(name)

    def total(self, name: str, unit: str, flow: Term) -> Term:
        """What ``flow`` [``unit`` per second] has added up to since the start."""
        made = self.state(name, unit, 0.0)
        self.rate(made, flow)
        return made

    def fault(self, name: str) -> Term:
        """Severity of a fault of the tables from its onset on, 0 before; it is 0 for ever where no table has it."""
        self._check(name, self.faults)
        self.faults[name] = fault(name)
        return self.faults[name]

    def growing(self, name: str, tau: Operand) -> Term:
        """A fault that grows into its severity with the time constant ``tau`` [s] from its onset on."""
        return self.fault(name) * (1.0 - exp(-Term(Leaf.AGE, value=name) / positive(f"fault {name}", "tau", tau)))

    def complete(self) -> dict[str, Term]:
        """State -> its rate of change per second; FlowsheetError where something is missing or comes from nowhere."""
        if not self.states or not self.sensors:
            raise FlowsheetError("a flowsheet needs a state and a sensor at least; add them")
        if lacking := [name for name in self.states if name not in self._rates]:
            raise FlowsheetError(f"state {lacking[0]} has no rate; say how it changes with rate(...) or a balance")
        rates = {name: self._rates[name]() for name in self.states}
        for each in self.controllers.values():
            if each.measured not in self.sensors:
                what = f"controller {each.name} reads {each.measured!r}, which no sensor shows"
                raise FlowsheetError(f'{what}; add FLOWSHEET.sensor("{each.measured}", ...), or correct the name')
        made = {*self.columns(), *self.sensors, *self.switches}
        for what, of in self._terms(rates):
            for leaf in leaves(of):
                if leaf.op in (Leaf.STATE, Leaf.HELD) and leaf.value not in made:
                    raise FlowsheetError(f"{what} uses {leaf.value!r}, which is not of this flowsheet")
                if leaf.op is Leaf.STATE and what.startswith(("controller", "actuator")):
                    raise FlowsheetError(f"{what} uses the true {leaf.value!r}; it can only know what a sensor shows")
        return rates

    def columns(self, tick_s: float = 1.0) -> Iterator[str]:
        """Columns of the states for a plant of this tick [s], but for those of sensors and quantities."""
        yield from self.states
        for a in self.actuators.values():
            yield from (*a.positions, a.command, f"{a.name}_rate", f"{a.name}_travel")
        for c in self.controllers.values():
            yield from (str(c.output.value), str(c.used.value), c.integral)
            if c.derivative:
                yield c.last
        yield from self.memories
        for each in self.lags.values():
            if isinstance(each, Network):
                yield from each.columns
            else:
                yield from each.columns(tick_s) if isinstance(each, Delay) else (each.name,)
        for d in self.disturbances.values():
            yield from (str(d.now.value), *([] if d.sd is None else [d.coloured]))

    def _terms(self, rates: dict[str, Term]) -> Iterator[tuple[str, Term]]:
        """Every term of the flowsheet, and what it is of."""
        yield from ((f"the rate of {name}", of) for name, of in rates.items())
        yield ("the number of steps in a tick", self.parts)
        for s in self.states.values():
            yield from ((f"the start of {s.name}", of) for of in (s.start, s.usual))
        for c in self.controllers.values():
            yield from ((f"controller {c.name}", of) for of in c.terms())
        for a in self.actuators.values():
            commanded = ZERO if a.automatic is None else a.automatic
            yield from ((f"actuator {a.name}", of) for of in (*a.lags, commanded, a.withheld))
        yield from ((f"controller {m.name}", m.update) for m in self.memories.values())
        yield from ((f"sensor {s.name}", of) for s in self.sensors.values() for of in (s.of, s.off))
        yield from ((f"quantity {q.name}", q.of) for q in self.quantities.values())
        for each in self.lags.values():
            made_of = each.terms if isinstance(each, Network) else (each.of,)
            yield from ((f"lag {each.name}", of) for of in made_of)

    def _take(self, name: str) -> None:
        """Give a column its name."""
        self._check(name, self._names)
        self._names.add(name)

    def _check(self, name: str, taken: Container[str]) -> None:
        """Refuse a name that is no name, or that something of its kind has."""
        kinds: dict[str, Container[str]] = {
            "a state": self.states, "an actuator": self.actuators, "a controller": self.controllers,
            "a lag, dead time or network": self.lags, "a memory": self.memories, "a disturbance": self.disturbances,
            "a sensor": self.sensors, "a quantity": self.quantities, "a fault": self.faults,
        }  # fmt: skip
        refuse_name(name, taken, kinds)
