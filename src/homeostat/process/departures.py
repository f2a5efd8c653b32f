"""How a true plant departs from its process model: what stands before an actuator and behind an instrument (compiled).

A kernel of a true plant has the states and parameters of the process model first, and these after them, so that every
column of the model keeps its place. Neutral values leave the model's own bits.

    actuator    command -> dead time -> first-order lag -> stiction -> the model's actuator
    instrument  true value -> damping -> noise of another law -> factor -> offset -> resolution -> reading

Stiction: the actuator goes on to what it was told last until it is told something that differs from that by more than
its band, and then goes there, all the way.
Noise: e' = c e'_before + sqrt(1 - c^2) e, of the same variance as the white e of the model; now and then ten times it.
Check: c = 0.6 and a white e of 0.5 K keep 0.5 K, of which one reading and the next share 60 %.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from homeostat.process.compiled import compiled
from homeostat.process.equipment import lag_share
from homeostat.process.noise import uniform
from homeostat.process.types import Vec

LONGEST_DEAD_S: Final = 30
"""Longest dead time that is kept [s]."""
RING: Final = LONGEST_DEAD_S + 1
OUTLIER: Final = 10.0
"""How many times its usual noise an outlier is [1]."""
BEFORE_ACTUATOR: Final = ("dead_s", "lag_s", "stiction")
"""Parameters of what stands before an actuator: seconds, seconds, and share of its travel."""
BEHIND_INSTRUMENT: Final = ("offset", "gain", "noise", "frozen", "damping_s", "resolution")
"""Parameters of what stands behind an instrument: in its unit, factors, whether [0 or 1], seconds, in its unit."""
NOISE_LAW: Final = ("coloured", "outliers")
"""Parameters of every instrument's noise: correlation from one second to the next, and share of outliers."""
ACTUATOR_STATES: Final = 3 + RING
INSTRUMENT_STATES: Final = 4
_NEUTRAL: Final = {"gain": 1.0, "noise": 1.0}


@dataclass(frozen=True, slots=True)
class Departures:
    """Names of the columns that a true plant has more than its process model."""

    actuators: Sequence[str]
    """Components whose commands are departed from, in the kernel's order."""
    instruments: Sequence[str]
    """Variables whose readings are, in the kernel's order."""
    structure: Sequence[str] = ()
    """Parameters of the plant's own; 0 is neutral."""

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters: noise law, actuators, instruments, structure."""
        before = [f"{name} {what}" for name in self.actuators for what in BEFORE_ACTUATOR]
        behind = [f"{name} {what}" for name in self.instruments for what in BEHIND_INSTRUMENT]
        return (*NOISE_LAW, *before, *behind, *self.structure)

    @property
    def states(self) -> int:
        """Number of states: actuators, then instruments; those of the structure follow."""
        return len(self.actuators) * ACTUATOR_STATES + len(self.instruments) * INSTRUMENT_STATES

    def begin(self, shown: Sequence[float]) -> list[float]:
        """States at the start, where the instruments show ``shown``."""
        rest = [number for reading in shown for number in (reading, 0.0, reading, reading)]
        return [0.0] * (len(self.actuators) * ACTUATOR_STATES) + rest

    def neutral(self) -> list[float]:
        """Parameters with which the plant is its model."""
        return [_NEUTRAL.get(name.rpartition(" ")[2], 0.0) for name in self.parameters]


@compiled
def reached(command: float, x: Vec, s: int, p: Vec, q: int, dt: float) -> float:
    """What of ``command`` reaches an actuator after ``dt`` [s] more.

    ``s``: its first state: lagged command, seconds so far, what it goes to, and the last commands; ``q``: its first
    parameter.
    """
    if x[s + 1] == 0.0:
        x[s] = x[s + 2] = command
        for i in range(RING):
            x[s + 3 + i] = command
    x[s + 1] += dt
    newest = math.floor(x[s + 1] + 0.5) % RING
    x[s + 3 + newest] = command
    dead = min(math.floor(p[q]), LONGEST_DEAD_S)
    late = x[s + 3 + (newest + RING - dead) % RING]
    if p[q + 1] > 0.0:
        late = x[s] + lag_share(p[q + 1], dt) * (late - x[s])
    x[s] = late
    if abs(late - x[s + 2]) > p[q + 2]:
        x[s + 2] = late
    return float(x[s + 2])


@compiled
def restore(x: Vec, columns: tuple[int, ...], s: int) -> None:
    """Give each instrument back what it showed before anything was done to it: a stuck one keeps its reading."""
    for i in range(len(columns)):
        x[columns[i]] = x[s + INSTRUMENT_STATES * i + 2]


@compiled
def show(
    x: Vec, columns: tuple[int, ...], ideal: Vec, s: int, p: Vec, q: int, law: int, seed: int, second: int
) -> None:
    """Turn the model's readings in ``columns`` into what the instruments show.

    ``ideal``: the model's readings without noise, shape (instruments,), in place what they show without noise. ``s``:
    first state of the first instrument: damped, coloured error, the model's reading, what was shown; ``q``: its first
    parameter; ``law``: first parameter of the noise law.
    """
    colour, rate = p[law], p[law + 1]
    for i in range(len(columns)):
        own, to = s + INSTRUMENT_STATES * i, q + len(BEHIND_INSTRUMENT) * i
        offset, gain, noisy = p[to], p[to + 1], p[to + 2]
        frozen, damping, resolution = p[to + 3], p[to + 4], p[to + 5]
        raw = x[columns[i]]
        error = raw - ideal[i]
        x[own + 1] = colour * x[own + 1] + math.sqrt(1.0 - colour * colour) * error
        x[own + 2] = raw
        value, shown = ideal[i], raw
        if damping > 0.0:
            value = x[own] + lag_share(damping, 1.0) * (ideal[i] - x[own])
        x[own] = value
        if damping > 0.0 or colour > 0.0 or noisy != 1.0 or rate > 0.0:
            wild = OUTLIER if uniform(seed, second, 32 + i) < rate else 1.0
            shown = value + noisy * wild * x[own + 1]
        shown, ideal[i] = gain * shown + offset, gain * value + offset
        if resolution > 0.0:
            shown = resolution * math.floor(shown / resolution + 0.5)
        if frozen > 0.0:
            shown = ideal[i] = x[own + 3]
        x[columns[i]] = shown
        x[own + 3] = shown
