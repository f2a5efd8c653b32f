"""A playbook in memory: read once, fitted to a plant, asked for what is near."""

import math
from collections.abc import Container, Hashable, Iterable, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise

from homeostat.agents.hypotheses import plausible
from homeostat.agents.playbook.distance import FAR, Measure, Point, distance
from homeostat.agents.roles import Situation
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.playbook import Answer, Entry, Occasion
from homeostat.domain.recovery import ActionSet, RecoveryPath, Step

STARTS = 8
"""Entries that a search begins with at most: it looks around each."""


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
    """Entries of one plant, ready to be asked. Nothing in it waits; one thread may add while others ask."""

    def __init__(self, entries: Sequence[Entry], plant: PlantDescription, sha256: str = "") -> None:
        """Those of ``entries`` that may be tried again; ``sha256`` is the digest of the file that they are from."""
        self.sha256 = sha256
        """Digest of the file as it was read."""
        self.troubles: tuple[str, ...] = ()
        """What does not fit the plant, a sentence each."""
        self._measure, self._fitting = Measure(plant), _Fitting(plant)
        self._known: dict[tuple[str, str], list[tuple[Point, Known]]] = {}
        self._failed: dict[tuple[str, str], list[tuple[Point, str]]] = {}
        for entry in entries:
            self.add(entry)

    def add(self, entry: Entry) -> None:
        """Know of ``entry``, too, where there is an answer in it that fits the plant."""
        if entry.answer is None:
            return
        try:
            point, known = self._measure.point(entry.occasion), self._fitting.known(entry, entry.answer)
        except ValueError as misfit:
            self.troubles += (f"the entry from {entry.source!r} does not fit the plant: {misfit}",)
            return
        if entry.usable:
            self._known.setdefault(point.kind, []).append((point, known))
        else:
            self._failed.setdefault(point.kind, []).append((point, known.actions.digest))

    def __len__(self) -> int:
        """Entries that may be tried again."""
        return sum(map(len, self._known.values()))

    def near(self, situation: Situation) -> list[tuple[float, Known]]:
        """What is near ``situation``, each after its distance [1]; the nearest first, of equals the latest.

        What failed as near as it helped, or nearer, is left out with every entry that commands the same. Nothing is
        near a situation that the tables have no words for: whoever asks goes on without.
        """
        try:
            here = self._measure.point(self.occasion(situation))
        except ValueError:
            return []
        found = [(distance(here, point), known) for point, known in reversed(self._known.get(here.kind, ()))]
        failed: dict[str, float] = {}
        for point, digest in self._failed.get(here.kind, ()):
            failed[digest] = min(distance(here, point), failed.get(digest, math.inf))
        near = ((d, known) for d, known in found if d <= FAR and d < failed.get(known.actions.digest, math.inf))
        return sorted(near, key=lambda pair: pair[0])

    def occasion(self, situation: Situation) -> Occasion:
        """``situation`` as the playbook sees it."""
        setpoints = self._measure.setpoints(situation.snapshot)
        return Occasion(situation.state, "", plausible(situation.diagnosis), setpoints)

    def starts(self, situation: Situation, target: str) -> list[ActionSet]:
        """Commands that helped near ``situation`` and lead to ``target`` at once, for a search to begin with."""
        near = (known.actions for _, known in self.near(situation))
        there = (actions for actions in near if actions.target == target and not actions.then)
        return list(dict.fromkeys(islice(there, STARTS)))


class _Fitting:
    """Makes of an entry what the plant's tables still have all the words for."""

    def __init__(self, plant: PlantDescription) -> None:
        self._plant, self._tags = plant, frozenset(tag.name for tag in plant.tags)
        event = plant.machine.recovery_event
        self._by_name = {t.name: t for t in plant.machine.transitions}
        self._decided = {
            (t.source, t.target): t for t in plant.machine.transitions if t.on_decision and t.event == event
        }

    def known(self, entry: Entry, answer: Answer) -> Known:
        """ValueError where the plant does not have the answer's path or tags."""
        commands = [*answer.commands, *(c for step in answer.then for c in step.commands)]
        self._check("tag", (c.tag for c in commands), self._tags)
        self._check("transition", (step.transition for step in answer.then), self._by_name)
        awaited = [self._by_name[step.transition] for step in answer.then]
        ends = list(pairwise(answer.path[: len(answer.path) - len(awaited)]))
        self._check("decision from one to the other of the states", ends, self._decided)
        path = RecoveryPath(self._plant.machine, (*(self._decided[each] for each in ends), *awaited))
        if (path.states, path.now) != (answer.path, answer.target) or path.states[0] != entry.occasion.state:
            raise ValueError(f"its steps do not take the path {' > '.join(answer.path)}")
        if not self._plant.machine.state(path.target).recovery_target:
            raise ValueError(f"no recovery may end in {path.target!r}")
        steps = tuple(Step(transition, told.commands) for told, transition in zip(answer.then, awaited, strict=True))
        return Known(entry, path, ActionSet(answer.commands, answer.target, steps))

    def _check(self, what: str, named: Iterable[Hashable], there: Container[Hashable]) -> None:
        for name in named:
            if name not in there:
                raise ValueError(f"plant {self._plant.name!r} has no {what} {name!r}")
