"""Agenda: what was asked, released and accepted before, and what is due because of it."""

from __future__ import annotations

from homeostat.agents.search.planning import EVENT
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.verdict import Released
from homeostat.recovery.plant_rules import Bounds
from homeostat.recovery.scene import FIRST_LOOK, Scene


class Agenda:
    """Remembers what recovery has done about the plant so far."""

    def __init__(self, scene: Scene, machine: StateMachine, bounds: Bounds) -> None:
        """``machine`` says when a batch is complete."""
        self._scene, self._machine = scene, machine
        self._every_step, self._intervention = bounds.every_step, bounds.intervention
        self._asked: tuple[str, float] | None = None
        self._released_s: float | None = None
        self._accepted: frozenset[str] = frozenset()

    @property
    def finished(self) -> bool:
        """Whether nothing but the fallback leads out of the present state: a batch that is complete."""
        return self._machine.is_end(self._scene.now.state, EVENT)

    @property
    def step_is_due(self) -> bool:
        """Whether every state is asked about, and this one was not yet, or a while ago in vain."""
        scene = self._scene
        if not self._every_step or len(scene.recent) < FIRST_LOOK or self.finished:
            return False
        if self._asked is None:
            return True
        state, at_s = self._asked
        in_vain = scene.now.way is None and scene.seen_s - at_s >= self._intervention.repeat_s
        return scene.now.state != state or in_vain

    def note_asked(self) -> None:
        """Proposers are asked about the present state now."""
        self._asked = self._scene.now.state, self._scene.seen_s

    @property
    def recovered(self) -> bool:
        """Whether something was released before."""
        return self._released_s is not None

    def calm(self, diagnosis: Diagnosis) -> bool:
        """Whether a plant in which all is well is not to be improved: no fault, or no release that has settled."""
        if not diagnosis.faulty or self._released_s is None:
            return True
        return self._scene.seen_s - self._released_s < self._intervention.calm_s

    def note_released(self, outcome: Released, diagnosis: Diagnosis) -> None:
        """``outcome`` was written because of ``diagnosis``; a step as usual is no recovery."""
        if diagnosis.faulty or not self._every_step:
            self._released_s = outcome.at_s

    @property
    def settled(self) -> bool:
        """Whether the batch is over, and safe with every symptom that there is: nothing is left to review."""
        return self.finished and self._symptoms <= self._accepted

    def note_accepted(self) -> None:
        """The plant is safe with the symptoms that are active now."""
        self._accepted = self._symptoms

    @property
    def _symptoms(self) -> frozenset[str]:
        """Names of the symptoms that are active."""
        return frozenset(s.rule for s in self._scene.agents.monitoring.symptoms)
