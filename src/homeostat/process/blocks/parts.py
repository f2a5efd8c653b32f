"""What a flowsheet is made of: frozen records, and the names of the columns that each of them has."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from homeostat.process.blocks.term import ZERO, Leaf, Term


def held(name: str) -> Term:
    """The column ``name`` as it stands for a tick."""
    return Term(Leaf.HELD, value=name)


def fault(name: str) -> Term:
    """Severity of the fault ``name`` from its onset on, 0 before."""
    return Term(Leaf.FAULT, value=name)


@dataclass(frozen=True, slots=True)
class State:
    """What a balance is integrated of."""

    name: str
    unit: str
    start: Term
    """Where it stands at the start of a run, over parameters."""
    least: float | None
    """What it cannot fall below, in its unit."""
    usual: Term
    """Where it is taken to be where no instrument tells, over parameters."""

    @property
    def term(self) -> Term:
        """It, in an equation."""
        return Term(Leaf.STATE, value=self.name)


@dataclass(frozen=True, slots=True)
class Actuator:
    """A valve, a pump or a heater: it follows a command from 0 to 1 with first-order lags.

    du/dt = (command - u) / tau for each lag, exact for a command that is held for a tick.
    """

    name: str
    lags: tuple[Term, ...]
    """Time constants [s]: one for first order, two for second order."""
    automatic: Term | None
    """What commands it where nobody does by hand; None where it is commanded from outside only."""
    start: float
    """Opening [1] at the start of a run."""
    faults: Mapping[str, str]
    """``weak``, ``stuck_open`` or ``stuck_closed`` -> what the plant's tables call that fault, where otherwise."""
    withheld: Term = ZERO
    """What an override takes off its command, whoever gives that [1]."""

    @property
    def position(self) -> Term:
        """Where it is [1]."""
        return held(f"{self.name}_position")

    @property
    def opening(self) -> Term:
        """What it passes [1]: its position, less what it has lost of its capacity."""
        return self.position * (1.0 - fault(self.weak))

    @property
    def command(self) -> str:
        """Name of the command that reaches it."""
        return f"{self.name}_cmd"

    @property
    def manual(self) -> str:
        """Name of the input that commands it: by hand where it has an automatic."""
        return f"{self.name}_man" if self.automatic is not None else self.command

    @property
    def weak(self) -> str:
        """Fault: it has lost the share ``severity`` of its capacity."""
        return self.faults.get("weak", f"{self.name}_weak")

    @property
    def stuck_open(self) -> str:
        """Fault: it stays at ``severity`` of its travel."""
        return self.faults.get("stuck_open", f"{self.name}_stuck_open")

    @property
    def stuck_closed(self) -> str:
        """Fault: it stays at 1 - ``severity`` of its travel."""
        return self.faults.get("stuck_closed", f"{self.name}_stuck_closed")

    @property
    def positions(self) -> tuple[str, ...]:
        """Columns of its lags; the last one is its position."""
        return (*(f"{self.name}_lag{k}" for k in range(1, len(self.lags))), f"{self.name}_position")


@dataclass(frozen=True, slots=True)
class Law:
    """How a controller's output becomes a command, where that is more than the output itself."""

    least: Term = ZERO
    """Lowest output [1]."""
    beside: Term = ZERO
    """What is added to the output, as a feed-forward that the controller only trims [1]."""
    rests: Term | None = None
    """Condition under which something else commands and the integral term stays as it is; None for never."""
    held: Term | None = None
    """Condition under which its output is frozen, and goes on from where it is afterwards; None for never."""
    meanwhile: Term | None = None
    """What its output is while it is held, as another controller's output [1]; None: what it was."""

    @property
    def plain(self) -> bool:
        """Whether the output is the command, or one of several that the command is chosen among."""
        return replace(self, held=None, meanwhile=None) == Law()


@dataclass(frozen=True, slots=True)
class Controller:
    """A PI or PID controller: output = forward + Kp e + I + Kd de/dt, within 0 and 1; e = acts (reading - setpoint).

    dI/dt = Ki e unless the output is at a limit and the error drives it further out. Behind an output that something
    else decides (by hand, another controller that was selected) I follows, so that it is taken over without a bump.
    """

    name: str
    measured: str
    """Variable that it reads."""
    acts: int
    """1 where its output rises with the reading, -1 where it falls."""
    forward: Term
    """Feed-forward [1], over readings, inputs and parameters."""
    setpoint: Term | None
    """Where the setpoint comes from where nobody gives one (a ratio, another controller); None: from outside only."""
    derivative: bool
    law: Law

    @property
    def given(self) -> str:
        """Input: the setpoint from outside."""
        return f"{self.measured}_sp"

    @property
    def output(self) -> Term:
        """What it puts out [1]."""
        return held(f"{self.name}_out")

    @property
    def used(self) -> Term:
        """The setpoint that it follows, in the unit of what it reads."""
        return held(f"{self.name}_sp")

    @property
    def integral(self) -> str:
        """Column of its integral term [1]."""
        return f"{self.name}_integral"

    @property
    def last(self) -> str:
        """Column of the error before, where it has a derivative."""
        return f"{self.name}_last"

    def terms(self) -> tuple[Term, ...]:
        """What it is given beside its reading: feed-forward, setpoint, and what its law has."""
        law = self.law
        optional = [each for each in (self.setpoint, law.rests, law.held, law.meanwhile) if each is not None]
        return (self.forward, law.least, law.beside, *optional)

    def gain(self, kind: str) -> Term:
        """Its proportional (``Kp``), integral (``Ki``) or derivative (``Kd``) gain, a parameter."""
        return Term(Leaf.PARAMETER, value=f"{kind}_{self.name}")


