"""A playbook in memory: read once, fitted to a plant, asked for what is near."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from homeostat.agents.hypotheses import plausible
from homeostat.agents.playbook.distance import FAR, Measure, Point, distance
from homeostat.agents.roles import Situation
from homeostat.domain.events.recovery import LaterStep
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.state_machine import StateMachine, Transition
from homeostat.domain.playbook import Answer, Entry, Occasion
from homeostat.domain.recovery import ActionSet, RecoveryPath, Step


@dataclass(frozen=True, slots=True)
class Known:
    """An answer that the plant's tables still have all the words for."""

    entry: Entry
    """Where it is from."""
    path: RecoveryPath
    """The path that it takes."""
    actions: ActionSet
    """The action set."""


class Book:
    """Entries of one plant, ready to be asked. Nothing in it waits for anything."""

    def __init__(self, entries: Sequence[Entry], plant: PlantDescription, sha256: str = "") -> None:
        """Those of ``entries`` that may be tried again; ``sha256`` is the digest of the file that they are from."""
        self.sha256 = sha256
        """Digest of the file as it was read."""
        self.troubles: tuple[str, ...] = ()
        """What does not fit the plant, a sentence each."""
        self._measure = Measure(plant)
        self._known: dict[tuple[str, str], list[tuple[Point, Known]]] = {}
        for entry in entries:
            if entry.answer is None or not entry.usable:
                continue
            try:
                point, known = self._measure.point(entry.occasion), _known(entry, entry.answer, plant)
            except ValueError as misfit:
                self.troubles += (f"the entry from {entry.source!r} does not fit the plant: {misfit}",)
                continue
            self._known.setdefault(point.kind, []).append((point, known))

    def __len__(self) -> int:
        """Entries that may be tried again."""
        return sum(map(len, self._known.values()))

    def near(self, situation: Situation) -> list[tuple[float, Known]]:
        """What is near ``situation``, each after its distance [1]; the nearest first, of equals the latest."""
        here = self._measure.point(self.occasion(situation))
        found = [(distance(here, point), known) for point, known in reversed(self._known.get(here.kind, ()))]
        return sorted(((d, known) for d, known in found if d <= FAR), key=lambda pair: pair[0])

    def occasion(self, situation: Situation) -> Occasion:
        """``situation`` as the playbook sees it."""
        setpoints = self._measure.setpoints(situation.snapshot)
        return Occasion(situation.state, "", plausible(situation.diagnosis), setpoints)

    def starts(self, situation: Situation, target: str) -> list[ActionSet]:
        """Commands that helped near ``situation`` and lead to ``target`` at once, for a search to begin with."""
        near = dict.fromkeys(known.actions for _, known in self.near(situation))
        return [actions for actions in near if actions.target == target and not actions.then]


def _known(entry: Entry, answer: Answer, plant: PlantDescription) -> Known:
    """ValueError where the plant does not have the answer's path or tags."""
    machine = plant.machine
    for command in (*answer.commands, *(c for step in answer.then for c in step.commands)):
        plant.tag(command.tag)
    by_name = {t.name: t for t in machine.transitions}
    if unknown := [step.transition for step in answer.then if step.transition not in by_name]:
        raise ValueError(f"state machine {machine.name!r} has no transition {unknown[0]!r}")
    awaited = [by_name[step.transition] for step in answer.then]
    states = answer.path[: len(answer.path) - len(awaited)]
    decided = [_decision(machine, *ends) for ends in pairwise(states)]
    path = RecoveryPath(machine, (*decided, *awaited))
    if (path.states, path.now) != (answer.path, answer.target) or path.states[0] != entry.occasion.state:
        raise ValueError(f"its steps do not take the path {' > '.join(answer.path)}")
    return Known(entry, path, ActionSet(answer.commands, answer.target, tuple(map(_step, answer.then, awaited))))


def _decision(machine: StateMachine, source: str, target: str) -> Transition:
    for t in machine.transitions:
        if t.on_decision and (t.source, t.target, t.event) == (source, target, machine.recovery_event):
            return t
    raise ValueError(f"state machine {machine.name!r} does not lead from {source!r} to {target!r} by decision")


def _step(told: LaterStep, transition: Transition) -> Step:
    return Step(transition, told.commands)
