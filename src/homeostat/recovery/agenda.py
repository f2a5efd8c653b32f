"""Agenda: what recovery remembers from one look at the plant to the next, and what is to be done because of it."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import Enum

from homeostat.domain.diagnosis import Diagnosis, Symptom
from homeostat.domain.events.deviations import Missed
from homeostat.domain.mode import Mode
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.verdict import Released
from homeostat.recovery.look.news import Look, is_news
from homeostat.recovery.plant_rules import Bounds
from homeostat.recovery.scene import Scene


@dataclass(frozen=True, slots=True)
class RecoveryMemory:
    """All that recovery remembers from one look at the plant to the next."""

    unanswered: bool = False
    """Whether something called for attention that was not thought through yet."""
    asked: tuple[str, float] | None = None
    """State about which proposers were asked last because every step is asked for, and when [s]."""
    released_s: float | None = None
    """When something was last released because of a fault or a deviation [s]."""
    accepted: frozenset[str] = frozenset()
    """Symptoms with which a batch that is over was found to be safe."""
    back_s: float | None = None
    """When the way back to ordinary operation is asked for next [s]; None where a fault is in the way, or nothing."""
    missed: Missed | None = None
    """What is missed for so long that an improvement is asked for; None where nothing is, or once it was thought of."""
    in_vain: Look | None = None
    """The look after which proposers found nothing, and the plant was left as it is; None where they were not asked."""
    unwritten: Mode | None = None
    """Mode in which what was found last was only advised, or a fallback only wanted; None where nothing was."""

    @property
    def recovered(self) -> bool:
        """Whether something was released before."""
        return self.released_s is not None


class Stance(Enum):
    """What is to be done about a plant that was looked at."""

    LEAVE = "It is left as it is: all is well, or proposers have found nothing before and nothing is new."
    AS_BEFORE = "It is left as it is: all that is seen has come and gone by itself, and is as it was."
    ACCEPT = "It is left as it is for good: the batch is over, and safe with these symptoms."
    IMPROVE = "It is left as it is unless something costs less."
    PREFER = "It is left as it is unless something is approved: a step is asked for, or the way back."
    ACT = "Something must be approved, or the fallback is to act."
    GIVE_UP = "The fallback is to act: the batch is over, and nobody can propose anything."

    @property
    def asks(self) -> bool:
        """Whether proposers are asked."""
        return self in (Stance.IMPROVE, Stance.PREFER, Stance.ACT)

    @property
    def may_be_left(self) -> bool:
        """Whether the plant is left as it is where nothing is released."""
        return self not in (Stance.ACT, Stance.GIVE_UP)


class Agenda:
    """Says what is due."""

    def __init__(self, machine: StateMachine, bounds: Bounds) -> None:
        """``machine`` says when a batch is complete."""
        self._machine, self._every_step, self._intervention = machine, bounds.every_step, bounds.intervention
        self._ordinary = machine.ordinary

    def finished(self, state: str) -> bool:
        """Whether nothing but the fallback leads out of ``state``: a batch that is complete."""
        return self._machine.is_end(state, self._machine.recovery_event)

    def settled(self, memory: RecoveryMemory, state: str, symptoms: Iterable[Symptom]) -> bool:
        """Whether the batch is over, and safe with every symptom that there is: nothing is left to review."""
        return self.finished(state) and {s.rule for s in symptoms} <= memory.accepted

    def step_is_due(self, memory: RecoveryMemory, scene: Scene) -> bool:
        """Whether every state is asked about, and this one was not yet, or a while ago in vain."""
        now = scene.now
        if not self._every_step or not scene.ready or self.finished(now.state):
            return False
        if memory.asked is None:
            return True
        state, at_s = memory.asked
        in_vain = now.way is None and now.now_s - at_s >= self._intervention.repeat_s
        return now.state != state or in_vain

    def way_back_is_due(self, memory: RecoveryMemory, scene: Scene) -> bool:
        """Whether nothing is wrong any more, and the plant is to go back to ordinary operation now."""
        return memory.back_s is not None and scene.seen_s >= memory.back_s

    def mode_is_raised(self, memory: RecoveryMemory, scene: Scene) -> bool:
        """Whether what was to be done and was not written may be by now: it is what the mode was raised for."""
        return memory.unwritten not in (None, scene.now.mode) and scene.now.mode.writes

    def after_diagnosis(self, memory: RecoveryMemory, diagnosis: Diagnosis, scene: Scene) -> RecoveryMemory:
        """What is remembered after a diagnosis: where all is over, a plant that was moved is to go back."""
        away = memory.recovered and scene.now.state not in self._ordinary and not self.finished(scene.now.state)
        if diagnosis.faulty or not away:
            return replace(memory, back_s=None)
        return memory if diagnosis.ended_s is None else replace(memory, back_s=scene.seen_s)

    def after_asking_back(self, memory: RecoveryMemory, scene: Scene) -> RecoveryMemory:
        """What is remembered once the way back is asked for: where it is not open yet, it is asked for again."""
        return replace(memory, back_s=scene.seen_s + self._intervention.back_s)

    def stance(self, memory: RecoveryMemory, look: Look, due: bool, deviates: bool, worthwhile: bool = True) -> Stance:
        """What is to be done after ``look``; ``due``: this state is to be asked about, ``deviates``: the batch does.

        ``worthwhile``: there is something to win by doing anything. A plant in which nothing is wrong, and everything
        that protects it holds, is left as it is also where it stands elsewhere than its state says: somebody moved it.
        So is one in which only what has come and gone by itself is seen: whatever explains the last of it, it was kept.
        What is missed for too long is improved where that costs less, also where nothing is wrong; where nothing else
        calls, no fallback acts for it.
        """
        if look.diagnosis.recurs is not None and not (due or deviates or self.finished(look.state)):
            return Stance.AS_BEFORE
        sound = look.harmless and not look.diagnosis.faulty and not deviates
        if (look.fine or sound) and not due and (not worthwhile or self._calm(memory, look)):
            return Stance.LEAVE
        if self.finished(look.state):
            return Stance.ACCEPT if look.fine or look.harmless else Stance.GIVE_UP
        called = due or deviates or look.diagnosis.faulty or look.diagnosis.symptoms
        if not (look.fine or (memory.recovered and look.harmless) or (memory.missed and not called)):
            return Stance.ACT
        if self._every_step and look.fine and not due:
            return Stance.LEAVE  # proposers are asked when a step is due
        news = due or deviates or memory.in_vain is None or is_news(look, memory.in_vain)
        if not news:
            return Stance.LEAVE
        return Stance.PREFER if due else Stance.IMPROVE

    def after_release(self, memory: RecoveryMemory, released: Released, diagnosis: Diagnosis) -> RecoveryMemory:
        """What is remembered once ``released`` was written because of ``diagnosis``; a usual step is no recovery."""
        usual = self._every_step and not diagnosis.faulty
        return replace(memory, in_vain=None, released_s=memory.released_s if usual else released.at_s)

    def _calm(self, memory: RecoveryMemory, look: Look) -> bool:
        """Whether a plant in which all is well is not to be improved.

        Nothing is wrong or missed, or a release has not settled.
        """
        if not look.diagnosis.faulty and memory.missed is None:
            return True
        return memory.released_s is not None and look.at_s - memory.released_s < self._intervention.calm_s
