"""A site of many modules, simulated side by side and coupled through shared headers (:mod:`benchmarks.scale.headers`).

Modules and headers take turns: for a block of some seconds every module meets what its headers were at the block's
beginning; then the headers follow from what the modules took. One module, the live one, may be simulated elsewhere,
under its own supervisor; it meets the same headers, and they meet its loads.
"""

from __future__ import annotations

import copy
import time
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmarks.scale.coupling import draw, heat, impose
from benchmarks.scale.fleet import fleets
from benchmarks.scale.headers import DESIGN_DRAW, DESIGN_T, flow_factor, supply_temperature
from benchmarks.scale.plant_graph import GROUP, group_of
from homeostat.plants.plant import Plant
from homeostat.process.model import ProcessModel
from homeostat.process.types import Table, Vec

BLOCK_S = 5
"""Time between two looks at the headers [s]."""


class Site:
    """Fault-free modules with their headers, and a place for one live module among them."""

    def __init__(
        self, cases: Mapping[str, Plant], kinds: Sequence[str], seeds: Sequence[int], live: int | None = None,
        coupled: bool = True,
    ) -> None:  # fmt: skip
        """Start every module: ``kinds`` and ``seeds`` of each, counted from 1; not ``coupled``: headers never change.

        ``live``: number of the module that is simulated elsewhere; None for none.
        """
        self._kinds, self._live, self._coupled = tuple(kinds), live, coupled
        self.fleets = fleets(cases, kinds, seeds, GROUP, live)
        """The modules that are simulated here, by plant."""
        groups = np.array([group_of(k) for k in range(1, len(kinds) + 1)]) - 1
        self._group = groups
        self._groups = int(groups[-1]) + 1
        self._reactors = self._sum(groups, np.array([float(k == "cstr") for k in kinds]))
        self._design = self._sum(groups, np.array([DESIGN_DRAW[k] for k in kinds]))
        self.supply_t = np.full(self._groups, DESIGN_T)
        """Temperature of the cooling water of each group [K]."""
        self.factor = np.ones(self._groups)
        """Flow of an open valve on each feed main as a share of that at full pressure [1]."""
        self.now_s = 0.0
        """Process time of the modules that are simulated here [s]."""
        self.spent_s = 0.0
        """Wall-clock time that the simulation of the neighbours took so far [s]."""
        self.spent_cpu_s = 0.0
        """Processor time of all threads for the same [s]."""
        self._live_own: Table | None = None

    def run(self, seconds: int) -> None:
        """Let ``seconds`` pass where there is no live module; a multiple of the block."""
        for _ in range(seconds // BLOCK_S):
            self._advance(None, None)

    def join(self, model: ProcessModel) -> ProcessModel:
        """``model`` for the live module's plant: as it is, but with the site around it."""
        joined = copy.copy(model)
        joined.kernel = partial(self._kernel, model)
        return joined

    def _kernel(self, model: ProcessModel, *arguments: Any) -> None:
        """Advance the live module; at the end of each block its neighbours and the headers first.

        The arguments are those of :class:`homeostat.process.batch.Kernel`.
        """
        state, parameters, at_s = arguments[2], arguments[3], arguments[8]
        if self._live_own is None:
            self._live_own = parameters.copy()
        if at_s >= self.now_s + BLOCK_S:
            self._advance(state, parameters)
        model.kernel(*arguments)

    def _advance(self, live: Table | None, live_parameters: Table | None) -> None:
        """One block of the neighbours, then the headers, then what they are to each module."""
        began, busy = time.perf_counter(), time.process_time()
        for fleet in self.fleets:
            fleet.advance(BLOCK_S)
        self.now_s += BLOCK_S
        if self._coupled:
            self._follow_loads(live, live_parameters)
            for fleet in self.fleets:
                mine = self._group[np.array(fleet.modules) - 1]
                warmer = self.supply_t[mine] - DESIGN_T
                impose(fleet.case.name, fleet.parameters, fleet.own, warmer, self.factor[mine])
            if self._live is not None and live_parameters is not None and self._live_own is not None:
                here = self._group[[self._live - 1]]
                impose(
                    self._kinds[self._live - 1], live_parameters, self._live_own, self.supply_t[here] - DESIGN_T,
                    self.factor[here],
                )  # fmt: skip
        self.spent_s += time.perf_counter() - began
        self.spent_cpu_s += time.process_time() - busy

    def _follow_loads(self, live: Table | None, live_parameters: Table | None) -> None:
        """Headers after a block with the present loads."""
        loads = [(f.case.name, np.array(f.modules), f.state, f.parameters) for f in self.fleets]
        if self._live is not None and live is not None and live_parameters is not None:
            loads.append((self._kinds[self._live - 1], np.array([self._live]), live, live_parameters))
        taken, drawn = np.zeros(self._groups), np.zeros(self._groups)
        for kind, modules, state, parameters in loads:
            groups = self._group[modules - 1]
            taken += self._sum(groups, heat(kind, state, parameters))
            drawn += self._sum(groups, draw(kind, state))
        self.supply_t = supply_temperature(self.supply_t, taken, self._reactors, BLOCK_S)
        self.factor = flow_factor(drawn, self._design)

    def _sum(self, groups: np.ndarray, values: Vec) -> Vec:
        """Sum of ``values`` in each group, shape (groups,)."""
        return np.bincount(groups, values, minlength=self._groups).astype(np.float64)
