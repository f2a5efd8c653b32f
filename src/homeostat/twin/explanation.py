"""Explanation: which faults, of what size and since when, make the model agree with the readings."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from homeostat.domain.diagnosis import FaultMode, FaultState, Hypothesis
from homeostat.process.model import ProcessModel
from homeostat.process.types import Table, Vec
from homeostat.twin.calibration import Posterior
from homeostat.twin.history import Window
from homeostat.twin.replay import fault_columns, replay

TEMPER = 3.0
"""Evidence is divided by this: the model's errors are neither quite constant nor quite white."""
SECOND_FAULT_NATS = 4.0
"""Gain in log-likelihood that a second fault must bring, over and above its prior."""
REPAIRED_NATS = 5.0
"""What an explanation loses for each fault that was known and that it has no place for."""
SETTLED = 15
"""Readings that say where a variable started from."""
LEAST_PROBABILITY = 0.03
"""Faults below this are dropped."""
LAGS_S = (2, 4, 6, 9, 13, 18, 25, 35, 50, 70, 100, 140, 190, 250, 320, 400, 490, 590)
"""Onsets that are tried first, seconds before the last reading."""
DENSE_LAGS_S = (*range(2, 30, 2), *range(30, 121, 3))
"""The same where a fault may have gone unnoticed for a while: its onset is a narrow valley between coarse ones."""


FaultSet: TypeAlias = tuple[FaultState, ...]
"""Faults that are assumed to be present together."""


@dataclass(frozen=True, slots=True)
class Accuracy:
    """How well a model that is right predicts readings."""

    errors: Mapping[str, tuple[float, float]]
    """Variable -> standard deviations of noise per reading and of the model, in its unit."""
    gain: float
    """Share of what a reading has moved by to which that is predicted at best [1]."""


@dataclass(frozen=True, slots=True)
class Scored:
    """One explanation with its fit."""

    faults: tuple[FaultState, ...]
    """What is assumed to be wrong."""
    score: float
    """Log posterior up to a constant [nats]."""


