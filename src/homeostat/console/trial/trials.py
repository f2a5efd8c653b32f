"""Questions to a twin, one at a time, each in a process of its own that is ended where it takes too long."""

from __future__ import annotations

import math
import pickle
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, final

from homeostat.console.card.episode import last_episode
from homeostat.console.card.proposal import state_label
from homeostat.console.opened import OpenedRun
from homeostat.console.readings import Readings
from homeostat.console.trial.question import Bad, Question
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.guard import QualityChanged, StartUpEnded, StateEntered
from homeostat.domain.events.recovery import Diagnosed, Doubted
from homeostat.domain.plant.state_machine import State
from homeostat.journal.memory import Entry

LONGEST_S: Final = 60.0
"""Longest time that a twin may take, wall-clock [s]."""
_LEAST_SAMPLES: Final = 5


class NotTried(Exception):
    """There is no answer; one line says why."""


class Busy(NotTried):
    """Somebody else asks."""


@dataclass(frozen=True, slots=True)
class Setpoint:
    """What may be moved."""

    tag: str
    text: str
    unit: str
    low: float
    high: float
    design: float | None
    """Value by design; None for automatic."""
    now: float | None
    """What it is at; None for automatic, or where it is not known."""


@dataclass(frozen=True, slots=True)
class Option:
    """A state that may be asked about."""

    state: str
    label: str
    setpoints: tuple[Setpoint, ...]


@final
class Trials:
    """Everything that is asked about one run; nothing of it reaches the guard."""

    def __init__(self, run: OpenedRun, longest_s: float = LONGEST_S) -> None:
        """Nobody has asked yet; an answer takes ``longest_s`` wall-clock seconds at most."""
        self._run, self._longest_s = run, longest_s
        self._asking = threading.Lock()

    def options(self, at_s: float) -> tuple[Option, ...]:
        """What may be asked at ``at_s`` [s]: the plant's state, and those that may be decided on from it."""
        run = self._run
        if run.plant.folder is None or run.readings is None:
            return ()
        now = run.stands(at_s)
        machine = run.plant.description.machine
        here = now.state or machine.initial.name
        names = [here, *(t.target for t in machine.transitions if t.source == here and t.on_decision)]
        states = [state for name in dict.fromkeys(names) for state in machine.states if state.name == name]
        return tuple(self._option(state, now.targets) for state in states if state.setpoints)

    def _option(self, state: State, targets: Mapping[str, float | None]) -> Option:
        tags, d = self._run.plant.description.tags_by_name, self._run.plant.description
        found = (
            Setpoint(r.tag, tags[r.tag].description, tags[r.tag].unit, r.low, r.high, r.design, targets.get(r.tag))
            for r in state.setpoints
        )
        return Option(state.name, state_label(state.name, d), tuple(found))

    def ask(self, at_s: float, target: str, values: Mapping[str, float | None]) -> str:
        """The answer, as JSON; NotTried with the reason where there is none."""
        question = self._question(at_s, target, values)
        if not self._asking.acquire(blocking=False):
            raise Busy("the twin is being asked already; ask again in a moment")
        try:
            return self._answer(question)
        finally:
            self._asking.release()

    def _answer(self, question: Question) -> str:
        # -P: what lies in the folder that the console was started in is no code of anybody's
        command = [sys.executable, "-P", "-m", "homeostat.console.trial"]
        try:
            done = subprocess.run(
                command, input=pickle.dumps(question), capture_output=True, timeout=self._longest_s, check=False
            )
        except subprocess.TimeoutExpired:
            raise NotTried(f"the twin has not answered within {self._longest_s:g} s") from None
        except OSError as error:
            raise NotTried(f"the twin cannot be asked: {error}") from error
        if done.returncode != 0:
            last = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["it said nothing"]
            raise NotTried(f"the twin cannot say: {last[0][:300]}")
        return done.stdout.decode()

    def _question(self, at_s: float, target: str, values: Mapping[str, float | None]) -> Question:
        run = self._run
        readings, folder = run.readings, run.plant.folder
        if folder is None or readings is None:
            raise NotTried("nothing can be tried: the plant's folder or the readings are not to be had")
        option = next((o for o in self.options(at_s) if o.state == target), None)
        if option is None:
            raise NotTried(f"state {target[:80]!r} cannot be decided on at this moment")
        part = readings.between(-math.inf, at_s)
        if part.stop < _LEAST_SAMPLES:
            raise NotTried(f"{part.stop} samples are too few; the twin needs {_LEAST_SAMPLES}")
        seen = Readings(readings.times_s[part], {tag: v[part] for tag, v in readings.signals.items()})
        entries, now = run.until(at_s), run.stands(at_s)
        return Question(
            folder, at_s, seen, _bad(entries), _healthy_s(entries, at_s), _diagnosis(entries, at_s),
            now.state or run.plant.description.machine.initial.name, target, _within(option, values), now.targets,
        )  # fmt: skip


def _within(option: Option, values: Mapping[str, float | None]) -> dict[str, float | None]:
    """What is commanded: every setpoint of the state, at its design where nothing else is asked; NotTried outside."""
    ranges = {s.tag: s for s in option.setpoints}
    for tag, value in values.items():
        known = ranges.get(tag)
        if known is None:
            raise NotTried(f"{tag[:80]!r} may not be moved in {option.label!r}; it has {', '.join(ranges)}")
        if value is None and known.design is not None:
            raise NotTried(f"{tag} cannot be left on automatic; give a value from {known.low:g} to {known.high:g}")
        if value is not None and not known.low <= value <= known.high:
            raise NotTried(f"{tag} is {value:g} {known.unit}; it must be from {known.low:g} to {known.high:g}")
    return {tag: values.get(tag, known.design) for tag, known in ranges.items()}


def _bad(entries: Sequence[Entry]) -> Bad:
    spans: dict[str, list[tuple[float, float]]] = {}
    for entry in entries:
        if isinstance(entry.event, QualityChanged):
            held = spans.setdefault(entry.event.tag, [])
            if held and held[-1][1] == math.inf:
                held[-1] = held[-1][0], entry.at_s
            if entry.event.quality == "bad":
                held.append((entry.at_s, math.inf))
    return {tag: tuple(held) for tag, held in spans.items() if held}


def _healthy_s(entries: Sequence[Entry], at_s: float) -> tuple[float, float]:
    """The time before the episode, since the plant entered its state."""
    episode = last_episode(entries)
    until_s = at_s if episode is None or episode.over_s is not None else episode.entries[0].at_s
    begun = [e.at_s for e in entries if isinstance(e.event, StateEntered | StartUpEnded) and e.at_s <= until_s]
    over_s = [] if episode is None or episode.over_s is None else [episode.over_s]
    return max([0.0, *begun[-1:], *over_s]), until_s


def _diagnosis(entries: Sequence[Entry], at_s: float) -> Diagnosis:
    episode = last_episode(entries)
    if episode is not None and episode.over_s is None:
        for entry in reversed(episode.entries):
            if isinstance(entry.event, Diagnosed | Doubted):
                said = entry.event
                return Diagnosis(entry.at_s, said.symptoms, said.hypotheses, doubts=isinstance(said, Doubted))
    return Diagnosis(at_s, (), ())
