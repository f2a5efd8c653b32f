"""The modules of one plant on a site, simulated side by side as the members of one batch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.process.batch import Batch, simulate
from homeostat.process.model import column
from homeostat.process.seeds import Stream, noise_seed
from homeostat.process.sequence import Guard, InputSequence, Walk
from homeostat.process.types import Table, Vec
from homeostat.stl.formula import Formula

STAGGER_S = 23.0
"""Time by which neighbours begin their batches one after the other [s]."""
BATCHES = 40
"""Batches that a module runs one after the other: more than any run of the study has time for."""


@dataclass
class Fleet:
    """Fault-free modules of one plant, which run as by design."""

    case: Plant
    """What they are copies of."""
    modules: tuple[int, ...]
    """Their numbers on the site."""
    seeds: tuple[int, ...]
    """What each of them truly is."""
    starts_s: Vec
    """When each begins its first batch [s]."""

    def __post_init__(self) -> None:
        """Put every module where its plant starts."""
        model = self.case.model
        self.own = np.array([self.case.true_parameters(seed) for seed in self.seeds])
        """Parameters of each without its neighbours, shape (members, parameters)."""
        members = len(self.modules)
        noise = [noise_seed(seed, Stream.TRUTH_NOISE) for seed in self.seeds]
        self._now_s = 0.0
        self._batch = Batch(
            state=np.array([model.initial_state(row) for row in self.own]), parameters=self.own.copy(),
            severity=np.zeros((members, len(model.faults))), onset_s=np.full((members, len(model.faults)), np.inf),
            inputs=self.case.start[None, None], input_of=np.zeros(members, dtype=np.int64), start_s=0.0, steps=1,
            stride=1, record=(), seeds=np.array(noise, dtype=np.int64),
            process_noise=np.ones(members), sensor_noise=np.ones(members),
        )  # fmt: skip
        self._walk = Walk(model, [self._recipe], self._batch.input_of, self.case.start, self._batch.state)

    @property
    def state(self) -> Table:
        """Present states, shape (members, states)."""
        return self._batch.state

    @property
    def parameters(self) -> Table:
        """Present parameters, which the headers change in place, shape (members, parameters)."""
        return self._batch.parameters

    def advance(self, seconds: int) -> None:
        """Let ``seconds`` pass: at once where nothing waits for an instrument, else second by second."""
        stride = 1 if self._recipe.guards else seconds
        for _ in range(0, seconds, stride):
            inputs = np.repeat(self._walk.advance()[:, None], stride, axis=1)
            step = replace(
                self._batch, inputs=inputs, input_of=np.arange(len(self.modules)), start_s=self._now_s, steps=stride
            )
            state = simulate(self.case.model.kernel, step, self.case.model.states.__getitem__).state
            self._batch = replace(self._batch, state=state)
            self._now_s += stride
            self._walk.look(state)

    @cached_property
    def _recipe(self) -> InputSequence:
        """Batch after batch of the nominal route; one step without end for what has nothing to do but start up."""
        model, variables = self.case.model, self.case.description.variables
        route = new_sequencer(self.case).rest().then
        route = route if len(route) > 1 else ()
        targets = np.full((1 + len(route), len(model.inputs)), np.nan)
        rates = np.full_like(targets, np.inf)
        for k, step in enumerate(route, start=1):
            for c in step.commands:
                i = column(model.inputs, variables[c.tag])
                targets[k, i] = np.nan if c.value is None else c.value
                rates[k, i] = np.inf if c.rate is None else c.rate
        guards = [self._guard(s.transition.guard) for s in route]
        again = [k for _ in range(BATCHES if route else 0) for k in range(1, len(targets))]
        return InputSequence(
            targets[[0, *again]], rates[[0, *again]], tuple(self._begins if k == 1 else guards[k - 1] for k in again)
        )

    def _begins(self, shown: Mapping[str, Vec]) -> NDArray[np.bool_]:
        """Whether each module's time to begin has come."""
        return self.starts_s < self._now_s

    def _guard(self, formula: Formula) -> Guard:
        variables = {tag: self.case.description.variables[tag] for tag in formula.tags}
        return lambda shown: formula.holds_each({tag: shown[v] for tag, v in variables.items()})


def fleets(
    cases: Mapping[str, Plant], kinds: Sequence[str], seeds: Sequence[int], group: int, live: int | None
) -> list[Fleet]:
    """One fleet per plant that occurs, of all modules but ``live``; modules are counted from 1."""
    found = []
    for kind, plant in cases.items():
        mine = tuple(k for k, other in enumerate(kinds, start=1) if other == kind and k != live)
        if mine:
            starts = np.array([STAGGER_S * ((k - 1) % group) for k in mine])
            found.append(Fleet(plant, mine, tuple(seeds[k - 1] for k in mine), starts))
    return found
