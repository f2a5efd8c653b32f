"""Search: which faults that have an equation of their own explain the readings, of what size and since when."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from homeostat.domain.diagnosis import FaultMode, FaultState
from homeostat.process.types import Vec
from homeostat.twin.carried import FaultSet
from homeostat.twin.isolation.evidence import Evidence
from homeostat.twin.isolation.prior import Prior, Size, size_nats
from homeostat.twin.isolation.responses import FIRST_ROW

FINER = (1.0, 0.35, 0.12, 0.04, 0.015)
"""Steps of the grids around the best that was found, as multiples of a 24th of the range and 12 % of the age."""
STARTS = 3
"""Onsets around which each fault is refined: what is best on a coarse grid need not be near what is best [1]."""
SECOND_FAULT_NATS = 6.0
"""Gain in log-likelihood that a further fault must bring, over and above its prior [nats]."""
EMPTY: Mapping[str, Size] = MappingProxyType({})
"""No size of before."""
DECIMALS = 3
"""Of a score: what differs by less is alike, and the first of it is taken. Sums err in their last digits, and of onsets
that no reading tells apart each would be the best by chance."""
LEADERS = 3
"""Faults that are refined to the end: evidence grows with time, and with it what a coarse size costs."""


@dataclass(frozen=True, slots=True)
class Scored:
    """One explanation with its fit."""

    faults: FaultSet
    """What is assumed to be wrong."""
    score: float
    """Log posterior up to a constant [nats]."""
    course: FaultSet = ()
    """What was replayed where that is more than ``faults``: a disturbance that changed several times."""

    @property
    def replayed(self) -> FaultSet:
        """What was replayed."""
        return self.course or self.faults


class Search:
    """Tries sets of faults on the evidence of one window."""

    def __init__(
        self,
        evidence: Evidence,
        modes: Mapping[str, FaultMode],
        prior: Prior,
        known: FaultSet = (),
        had: Mapping[str, Size] = EMPTY,
    ) -> None:
        """``modes``: name -> fault mode, generated ones included; what was ``known`` may begin before the window.

        ``had``: sizes of what is older than the readings, which may say nothing of it any more.
        """
        self.known = known
        """What may begin before the window."""
        self._kept = {fault.onset_s for fault in known}
        self._had = had
        self._evidence, self._modes = evidence, modes
        self.prior = prior
        """Log priors."""
        self._end_s = evidence.window.end_s
        self._first_s = evidence.window.at_s(FIRST_ROW)
        self._tick_s = evidence.window.tick_s

    def score(self, sets: Sequence[FaultSet]) -> Vec:
        """Log posterior of each fault set up to a constant [nats], shape (len(sets),)."""
        prior = np.array([self.cost_of(faults) for faults in sets])
        return np.round(prior + self._evidence.likelihoods(sets), DECIMALS)

    def cost_of(self, faults: Sequence[FaultState]) -> float:
        """Log prior of all of ``faults`` together [nats]."""
        return sum(self._log_prior(f) for f in faults)

    def _log_prior(self, state: FaultState) -> float:
        """Of what began before the readings that size is expected that it had: else it is forgotten bit by bit."""
        mode = self._modes[state.fault]
        if state.fault in self._had and state.onset_s < self._first_s:
            return self.prior.of_mode(mode) - self._had[state.fault].nats(state.severity)
        if mode.listed:
            return self.prior.of_state(mode, state)
        if mode.sizeless:
            return self.prior.of_mode(mode)
        return self.prior.of_mode(mode) - float(size_nats(np.array(state.severity / mode.severity_nominal)))

    def singles(self, names: Sequence[str], onsets_s: Sequence[float]) -> list[Scored]:
        """Every named fault over a grid of severities and onsets, refined around its best."""
        inside = self._inside(onsets_s)
        if not names or not inside:
            return []
        grid: list[FaultSet] = [(f,) for name in names for f in self._grid(name, inside)]
        tried: list[Scored] = []
        best = self._best_per_fault(grid, lambda s: s[0].fault, tried)
        found: list[Scored] = []
        for number, scale in enumerate(FINER):
            refined = sorted(best.values(), key=lambda s: -s.score)[: None if number < 2 else LEADERS]
            refined = refined if number else _starts(tried)
            finer: list[FaultSet] = [(f,) for s in refined for f in self.around(s.faults[0], scale)]
            for name, scored in self._best_per_fault(finer, lambda s: s[0].fault, found).items():
                if scored.score > best[name].score:
                    best[name] = scored
        return found + list(best.values())

    def pairs(self, first: FaultState, names: Sequence[str], onsets_s: Sequence[float]) -> list[Scored]:
        """``first`` together with every named fault of another item, refined around the best; none where none is."""
        item, inside = self._modes[first.fault].component, self._inside(onsets_s)
        others = [n for n in names if self._modes[n].component != item]
        grid: list[FaultSet] = [(first, f) for name in others for f in self._grid(name, inside, severities=5)]
        if not grid:
            return []
        best = self._best_per_fault(grid, lambda s: s[1].fault)
        leader = max(best.values(), key=lambda s: s.score)
        found: list[Scored] = []
        finer: list[FaultSet] = [(first, b) for b in self.around(leader.faults[1], 0.7)]
        self._best_per_fault(finer, lambda s: s[1].fault, found)
        best_second = max([leader, *found], key=lambda s: s.score).faults[1]
        again: list[Scored] = []
        if self._modes[first.fault].effect is None:
            self._best_per_fault([(a, best_second) for a in self.around(first, 0.7)], lambda s: s[0].fault, again)
        return [*found, *again, leader]

    def joined(self, known: FaultSet, scored: Sequence[Scored]) -> list[Scored]:
        """Each of the single faults of ``scored`` together with what was ``known`` of other items."""
        together: dict[str, Scored] = {}
        for s in sorted((s for s in scored if len(s.faults) == 1), key=lambda s: s.score):
            together[s.faults[0].fault] = s
        items = {self._modes[f.fault].component: f for f in known}
        sets = [
            (*(f for item, f in items.items() if item != self._modes[name].component), *s.faults)
            for name, s in together.items()
        ]
        if not sets or not known:
            return []
        found = [Scored(s, score) for s, score in zip(sets, self.score(sets).tolist(), strict=True)]
        return [*found, *self.variations(max(found, key=lambda s: s.score).faults)]

    def variations(self, faults: FaultSet) -> list[Scored]:
        """``faults`` together, with each one's size and onset varied in turn."""
        if not faults:
            return []
        sets: list[FaultSet] = [faults]
        for k, fault in enumerate(faults):
            sets += [(*faults[:k], near, *faults[k + 1 :]) for near in self.around(fault, 0.35)]
        return [Scored(s, score) for s, score in zip(sets, self.score(sets).tolist(), strict=True)]

    def at_rest(self, stopped: Sequence[tuple[FaultSet, FaultSet]], nats: float) -> list[Scored]:
        """What grew and does so no more, and the best of it with other sizes.

        ``stopped``: what is there now, and what is replayed for it; ``nats``: what an end within the readings costs.
        """
        if not stopped:
            return []
        likelihoods = self._evidence.likelihoods([replayed for _, replayed in stopped])
        found = []
        for (faults, replayed), likelihood in zip(stopped, likelihoods.tolist(), strict=True):
            course = () if replayed == faults else replayed
            found.append(Scored(faults, self.cost_of(faults) + likelihood - (nats if course else 0.0), course))
        best = max(found, key=lambda s: s.score)
        return found if best.course else [*found, *self.variations(best.faults)]

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

    def _inside(self, onsets_s: Sequence[float]) -> list[float]:
        return [t for t in onsets_s if t >= self._first_s or t in self._kept]

    def _grid(self, name: str, onsets_s: Sequence[float], severities: int = 7) -> list[FaultState]:
        r = self._modes[name].severity_range
        sizes = sorted({*np.linspace(r.low, r.high, severities).tolist(), self._modes[name].severity_nominal})
        return [FaultState(name, s, t) for s in sizes for t in onsets_s]

    def around(self, centre: FaultState, scale: float) -> list[FaultState]:
        """A small grid around one state: severity in steps of its range, onset by shares of its age and by a tick.

        What has no equation of its own was estimated already, and when it began that is older than the readings they
        cannot say; its size alone is varied.
        """
        mode, step = self._modes[centre.fault], scale / 24.0
        r = mode.severity_range
        if mode.sizeless:
            return [centre]
        if mode.effect is not None:
            multiples = [centre.severity * (1.0 + 2.0 * k * scale * 0.1) for k in range(-3, 4)]
            allowed = sorted({r.clip(size) for size in multiples}) if mode.listed else multiples
            return [replace(centre, severity=size) for size in allowed]
        age, tick_s = max(self._end_s - centre.onset_s, 4.0 * self._tick_s), self._tick_s
        sizes = {r.clip(centre.severity + k * step * r.span) for k in range(-3, 4)}
        if centre.onset_s < self._first_s:
            return [replace(centre, severity=size) for size in sorted(sizes)]
        longest = max(self._end_s - self._first_s, tick_s)
        near = [age * (1.0 + k * scale * 0.12) for k in range(-2, 3)]
        near += [age - tick_s, age + tick_s] if scale > 0.3 else []
        lags = {float(np.clip(lag, tick_s, longest)) for lag in near}
        return [FaultState(centre.fault, s, self._end_s - lag) for s in sorted(sizes) for lag in sorted(lags)]


def _starts(tried: Sequence[Scored]) -> list[Scored]:
    """Of single faults that were ``tried`` over a grid, the best of each at onsets better than those beside them."""
    best: dict[str, dict[float, Scored]] = {}
    for each in tried:
        onsets, at_s = best.setdefault(each.faults[0].fault, {}), each.faults[0].onset_s
        if at_s not in onsets or each.score > onsets[at_s].score:
            onsets[at_s] = each
    found: list[Scored] = []
    for onsets in best.values():
        row = [onsets[at_s] for at_s in sorted(onsets)]
        scores = [-np.inf, *(each.score for each in row), -np.inf]
        peaks = [each for k, each in enumerate(row, 1) if scores[k - 1] < scores[k] >= scores[k + 1]]
        found += sorted(peaks, key=lambda each: -each.score)[:STARTS]
    return found


def charged(scored: Sequence[Scored], known: FaultSet) -> list[Scored]:
    """``scored`` with what each fault costs that is new beside others of what was ``known``."""
    before = {fault.fault for fault in known}
    found = []
    for each in scored:
        new = sum(fault.fault not in before for fault in each.faults)
        found.append(replace(each, score=each.score - SECOND_FAULT_NATS * min(new, max(len(each.faults) - 1, 0))))
    return found
