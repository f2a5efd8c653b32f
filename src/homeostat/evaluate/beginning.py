"""Where a run begins: in another state of the machine than by design, and with an operator's setpoints."""

from __future__ import annotations

import weakref
from collections.abc import Mapping
from dataclasses import replace
from typing import TypeAlias

from homeostat.domain.plant.state_machine import StateMachine
from homeostat.evaluate.scenario import Scenario, ScenarioError
from homeostat.plants.error import PlantError
from homeostat.plants.plant import Plant
from homeostat.plants.teaching.learning import RUNS, learn
from homeostat.process.types import Vec
from homeostat.stl.spelling import near_matches

_Beginning: TypeAlias = tuple[str, tuple[tuple[str, float], ...]]
"""State and setpoints."""
_begun: dict[int, dict[_Beginning, Plant]] = {}
"""Number of a plant that there is -> beginning -> the plant as it stands there."""


def beginning(
    plant: Plant, chosen: Scenario, state: str = "", setpoints: Mapping[str, float] | None = None
) -> Scenario:
    """``chosen``, which begins in ``state`` with ``setpoints`` (tag -> value); ScenarioError where it cannot."""
    names = [s.name for s in plant.description.machine.states]
    if state and state not in names:
        raise ScenarioError(f"begins_in {state!r} is no state of {plant.name!r}{near_matches(state, names)}")
    found = replace(chosen, begins_in=state, setpoints=tuple(sorted((setpoints or {}).items())))
    for tag, value in found.setpoints:
        known = plant.description.tags_by_name
        if tag not in known or plant.description.variables[tag] not in plant.model.inputs:
            raise ScenarioError(f"setpoint {tag!r} is none that can be commanded{near_matches(tag, known)}")
        if not known[tag].range.contains(value):
            inside = f"{known[tag].range.low:g} to {known[tag].range.high:g} {known[tag].unit}"
            raise ScenarioError(f"setpoint {tag!r} = {value:g} must lie in {inside}")
    return found


def begun(plant: Plant, scenario: Scenario) -> Plant:
    """``plant`` as it stands when ``scenario`` begins: that state is its initial and ordinary one.

    Everybody who looks after it sees the same: guard, recovery and whoever scores. The same plant for equal beginnings.
    """
    if not (scenario.begins_in or scenario.setpoints):
        return plant
    known, key = _beginnings(plant), (scenario.begins_in, scenario.setpoints)
    if key not in known:
        machine = plant.description.machine
        state = scenario.begins_in or machine.initial.name
        description = replace(plant.description, machine=_begins(machine, state))
        known[key] = replace(plant, description=description, start=_start(plant, state, dict(scenario.setpoints)))
    return known[key]


def watched(plant: Plant, scenario: Scenario) -> Plant:
    """:func:`begun`, with reference values of its own: where something else is ordered, something else is normal.

    They are learned of fault-free plants that begin there, once for each beginning. A trim that is off holds no
    composition, and a production that is far from its order takes a day: by the reference values of the plant as it
    stands by design either is a symptom of nothing. Where a fault-free plant is not well there, those are kept.
    """
    made = begun(plant, scenario)
    if made is plant or not plant.baselines:
        return made
    known, key = _beginnings(plant), (scenario.begins_in, scenario.setpoints)
    if made.baselines is plant.baselines:
        try:
            own = {each.feature: each for each in learn(made, RUNS)}
        except PlantError:
            own = dict(plant.baselines)
        made = known[key] = replace(made, baselines=own)
    return made


def _beginnings(plant: Plant) -> dict[_Beginning, Plant]:
    """What is known of ``plant``; forgotten with it, before another one can have its number."""
    number = id(plant)
    if number not in _begun:
        _begun[number] = {}
        weakref.finalize(plant, _begun.pop, number, None).atexit = False
    return _begun[number]


def _begins(machine: StateMachine, state: str) -> StateMachine:
    """``machine`` that begins in ``state``; a start anew stays one, and recoveries are decided on what they were."""
    states = tuple(replace(s, initial=s.name == state) for s in machine.states)
    return replace(machine, states=states, recovers_on=machine.recovery_event)


def _start(plant: Plant, state: str, setpoints: Mapping[str, float]) -> Vec:
    """Inputs at the start of a run, shape (inputs,)."""
    inputs = plant.start.copy()
    own = plant.description.machine.state(state)
    design = {r.tag: r.design for r in own.setpoints if r.design is not None} if not own.initial else {}
    for tag, value in {**design, **setpoints}.items():
        inputs[plant.model.inputs.index(plant.description.variables[tag])] = value
    return inputs