class FaultIsolation:
    """Scores fault sets by replaying the readings, all in one call of the engine per round."""

    def __init__(
        self,
        model: ProcessModel,
        window: Window,
        posterior: Posterior,
        accuracy: Accuracy,
        faults: Sequence[FaultMode],
        known: Sequence[FaultState] = (),
    ) -> None:
        """``known`` is what was probably wrong before; the model's response to its parameters depends on it.

        A gain has an error because flows add up to levels, and so do their errors.
        """
        errors = accuracy.errors
        self._model = model
        self._window = window
        self._posterior = posterior
        self._variables = tuple(errors)
        self._noise = np.array([n for n, _ in errors.values()])
        self._bias = np.array([e for _, e in errors.values()])
        self._faults = {f.name: f for f in faults}
        self._seen = np.stack([window.readings[v][1:] for v in self._variables], axis=1)
        moved = self._seen - np.mean(self._seen[:SETTLED], axis=0)
        self._spread = np.hypot(self._noise, accuracy.gain * moved)
        known_rows = np.ones(self._seen.shape)
        for j, v in enumerate(self._variables):
            if v in window.held:
                known_rows[:, j] = ~window.held[v][1:]
        self._counts = known_rows
        self._directions = self._nuisance_directions(tuple(known)) * known_rows.reshape(-1, 1)
        self._inner = np.eye(self._directions.shape[1]) + self._directions.T @ self._directions

    def score(self, sets: Sequence[tuple[FaultState, ...]]) -> Vec:
        """Log posterior of each fault set up to a constant [nats], shape (len(sets),)."""
        members = np.tile(self._posterior.mean, (len(sets), 1))
        run = replay(self._model, self._window, members, fault_columns(self._model, list(sets)), self._variables)
        # Residual = constant model error + what parameters may be wrong by + white noise, all normal; all but the noise
        # is integrated out: r' (I + D D')^-1 r with the directions D.
        # The loss is bounded: one wild reading, or a second fault, must not decide everything.
        # In place: what was predicted may be tens of megabytes.
        misfit = run.predicted
        misfit -= self._seen
        misfit /= self._spread
        misfit *= self._counts  # a reading that was not there says nothing
        misfit = np.clip(misfit, -12.0, 12.0, out=misfit).reshape(len(sets), -1)
        along = misfit @ self._directions
        explained_away = (along * np.linalg.solve(self._inner, along.T).T).sum(axis=1)
        loss = np.square(misfit, out=misfit).sum(axis=1) - explained_away
        prior = np.array([sum(self._log_prior(f) for f in s) for s in sets])
        return np.asarray(prior - 0.5 * loss / TEMPER)

    def _nuisance_directions(self, known: FaultSet) -> Table:
        """Directions in which readings may differ although nothing new is wrong, shape (readings, k), in spreads.

        A constant model error of each variable, and one standard deviation of each parameter that is still uncertain:
        what was not learned in healthy operation, as the loss to the ambient of a plant that was never idle, is no sign
        of a fault.
        """
        root = self._posterior.root
        members = np.vstack([self._posterior.mean, self._posterior.mean + root.T])
        present = fault_columns(self._model, [known] * len(members))
        predicted = replay(self._model, self._window, members, present, self._variables).predicted / self._spread
        parameters = (predicted[1:] - predicted[0]).reshape(root.shape[1], -1).T
        constant = np.zeros((*self._seen.shape, len(self._variables)))
        for j in range(len(self._variables)):
            constant[:, j, j] = self._bias[j] / self._noise[j]
        return np.hstack([constant.reshape(-1, len(self._variables)), parameters])

    def _log_prior(self, state: FaultState) -> float:
        """Relative frequency of the fault and how far the severity is from the typical one."""
        fault = self._faults[state.fault]
        spread = 0.25 * fault.severity_range.span
        return float(np.log(0.3 * fault.prior) - 0.5 * ((state.severity - fault.severity_nominal) / spread) ** 2)

    def singles(self, names: Sequence[str], onsets_s: Sequence[float]) -> list[Scored]:
        """Every named fault over a grid of severities and onsets, refined twice around its best."""
        found: list[Scored] = []
        grid: list[FaultSet] = [(f,) for name in names for f in self._grid(name, onsets_s)]
        best = self._best_per_fault(grid, lambda s: s[0].fault)
        for scale in (1.0, 0.35):
            finer: list[FaultSet] = [(f,) for s in best.values() for f in self._around(s.faults[0], scale)]
            for name, scored in self._best_per_fault(finer, lambda s: s[0].fault, found).items():
                if scored.score > best[name].score:
                    best[name] = scored
        return found + list(best.values())

    def pairs(self, first: FaultState, names: Sequence[str], onsets_s: Sequence[float]) -> list[Scored]:
        """``first`` together with every other named fault, refined around the best."""
        others = [n for n in names if n != first.fault]
        grid: list[FaultSet] = [(first, f) for name in others for f in self._grid(name, onsets_s, severities=5)]
        best = self._best_per_fault(grid, lambda s: s[1].fault)
        leader = max(best.values(), key=lambda s: s.score)
        finer: list[FaultSet] = [(first, b) for b in self._around(leader.faults[1], 0.7)]
        found: list[Scored] = []
        self._best_per_fault(finer, lambda s: s[1].fault, found)
        best_second = max([leader, *found], key=lambda s: s.score).faults[1]
        again: list[Scored] = []
        self._best_per_fault([(a, best_second) for a in self._around(first, 0.7)], lambda s: s[0].fault, again)
        return [*found, *again, leader]

    def remembered(self, known: FaultSet, scored: Sequence[Scored]) -> list[Scored]:
        """``scored`` in the light of what was ``known`` before, as it was and together with every single fault.

        Faults do not mend themselves: what was known needs no coincidence, and an explanation without it needs one.
        Otherwise a fault would be forgotten as soon as it cannot be seen, as fouling without feed.
        """
        if not known:
            return list(scored)
        together: dict[str, Scored] = {}
        for s in sorted((s for s in scored if len(s.faults) == 1), key=lambda s: s.score):
            together[s.faults[0].fault] = s
        sets = [(*(f for f in known if f.fault != name), *s.faults) for name, s in together.items()]
        joined = [Scored(s, score) for s, score in zip(sets, self.score(sets).tolist(), strict=True)]
        more = [*self.variations(known), *joined, *self.variations(max(joined, key=lambda s: s.score).faults)]
        return [Scored(s.faults, s.score + sum(self._memory(k, s.faults) for k in known)) for s in (*scored, *more)]

    def _memory(self, known: FaultState, faults: FaultSet) -> float:
        """What an explanation gains by keeping a ``known`` fault, or loses by dropping it [nats].

        It is kept where it began nearer to when it was thought to than to now.
        """
        began = next((f.onset_s for f in faults if f.fault == known.fault), np.inf)
        if began <= 0.5 * (known.onset_s + self._window.end_s):
            return -float(np.log(0.3 * self._faults[known.fault].prior))
        return -REPAIRED_NATS

    def variations(self, faults: FaultSet) -> list[Scored]:
        """``faults`` together, with each one's size and onset varied in turn."""
        sets: list[FaultSet] = [faults]
        for k, fault in enumerate(faults):
            sets += [(*faults[:k], near, *faults[k + 1 :]) for near in self._around(fault, 0.35)]
        return [Scored(s, score) for s, score in zip(sets, self.score(sets).tolist(), strict=True)]

    def _best_per_fault(
        self, sets: Sequence[FaultSet], key: Callable[[FaultSet], str], keep: list[Scored] | None = None
    ) -> dict[str, Scored]:
        """The best of ``sets`` for each name that ``key`` gives; every scored set is appended to ``keep``."""
        scores = self.score(sets)
        best: dict[str, Scored] = {}
        for faults, score in zip(sets, scores.tolist(), strict=True):
            scored = Scored(tuple(faults), score)
            if keep is not None:
                keep.append(scored)
            name = key(faults)
            if name not in best or score > best[name].score:
                best[name] = scored
        return best

    def _grid(self, name: str, onsets_s: Sequence[float], severities: int = 7) -> list[FaultState]:
        r = self._faults[name].severity_range
        sizes = sorted({*np.linspace(r.low, r.high, severities).tolist(), self._faults[name].severity_nominal})
        return [FaultState(name, s, t) for s in sizes for t in onsets_s]

    def _around(self, centre: FaultState, scale: float) -> list[FaultState]:
        """A small grid around one state: severity in steps of the range, onset in proportion to its age."""
        r = self._faults[centre.fault].severity_range
        age = max(self._window.end_s - centre.onset_s, 4.0)
        sizes = {r.clip(centre.severity + k * scale * r.span / 24.0) for k in range(-3, 4)}
        lags = {max(age * (1.0 + k * scale * 0.12), 1.0) for k in range(-2, 3)}
        return [FaultState(centre.fault, s, self._window.end_s - lag) for s in sorted(sizes) for lag in sorted(lags)]