@dataclass(frozen=True, slots=True)
class Lag:
    """A quantity that follows another one: dy/dt = (of - y) / tau, exact for what is held for a tick."""

    name: str
    of: Term
    tau: Term
    """Time constant [s]."""


@dataclass(frozen=True, slots=True)
class Delay:
    """A quantity as it was some seconds ago, as behind a long pipe."""

    name: str
    of: Term
    seconds: float

    @property
    def oldest(self) -> str:
        """Column of what it was then."""
        return f"{self.name}_0"

    def columns(self, tick_s: float) -> tuple[str, ...]:
        """Where it is remembered, once for each tick; the first is the oldest."""
        return tuple(f"{self.name}_{k}" for k in range(max(round(self.seconds / tick_s), 1)))


@dataclass(frozen=True, slots=True)
class Hold:
    """A quantity as it is at the start of a tick, which stays for that tick."""

    name: str
    of: Term


@dataclass(frozen=True, slots=True)
class Branch:
    """What lies between two places of a network."""

    name: str
    """Column of its flow [L/s]."""
    kind: float
    """As the solver knows it."""
    ends: tuple[Term, Term]
    """Junctions, or heads that are given [m]."""
    resistance: Term
    """In m/(L/s)^2."""
    pump: tuple[Term, Term, Term]
    """Of a pump: a [m], b [m/(L/s)] and speed [1]."""


@dataclass(frozen=True, slots=True)
class Network:
    """Pipes, valves and pumps that meet in junctions; flows follow from the heads at the start of a tick."""

    name: str
    junctions: list[str]
    """Columns of their heads [m]."""
    branches: list[Branch]

    @property
    def columns(self) -> tuple[str, ...]:
        """Heads, then flows."""
        return (*self.junctions, *(each.name for each in self.branches))

    def numbers(self) -> Iterator[tuple[Term | float, ...]]:
        """Of each branch what the solver takes, in its order."""
        heads = {held(name): float(i) for i, name in enumerate(self.junctions)}
        for each in self.branches:
            at = tuple(heads.get(end, -1.0) for end in each.ends)
            given = tuple(ZERO if end in heads else end for end in each.ends)
            yield (each.kind, *at, *given, each.resistance, *each.pump)

    @property
    def terms(self) -> tuple[Term, ...]:
        """What it follows from."""
        return tuple(each for row in self.numbers() for each in row if isinstance(each, Term))


@dataclass(frozen=True, slots=True)
class Memory:
    """A number that a rule gives anew each tick, before controllers act: a latch, a switch with hysteresis."""

    name: str
    start: float
    update: Term
    """What it becomes, over what was measured last, what is commanded, and itself."""
    usual: float
    """What it is taken to be where nothing tells."""


@dataclass(frozen=True, slots=True)
class Disturbance:
    """What comes from outside: a parameter and, where stated, coloured noise around it."""

    name: str
    """Symbol of the parameter that is its mean."""
    sd: Term | None
    """Standard deviation of the unfiltered noise, in its unit."""
    tau: Term | None
    """Time constant of its filter [s]."""
    measured: str | None
    """Variable whose reading says what it is."""

    @property
    def now(self) -> Term:
        """What it is in this tick."""
        return held(f"{self.name}_now")

    @property
    def coloured(self) -> str:
        """Column of its noise, in standard deviations."""
        return f"{self.name}_noise"

    @property
    def reading(self) -> str:
        """Input: what its instrument said, for a model that follows a record."""
        return f"{self.name}_in"


@dataclass(frozen=True, slots=True)
class Sensor:
    """A transmitter: reading = truth + bias + noise, or in shares of the truth."""

    name: str
    """Variable that it shows."""
    of: Term
    """What it measures."""
    relative: bool
    """Whether bias and noise are shares of the reading [1]."""
    step: float
    """Smallest difference that it shows, in its unit; 0 for none."""
    every_s: float
    """Seconds between two readings: an analyser has its time."""
    bias: Term
    """Calibration error, a parameter."""
    noise: Term
    """Standard deviation of its noise, a parameter."""
    off: Term
    """What faults of its own add to what it shows, in its unit."""

    @property
    def true(self) -> str:
        """Column of what is the case."""
        return f"{self.name}_true"

    @property
    def ideal(self) -> str:
        """Column of what it would show without noise."""
        return f"{self.name}_ideal"


@dataclass(frozen=True, slots=True)
class Quantity:
    """Something of the true plant that no instrument shows."""

    name: str
    of: Term
