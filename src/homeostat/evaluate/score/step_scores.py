"""Scores of single steps, as studies that ask in every state define them; the truth is found by hindsight."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from homeostat.agents.language.answers import unfenced
from homeostat.evaluate.reference.best_route import best_route
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.transcript import TranscriptEntry
from homeostat.llm.replay import SUPPLIED
from homeostat.plants.plant import Plant
from homeostat.record.result import StepScores

ON = 0.05
"""An actuator is on above this value; everything that is switched goes from 0 to 1 [1]."""


def score_steps(plant: Plant, scenario: Scenario, transcript: Sequence[TranscriptEntry]) -> StepScores | None:
    """Scores of ``said`` against the best route by hindsight; None where no route completes.

    A plan is right where it names the successor of the present state on that route; beside the route none is. Actuators
    are compared with what the state that was named last is commanded by design, whether or not it was named rightly.
    """
    best = best_route(plant, scenario)
    if best is None:
        return None
    transcript = [s for s in transcript if s.served != SUPPLIED]
    follows = dict(zip(best.states, best.states[1:], strict=False))
    states = {state.name: state for state in plant.description.machine.states}
    plans = [(s.state, _field(s.answer, "path")) for s in transcript if s.agent == "planning"]
    right = sum(follows.get(state) == named for state, named in plans)
    acted = [(states[name], switched) for name, switched in _acted(transcript) if name in states]
    needed = [(_on({r.tag: r.design for r in state.setpoints}), switched) for state, switched in acted]
    return StepScores(
        plans=len(plans),
        plans_right=right,
        actions=len(needed),
        actions_right=sum(must == on for must, on in needed),
        on_right=sum(len(must & on) for must, on in needed),
        on_wrong=sum(len(on - must) for must, on in needed),
        on_missed=sum(len(must - on) for must, on in needed),
    )


def _acted(transcript: Sequence[TranscriptEntry]) -> list[tuple[str, frozenset[str]]]:
    """The state that was named before, and what was switched on, for every answer of the action agent."""
    named, found = "", []
    for s in transcript:
        if s.agent == "planning":
            named = str(_field(s.answer, "path"))
        elif s.agent == "action":
            found.append((named, _on(_field(s.answer, "commands"))))
    return found


def _on(commands: object) -> frozenset[str]:
    """Tags with a value above :data:`ON`."""
    if not isinstance(commands, Mapping):
        return frozenset()
    return frozenset(t for t, v in commands.items() if isinstance(v, int | float) and v > ON)


def _field(answer: str, name: str) -> object:
    """A field of an answer; None where the answer is no JSON object or has no such field."""
    try:
        value: Any = json.loads(unfenced(answer))
    except (ValueError, RecursionError):  # what nests without end was no answer to the agents either
        return None
    return value.get(name) if isinstance(value, dict) else None
