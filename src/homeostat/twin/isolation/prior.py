"""Prior: how likely a fault mode is before anything is seen, and of what size."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from homeostat.domain.diagnosis import EffectKind, FaultMode, FaultState
from homeostat.process.types import Indices, Vec
from homeostat.twin.history import Window

FAULT_NATS = 9.0
"""What a fault costs that is as frequent as the faults of the tables are on the mean [nats]."""
GENERATED_NATS = 2.0
"""What one costs besides that no table names [nats]."""
JUMPED_NATS = 5.0
"""What speaks for an instrument being wrong whose reading jumped as the tables say that the process cannot: that they
are wrong, and something else is at fault within the same minutes, is as rare as one look in 150 [nats]."""
MOVED_NATS = 3.0
"""What it costs that something moved whose instrument is stuck, and that a replay goes by: no fault need have moved it,
and more often than not it stays where it is for minutes [nats]."""
SWINGS_NATS = 6.0
"""What it costs that something swings, which may have any period and begin anywhere in its turn [nats]."""
STANDS_NATS = 5.0
"""What it costs that an actuator does not move at all: one that is slow pays for how slow it is, and looks the same
until it comes [nats]."""
JUMP = 60
"""Readings on either side of an onset whose means say what a transmitter has jumped by."""


def size_nats(relative: Vec) -> Vec:
    """What sizes cost that are ``relative`` to a large one [nats]: Cauchy, a scale that is known roughly.

    What is large follows from what a plant may be built with, not from what may befall it: a pipe that is ten times as
    narrow is rare and not impossible, which a normal distribution would have it. Check: 1 costs 0.7, 10 costs 4.6.
    """
    return np.asarray(2.0 * np.log(np.hypot(1.0, relative)))  # squares of what is absurdly large overflow


@dataclass(frozen=True, slots=True)
class Size:
    """What is known of the size of a fault from readings that are not looked at any more, in the fault's unit."""

    likeliest: float
    """What explained them best."""
    sd: float
    """Standard deviation of the true size from that, positive."""

    def nats(self, size: float) -> float:
        """What it costs that the fault is of another ``size`` now [nats]."""
        return float(size_nats(np.array((size - self.likeliest) / self.sd)))


def _most(mode: FaultMode) -> float:
    """Largest size of a generated mode that there can be, in its unit."""
    return math.inf if mode.effect is None else mode.effect.most


class Prior:
    """Log priors of the fault modes of one plant over one window."""

    def __init__(
        self,
        tables: Sequence[FaultMode],
        window: Window,
        compared: Sequence[str],
        calibrated: Mapping[str, str],
        jumped: Collection[str] = (),
        stuck: Collection[str] = (),
    ) -> None:
        """``calibrated``: parameter -> variable whose instrument it calibrates; ``compared``: variables that are.

        ``jumped``: instruments whose readings moved at once as the process cannot; ``stuck``: those that a replay goes
        by and that stand still.

        The readings of an instrument that are an input of the replay are predicted by nothing. If it begins to lie, its
        reading moves by the lie, unless what it measures moved the other way in the same moment, which nothing does.
        """
        frequency = [mode.prior for mode in tables]
        self._usual = float(np.mean(frequency)) if frequency else 1.0
        self._window, self._compared, self._calibrated = window, set(compared), calibrated
        self._jumped, self._stuck = jumped, stuck

    def of_state(self, mode: FaultMode, state: FaultState) -> float:
        """Log prior of a fault of the tables: its frequency relative to the others, and how unusual its size is."""
        spread = 0.25 * mode.severity_range.span
        return self.of_mode(mode) - 0.5 * ((state.severity - mode.severity_nominal) / spread) ** 2

    def of_mode(self, mode: FaultMode) -> float:
        """Log prior of a fault mode [nats], whatever its size."""
        if mode.component in self._stuck:
            return -MOVED_NATS
        at_once = mode.effect is None or mode.effect.lasts
        jumped = JUMPED_NATS if at_once and mode.component in self._jumped else 0.0
        if mode.effect is not None and mode.effect.swings:
            return -FAULT_NATS - GENERATED_NATS - SWINGS_NATS
        if mode.stands and not mode.listed:
            return -FAULT_NATS - GENERATED_NATS - STANDS_NATS
        if not mode.listed:
            return jumped - FAULT_NATS - GENERATED_NATS
        return jumped - FAULT_NATS + float(np.log(mode.prior / self._usual))

    def of_size(self, mode: FaultMode, rows: Indices) -> tuple[Vec, Vec]:
        """Mean and standard deviation of a generated mode's size at each onset, in rows of the window, (rows,) each.

        In the unit of its severity, positive where the quantity of its effect rises.
        """
        effect = mode.effect
        assert effect is not None, f"{mode.name} has an equation of its own"
        large = np.full(len(rows), mode.severity_nominal)
        variable = self._calibrated.get(effect.quantity) if effect.kind is EffectKind.PARAMETER else None
        if variable is None or variable in self._compared:
            return np.zeros(len(rows)), large
        jump, spread = self._jumps(variable, rows)
        if effect.grows:
            since = self._window.tick_s * np.maximum(self._window.length - rows, 1) / 2.0
            jump, spread = jump / since, spread / since
        return jump, np.minimum(spread, large)

    def cost_of_size(self, mode: FaultMode, sizes: Vec, rows: Indices) -> Vec:
        """What ``sizes`` of a generated mode cost that begin at ``rows`` [nats], both of shape (n,)."""
        mean, spread = self.of_size(mode, rows)
        relative = (sizes - mean) / spread
        seen = spread < mode.severity_nominal  # what its own reading has jumped by is no guess
        cost = np.where(seen, 0.5 * relative**2, size_nats(relative))
        return np.where(np.abs(sizes) > _most(mode), np.inf, cost)

    def of_name(self, fault: FaultMode, mode: FaultMode, state: FaultState) -> float:
        """What ``state`` of a generated ``mode`` gains by being the ``fault`` of the tables that is this mode [nats].

        Its frequency is known, and its size is what is usual of it, unless the readings say more of that.
        """
        rows = np.clip([self._window.row(state.onset_s)], 0, self._window.length - 2)
        _, spread = self.of_size(mode, rows)
        if spread[0] < mode.severity_nominal:
            return self.of_mode(fault) - self.of_mode(mode)
        guessed = float(self.cost_of_size(mode, np.array([state.severity]), rows)[0])
        return self.of_state(fault, state) - self.of_mode(mode) + guessed

    def _jumps(self, variable: str, rows: Indices) -> tuple[Vec, Vec]:
        """By how much the readings after each row are higher than those before, and how far that is from certain."""
        readings = self._window.readings[variable]
        around = [readings[max(row - JUMP, 0) : row + 1].mean() for row in rows.tolist()]
        after = [readings[row + 1 : row + 1 + JUMP].mean() for row in rows.tolist()]
        slow = np.convolve(readings, np.ones(JUMP) / JUMP, "valid") if len(readings) > JUMP else readings
        noise = float(np.std(np.diff(readings))) if len(readings) > 1 else 0.0
        spread = np.hypot(noise, float(np.std(slow[: max(len(slow) // 2, 1)])))
        return np.array(after) - np.array(around), np.full(len(rows), max(spread, 1e-9))
