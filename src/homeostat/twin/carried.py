"""How the twin carries fault sets: as columns that its model has equations of, and as moves beside them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from homeostat.domain.diagnosis import Effect, EffectKind, FaultMode, FaultState, Hypothesis
from homeostat.domain.plant.description import PlantDescription
from homeostat.process.effects import Effects
from homeostat.process.model import ProcessModel, column
from homeostat.process.moves import Move, MoveKind
from homeostat.process.types import Table, Vec
from homeostat.twin.history import Window

FaultSet: TypeAlias = tuple[FaultState, ...]
"""Faults that are assumed to be present together."""
WITH_95_PERCENT = 4.0
"""Standard deviations between the ends of what holds a normal value with 95 % [1]."""
GROWS_ON = 1.0
"""What grows goes on growing for this multiple of the time that it has, and no further than the tables let it [1].

How long something goes on of which nobody knows more than how long it has gone on is about as long again.
"""


@dataclass(frozen=True, slots=True)
class Carried:
    """Fault sets as the engine takes them."""

    severity: Table
    """Severities of the model's own faults, shape (members, faults)."""
    onset_s: Table
    """Their onsets [s], shape (members, faults)."""
    moves: tuple[tuple[Move, ...], ...]
    """What is moved beside them, for each member."""

    @property
    def moved(self) -> bool:
        """Whether anything is moved."""
        return any(self.moves)

    def repeated(self, count: int) -> Carried:
        """All of them ``count`` times, one after the other."""
        severity, onset = (np.tile(table, (count, 1)) for table in (self.severity, self.onset_s))
        return Carried(severity, onset, self.moves * count)


def shares(hypotheses: Sequence[Hypothesis]) -> Vec:
    """Probability of each among those that a twin can carry [1], shape (hypotheses,).

    That something else is wrong has a share only where nothing else is said: it is rolled out as a plant of which
    nothing is known, and what is not known to violate a limit must not make a risk look smaller.
    """
    other = all(h.something_else for h in hypotheses)
    found: Vec = np.array([h.probability * (other or not h.something_else) for h in hypotheses])
    found /= found.sum()
    return found


def scaled(faults: FaultSet, share: float) -> FaultSet:
    """``faults``, each ``share`` times as large as it is; none where that is 0."""
    return tuple(replace(f, severity=share * f.severity) for f in faults) if share else ()


def joined(each: Sequence[Carried]) -> Carried:
    """All of them, one after the other."""
    severity, onset = (np.vstack(tables) for tables in zip(*((c.severity, c.onset_s) for c in each), strict=True))
    return Carried(severity, onset, tuple(moves for c in each for moves in c.moves))


class Carrier:
    """Turns fault sets into columns and moves."""

    def __init__(self, model: ProcessModel, plant: PlantDescription) -> None:
        """``plant`` says how each fault mode that the model has no equation of acts on it."""
        self._model, self._effects = model, Effects(model, plant)
        self.modes: Mapping[str, FaultMode] = {mode.name: mode for mode in plant.fault_modes}
        """Name -> fault mode, generated ones included."""
        self._largest = _largest(plant.fault_modes)

    def carry(self, sets: Sequence[FaultSet], window: Window) -> Carried:
        """``sets`` as the engine takes them; a balance holds what the last readings of ``window`` say."""
        severity = np.zeros((len(sets), len(self._model.faults)))
        onset = np.full((len(sets), len(self._model.faults)), np.inf)
        moves: list[tuple[Move, ...]] = []
        for m, faults in enumerate(sets):
            own: list[Move] = []
            for fault in faults:
                effect = self.modes[fault.fault].effect
                if effect is None:
                    i = column(self._model.faults, fault.fault)
                    severity[m, i], onset[m, i] = fault.severity, fault.onset_s
                elif effect.kind is not EffectKind.UNSEEN:
                    own.append(
                        replace(self.move(effect, fault.severity, fault.onset_s, window), period_s=fault.period_s)
                    )
            moves.append(tuple(own))
        return Carried(severity, onset, tuple(moves))

    def off_by_one_sd(self, hypothesis: Hypothesis) -> list[FaultSet]:
        """The faults of ``hypothesis`` with the size of its one fault off by a standard deviation; none if it has none.

        It is off to the side on which the tables leave room.
        """
        if hypothesis.between is None:
            return []
        (fault,), (low, high) = hypothesis.faults, hypothesis.between
        sd, allowed = (high - low) / WITH_95_PERCENT, self.modes[fault.fault].severity_range
        if not sd > 0.0:  # it is known exactly
            return []
        sd = -sd if fault.severity + sd > allowed.high else sd
        return [(replace(fault, severity=fault.severity + sd),)]

    def is_stuck(self, fault: FaultState) -> bool:
        """Whether ``fault`` is an instrument that shows what it showed last."""
        effect = self.modes[fault.fault].effect
        return effect is not None and effect.kind is EffectKind.FROZEN

    def rate_per_unit(self, effect: Effect, window: Window) -> float:
        """Change of the effect's quantity for each unit of severity, per second for a balance; 0 where nobody knows."""
        return self._effects.per_unit(effect, {} if effect.capacity is None else window.at(-1))

    def shown(
        self, moves: Sequence[Move], says: Mapping[str, float], read: Mapping[str, float], at_s: float
    ) -> dict[str, float]:
        """Variable -> what an instrument shows that ``moves`` act on, where the model ``says`` something else.

        ``read`` is what was read last, which is what a stuck instrument shows.
        """
        found = {}
        for variable, shown in self._model.shown.items():
            for move in moves:
                if variable in says and move.column == shown and move.kind is MoveKind.READING:
                    found[variable] = says[variable] + float(move.change(at_s - move.onset_s))
                if variable in says and move.column == shown and move.kind is MoveKind.FROZEN:
                    found[variable] = read[variable]
        return found

    def move(self, effect: Effect, severity: float, onset_s: float, window: Window) -> Move:
        """What ``effect`` of this severity does from ``onset_s`` on [s]; what grows has an end."""
        made = self._effects.move(effect, severity * self.rate_per_unit(effect, window), onset_s)
        return replace(made, grown_s=self._grown_s(effect, severity, window.end_s - onset_s)) if made.grows else made

    def _grown_s(self, effect: Effect, severity: float, grew_s: float) -> float:
        """How long what grows does in all, that has for ``grew_s`` [s]."""
        rate, largest = abs(severity * effect.per_unit), self._largest.get((effect.kind, effect.quantity), np.inf)
        grew_s = max(grew_s, 0.0)
        most_s = largest / rate if rate > 0.0 else np.inf
        return max(min((1.0 + GROWS_ON) * grew_s, most_s), grew_s)


def _largest(modes: Iterable[FaultMode]) -> dict[tuple[EffectKind, str], float]:
    """(Kind, quantity) -> the largest lasting change that the tables have of it, in the effect's unit."""
    found: dict[tuple[EffectKind, str], float] = {}
    for mode in modes:
        if mode.effect is not None and not mode.effect.grows:
            key, allowed = (mode.effect.kind, mode.effect.quantity), mode.severity_range
            change = max(abs(allowed.low), abs(allowed.high)) * abs(mode.effect.per_unit)
            found[key] = max(found.get(key, 0.0), change)
    return found
