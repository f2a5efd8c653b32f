"""What the checks share: the plant, its courses, and the noise that its instruments have; simulated once each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar, final

import numpy as np

from homeostat.domain.diagnosis import FaultMode, FaultState
from homeostat.domain.plant.baseline import Baseline
from homeostat.evaluate.lint.deep.course import Act, Course, Setting, run
from homeostat.evaluate.lint.places import Places
from homeostat.plants.files.baselines import learned_from, read_baselines
from homeostat.plants.files.folder import BASELINES
from homeostat.plants.files.generated import baseline_sources
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.teaching.learning import learn
from homeostat.process.types import Vec

T = TypeVar("T")
RUNS = 16
"""Fault-free runs from which reference values are learned for a check, where the plant has none of its own."""
SEEDS = (1, 2)
"""Seeds of the fault-free courses with noise and with true parameters of their own."""


@final
class Bench:
    """One plant on the test bench."""

    def __init__(self, folder: Path, told: Callable[[str], None] = lambda text: None) -> None:
        """``told`` hears what is being done, in a few words."""
        self.folder, self.told = folder, told
        self._kept: dict[str, Any] = {}

    def kept(self, name: str, make: Callable[[], T]) -> T:
        """What ``make`` makes, made once under this ``name``."""
        if name not in self._kept:
            self._kept[name] = make()
        found: T = self._kept[name]
        return found

    @cached_property
    def plant(self) -> Plant:
        """The plant without its reference values."""
        return load_plant(str(self.folder), learned=False, kept=False)

    @cached_property
    def places(self) -> Places:
        """Where its tables state what."""
        return Places(self.folder)

    @cached_property
    def baselines(self) -> Mapping[str, Baseline]:
        """Feature -> its reference values; from a few runs where they are missing or stale. Raises PlantError."""
        content = self.plant.files.contents.get(BASELINES)
        if content is None or learned_from(content) != baseline_sources(self.plant):
            found = learn(self.plant, RUNS, lambda done, of: self.told(f"reference values, {done} of {of} runs"))
            return {baseline.feature: baseline for baseline in found}
        return read_baselines(content, self.plant.description)

    @cached_property
    def nominal(self) -> Vec:
        """The best estimates of the parameters, shape (parameters,)."""
        return self.plant.true_parameters(SEEDS[0], spread=0.0)

    @cached_property
    def quiet(self) -> Course:
        """The fault-free plant by its best estimates, without noise."""
        return run(self.plant, Setting(self.nominal))

    @cached_property
    def noisy(self) -> tuple[Course, ...]:
        """Fault-free plants as they may truly be, with noise; one for each of :data:`SEEDS`."""
        plant = self.plant
        return tuple(run(plant, Setting(plant.true_parameters(seed), 1.0, seed)) for seed in SEEDS)

    @cached_property
    def sheltered(self) -> Course:
        """The first of :attr:`noisy` with the noise of its instruments alone: nothing varies outside."""
        return run(self.plant, Setting(self.plant.true_parameters(SEEDS[0]), 1.0, SEEDS[0], wandering=0.0))

    @property
    def onset_s(self) -> float:
        """When faults begin: as in the plant's runs, but not before it has settled, if it does [s]."""
        settled_s = self.quiet.settled_s
        return max(self.plant.onset_s, settled_s) if settled_s < 0.8 * self.plant.end_s else self.plant.onset_s

    def faulty(self, fault: FaultMode, severity: float, noise: float = 0.0) -> Course:
        """The plant with ``fault`` of a ``severity`` from :attr:`onset_s` on, nobody acting."""
        self.told(f"fault {fault.name}")

        def make() -> Course:
            return self.acted((FaultState(fault.name, severity, self.onset_s),), noise)

        if noise:  # it is looked at once, and a course takes room
            return make()
        return self.kept(f"{fault.name} {severity}", make)

    def acted(
        self,
        faults: tuple[FaultState, ...],
        noise: float = 0.0,
        act: Act = lambda seen: None,
        end_s: float | None = None,
    ) -> Course:
        """The plant by its best estimates with ``faults``, and with what ``act`` carries out, until ``end_s`` [s]."""
        return run(self.plant, Setting(self.nominal, noise, faults=faults, end_s=end_s), act)

    @cached_property
    def noise(self) -> Mapping[str, float]:
        """Tag -> standard deviation of its reading in operation, in its unit: what noise adds to the truth."""
        course, found = self.noisy[0], {}
        late = course.after(course.settled_s if course.settled_s < course.truth.times_s[-1] else 0.0)
        for signal in self.plant.description.signals:
            off = (course.read(signal.tag.name) - course.true(signal.tag.name))[late]
            found[signal.tag.name] = float(np.std(off)) if np.isfinite(off).all() and off.size else 0.0
        return found