def hypotheses(scored: Sequence[Scored], none_score: float) -> tuple[Hypothesis, ...]:
    """Scored explanations as weighted hypotheses.

    Each fault set keeps its best explanation and those that bound its severities at about two standard deviations
    (2 nats below the best); its probability is shared among them.
    """
    groups: dict[str, list[Scored]] = {}
    for s in scored:
        groups.setdefault("+".join(sorted(f.fault for f in s.faults)), []).append(s)
    peak = {name: max(g, key=lambda s: s.score) for name, g in groups.items()}
    top = max([none_score, *(p.score for p in peak.values())])
    weight = {name: float(np.exp(p.score - top)) for name, p in peak.items()}
    total = sum(weight.values()) + float(np.exp(none_score - top))
    result: list[Hypothesis] = []
    for name, group in groups.items():
        share = weight[name] / total
        if share < LEAST_PROBABILITY:
            continue
        close = [s for s in group if s.score >= peak[name].score - 2.0]
        chosen = [peak[name]]
        for extreme in (min(close, key=_size), max(close, key=_size)):
            if abs(_size(extreme) - _size(peak[name])) > 1e-3 * abs(_size(peak[name])):
                chosen.append(extreme)
        result += [Hypothesis(s.faults, share * w) for s, w in zip(chosen, _shares(len(chosen)), strict=True)]
    nothing = float(np.exp(none_score - top)) / total
    if nothing >= LEAST_PROBABILITY:
        result.append(Hypothesis((), nothing))
    return tuple(sorted(result, key=lambda h: -h.probability))


def _size(scored: Scored) -> float:
    return sum(f.severity for f in scored.faults)


def _shares(count: int) -> tuple[float, ...]:
    return {1: (1.0,), 2: (0.7, 0.3), 3: (0.6, 0.2, 0.2)}[count]


def explain(
    whole: FaultIsolation,
    recent: FaultIsolation,
    candidates: Sequence[str],
    every: Sequence[str],
    known: Sequence[FaultState],
    end_s: float,
    dense: bool = False,
) -> tuple[Hypothesis, ...]:
    """Explanations of the readings: single faults among ``candidates``, and a second one where one does not do.

    Args:
        whole: scores over the whole window.
        recent: scores over its end, where a second fault is looked for.
        candidates: faults that the symptoms indicate.
        every: all known faults, tried as the second one.
        known: what was probable before; its onsets are tried as well, and it is not forgotten without a reason.
        end_s: process time of the last reading [s].
        dense: whether onsets are tried at :data:`DENSE_LAGS_S` as well.
    """
    lags = [end_s - lag for lag in {*LAGS_S, *(DENSE_LAGS_S if dense else ())}]
    none = float(whole.score([()])[0]) - REPAIRED_NATS * len(known)
    scored = whole.singles(candidates, sorted({*lags, *(f.onset_s for f in known)}))
    best = max(scored, key=lambda s: s.score)
    if len(known) > 1:
        return hypotheses(whole.remembered(tuple(known), scored), none)
    doubles = recent.pairs(best.faults[0], every, [end_s - lag for lag in LAGS_S[:12:2]])
    gain = max(d.score for d in doubles) - float(recent.score([best.faults])[0])
    if gain > SECOND_FAULT_NATS:
        sets = [d.faults for d in doubles]
        again = whole.score(sets).tolist()
        scored = [*scored, *(Scored(s, value) for s, value in zip(sets, again, strict=True))]
    return hypotheses(whole.remembered(tuple(known), scored), none)
