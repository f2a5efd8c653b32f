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
from homeostat.twin.calibration import Posterior
from homeostat.twin.carried import Carrier, FaultSet
from homeostat.twin.history import Window
from homeostat.twin.isolation.blind_beginning import begun
from homeostat.twin.isolation.classes import hypotheses
from homeostat.twin.isolation.evidence import Accuracy, Evidence
from homeostat.twin.isolation.prechecks import What, prechecks, shared
from homeostat.twin.isolation.search import Scored, Search

SELF_EVIDENT_NATS = 3.5
"""What speaks for an instrument or a controller being wrong that readings alone show to be [nats]."""


class Established:
    """Instruments and controllers that are wrong by their own evidence at the end of one window."""

    def __init__(self, window: Window, plant: PlantDescription, model: ProcessModel, carrier: Carrier, since_s: float):
        """``since_s``: when the first symptom was seen [s]; what is usual is learned from before."""
        findings = prechecks(window, plant, model, since_s)
        loops = {loop.manipulated_variable: loop.controller for loop in plant.loops}
        noisy = not shared(findings)  # what makes several scatter is in none of them
        every = [f for f in findings if noisy or f.what is not What.NOISY]
        named = [f"{loops[f.tag]}_wrong_law" if f.what is What.LAW else f"{f.tag}_{f.what}" for f in every]
        self.faults: FaultSet = tuple(FaultState(n, 1.0, f.since_s) for n, f in zip(named, every, strict=True))
        """As generated fault modes."""
        self._plant, self._model, self._carrier = plant, model, carrier
        self._items = {carrier.modes[f.fault].component for f in self.faults}
        tags = {f.tag: plant.variables[f.tag] for f in every if f.what is not What.LAW}
        self._shown = frozenset(tags.values())
        self._stuck = {f.tag: f.since_s for f in every if f.what is What.FROZEN}
        self._noisy = {tags[f.tag]: f.value for f in every if f.what is What.NOISY}

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
        stuck = {self._plant.variables[tag] for tag in self._stuck}
        return {symbol: variable for symbol, variable in usual.items() if variable not in stuck}

    def unseen(self, compared: Collection[str]) -> frozenset[str]:
        """Instruments that are stuck and that a replay goes by, because what they show is not ``compared``."""
        stuck = {f.fault for f in self.faults if self._carrier.is_stuck(f)}
        modes = [self._carrier.modes[name] for name in stuck]
        return frozenset(m.component for m in modes if m.effect is not None and m.effect.quantity not in compared)

    def leave_open(self, known: FaultSet, before: Sequence[Hypothesis], compared: Collection[str]) -> bool:
        """Whether others are looked for although they may be all that the readings need.

        Because some were ``known`` or said ``before``, or because what one of them that scatters shows is ``compared``:
        only all of its readings together say what moved.
        """
        said = any(h.faults for h in before if not h.something_else)
        return bool(known) or said or not self._noisy.keys().isdisjoint(compared)

    def explain(self, evidence: Evidence, faults: FaultSet) -> bool:
        """Whether ``faults`` are all that the readings of the other instruments need."""
        try:
            _, left = evidence.losses(evidence.residuals([faults]))
        except ProcessError:
            return False
        believed = [v not in self._shown for v in evidence.variables]
        return not evidence.fit((left[0].reshape(evidence.shape) * believed).ravel()).strained

    def seen(self, window: Window, posterior: Posterior, accuracy: Accuracy, known: FaultSet) -> Window:
        """``window`` without what they show while they are stuck, beside what is ``known``."""
        at_s = window.start_s + window.tick_s * np.arange(window.length)
        variables, held = self._plant.variables, dict(window.held)
        for tag, since_s in self._stuck.items():
            never = np.zeros(window.length, dtype=bool)
            held[variables[tag]] = held.get(variables[tag], never) | (at_s >= since_s)
        seen, noise = (
            replace(window, held=held),
            {v: e for v, (e, _) in accuracy.errors.items() if v not in self._shown},
        )
        for tag, since_s in self._stuck.items():
            if since_s <= window.at_s(window.settle_rows) and variables[tag] in accuracy.errors:
                present, what = self._carrier.carry([known], window), (variables[tag], self._plant.tag(tag).range)
                seen = begun(self._model, seen, posterior.mean, present, what, noise)
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
