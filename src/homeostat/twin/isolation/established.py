"""Established: what is wrong by its own evidence joins what is known, and anything else is looked for beside it.

A thermometer that stands still, one that scatters, and a controller with a wrong gain show it without a twin. That
explains their own readings and nothing more: a leak that begins meanwhile shows in the others. They are compared with a
twin that does not believe the accused instrument: from when it is stuck its readings are held, and one that scatters
counts as little as its noise makes it.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.plant.description import PlantDescription
from homeostat.process.batch import ProcessError
from homeostat.process.model import ProcessModel
from homeostat.process.types import Vec
from homeostat.twin.calibration import Posterior
from homeostat.twin.carried import Carrier, FaultSet
from homeostat.twin.history import Window
from homeostat.twin.isolation.blind_beginning import begun
from homeostat.twin.isolation.classes import hypotheses
from homeostat.twin.isolation.evidence import BLOCK, Accuracy, Evidence
from homeostat.twin.isolation.prechecks import What, prechecks, shared
from homeostat.twin.isolation.search import Scored, Search

SELF_EVIDENT_NATS = 3.5
"""What speaks for an instrument or a controller being wrong that readings alone show to be [nats]."""
CLEAR = 0.7
"""Standard deviation of what noise leaves of the mean of a block, at most [usual noise]: two or three of them are seen
in a block, so that they exceed what a right explanation leaves more easily than single readings do."""


class Established:
    """Instruments and controllers that are wrong by their own evidence."""

    def __init__(
        self,
        faults: FaultSet,
        scatter: Mapping[str, float],
        plant: PlantDescription,
        model: ProcessModel,
        carrier: Carrier,
    ) -> None:
        """``faults``: as generated fault modes; ``scatter``: variable -> multiple of its noise, where it scatters."""
        self.faults = faults
        """They, as generated fault modes."""
        self._noisy, self._plant, self._model, self._carrier = scatter, plant, model, carrier
        self._items = {carrier.modes[f.fault].component for f in faults}
        effects = [(carrier.modes[f.fault].effect, f.onset_s) for f in faults if carrier.is_stuck(f)]
        self._stuck = {effect.quantity: onset_s for effect, onset_s in effects if effect is not None}
        self._tags = {variable: tag for tag, variable in plant.variables.items() if variable in self._stuck}

    def others(self, faults: FaultSet) -> FaultSet:
        """Those of ``faults`` that are of other items."""
        return tuple(f for f in faults if not self._is_theirs(f))

    def without(self, said: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
        """What was ``said`` of other items."""
        return tuple(h if h.something_else else replace(h, faults=self.others(h.faults)) for h in said)

    def told(self, said: Sequence[Hypothesis]) -> bool:
        """Whether all of them are in the likeliest of what was ``said``."""
        best = next((h.faults for h in said if not h.something_else), ())
        return self._items <= {self._carrier.modes[f.fault].component for f in best}

    def alone(self, evidence: Evidence, search: Search, known: FaultSet, misled: float) -> tuple[Hypothesis, ...]:
        """They beside what was ``known`` of other items; a fault of the tables where that says as much.

        Of an instrument that repeats itself no other fault does so than one that makes it repeat itself. ``misled``:
        share of cases in which the list of causes misleads [1].
        """
        modes, alike, first = self._carrier.modes, list[FaultState](), self.faults[0]
        if len(self.faults) == 1:
            tables = (f for f in self._plant.faults if f.component in self._items)
            alike = [FaultState(f.name, f.severity_nominal, first.onset_s) for f in tables]
        effect = modes[first.fault].effect
        if effect is not None and self._carrier.is_stuck(first):
            alike = [state for state in alike if evidence.repeats(effect.quantity, (*known, state))]
        sets: list[FaultSet] = [(*known, *self.faults), *((*known, state) for state in alike)]
        scored = [Scored(s, score) for s, score in zip(sets, search.score(sets).tolist(), strict=True)]
        none = max(s.score for s in scored) - SELF_EVIDENT_NATS
        return hypotheses(scored, none, modes, misled=misled)

    def as_named(self, best: FaultSet) -> FaultSet:
        """As ``best`` names them, which explains the readings of all: of one that repeats itself, as the tables do."""
        stuck = all(self._carrier.is_stuck(f) for f in self.faults)
        return tuple(f for f in best if self._is_theirs(f)) if stuck else self.faults

    def accuracy(self, usual: Accuracy) -> Accuracy:
        """The ``usual`` accuracy, with the noise of those that scatter as it is now."""
        errors = {v: (noise * self._noisy.get(v, 1.0), error) for v, (noise, error) in usual.errors.items()}
        return replace(usual, errors=errors)

    def calibrated(self, usual: Mapping[str, str]) -> dict[str, str]:
        """Parameter -> variable whose instrument it calibrates, but for those that are stuck.

        By how much they jumped says nothing of their error: what they measure has moved, and they did not.
        """
        return {symbol: variable for symbol, variable in usual.items() if variable not in self._stuck}

    def unseen(self, compared: Collection[str]) -> frozenset[str]:
        """Instruments that are stuck and that a replay goes by, because what they show is not ``compared``."""
        modes = (self._carrier.modes[f.fault] for f in self.faults if self._carrier.is_stuck(f))
        return frozenset(m.component for m in modes if m.effect is not None and m.effect.quantity not in compared)

    def leave_open(self, known: FaultSet, said: Sequence[Hypothesis]) -> bool:
        """Whether others were ``known``, or ``said`` beside them: they are asked about whatever the readings need.

        What was said without them may have been said for want of them.
        """
        return bool(known) or any(0 < len(self.others(h.faults)) < len(h.faults) for h in said)

    def hide(self, compared: Collection[str]) -> bool:
        """Whether what one of them that scatters shows is ``compared``: it is looked at with another accuracy."""
        return not self._noisy.keys().isdisjoint(compared)

    def explain(self, evidence: Evidence, faults: FaultSet) -> bool:
        """Whether ``faults`` are all that the other readings need, and on the mean those that scatter.

        ``evidence`` as they are seen beside these, with their :meth:`accuracy`.
        """
        try:
            left = evidence.left(evidence.residuals([faults]))
        except ProcessError:
            return False
        table = left[0].reshape(evidence.shape)
        for j, variable in enumerate(evidence.variables):
            if variable in self._stuck:
                table[:, j] = 0.0
            elif variable in self._noisy:
                table[:, j] = _on_the_mean(table[:, j], self._noisy[variable])
        return not evidence.fit(table.ravel()).strained

    def seen(self, window: Window, posterior: Posterior, accuracy: Accuracy, known: FaultSet) -> Window:
        """``window`` without what they show while they are stuck, beside what is ``known``."""
        at_s, held = window.start_s + window.tick_s * np.arange(window.length), dict(window.held)
        for variable, since_s in self._stuck.items():
            held[variable] = held.get(variable, np.zeros(window.length, dtype=bool)) | (at_s >= since_s)
        believed = {v: e for v, (e, _) in accuracy.errors.items() if v not in self._stuck and v not in self._noisy}
        seen = replace(window, held=held) if self._stuck else window
        for variable, since_s in self._stuck.items():
            if since_s <= window.at_s(window.settle_rows) and variable in accuracy.errors:
                stuck = variable, self._plant.tag(self._tags[variable]).range
                present = self._carrier.carry([known], window)
                seen = begun(self._model, seen, posterior.mean, present, stuck, believed)
        return seen

    def joined(self, found: Sequence[Hypothesis], named: FaultSet, known: FaultSet) -> tuple[Hypothesis, ...]:
        """What was ``found`` beside them, together with them as they are ``named``; what was ``known`` comes first.

        What was found of their items is what they are: faults of one item exclude each other.
        """
        order, shares = {f.fault: k for k, f in enumerate(known)}, dict[FaultSet, float]()
        for each in found:
            every = each.faults if each.something_else else (*named, *self.others(each.faults))
            faults = tuple(sorted(every, key=lambda f: order.get(f.fault, len(order))))
            shares[faults] = shares.get(faults, 0.0) + each.probability
        return tuple(Hypothesis(f, p) for f, p in sorted(shares.items(), key=lambda each: -each[1]))

    def _is_theirs(self, fault: FaultState) -> bool:
        return self._carrier.modes[fault.fault].component in self._items


def _on_the_mean(left: Vec, scatter: float) -> Vec:
    """What is ``left`` of readings whose noise is ``scatter`` times the usual one, in that noise, shape (n,).

    The mean of a block of it, in multiples of the usual noise where it tells so little: in those of its own no block of
    single readings stands out of it that a cause shifts by less.
    """
    count = min(BLOCK, len(left))
    mean = np.convolve(left, np.full(count, 1.0 / count), "same")
    return np.asarray(mean * min(scatter, count**0.5 * CLEAR))


def established(
    window: Window, plant: PlantDescription, model: ProcessModel, carrier: Carrier, since_s: float, known: FaultSet
) -> Established:
    """What is wrong by its own evidence at the end of ``window``.

    ``since_s``: when the first symptom was seen [s]; what is usual is learned from before. An instrument that was
    ``known`` to be stuck before the window is so since then.
    """
    findings = prechecks(window, plant, model, since_s)
    loops = {loop.manipulated_variable: loop.controller for loop in plant.loops}
    noisy = not shared(findings)  # what makes several scatter is in none of them
    every = [f for f in findings if noisy or f.what is not What.NOISY]
    named = [f"{loops[f.tag]}_wrong_law" if f.what is What.LAW else f"{f.tag}_{f.what}" for f in every]
    faults = tuple(FaultState(name, 1.0, f.since_s) for name, f in zip(named, every, strict=True))
    stuck_s = {f.fault: f.onset_s for f in known if carrier.is_stuck(f)}
    faults = tuple(replace(f, onset_s=min(f.onset_s, stuck_s.get(f.fault, f.onset_s))) for f in faults)
    scatter = {plant.variables[f.tag]: f.value for f in every if f.what is What.NOISY}
    return Established(faults, scatter, plant, model, carrier)
