"""On which event recoveries are decided: it follows from the state machine, whatever the event is called."""

from __future__ import annotations

import pytest

from homeostat.domain.plant.state_machine import State, StateMachine, Transition
from homeostat.plants.files.places import plant_names
from homeostat.plants.plant import load_plant
from homeostat.stl.formula import parse

TRUE = parse("true")


def state(name: str, risk: int, target: bool = False, initial: bool = False) -> State:
    return State(name, name, risk, initial, target, TRUE, frozenset(), ())


def way(source: str, target: str, event: str, decided: bool = True) -> Transition:
    return Transition(f"{source}_{target}_{event}", source, target, event, TRUE, decided)


def machine(*transitions: Transition, safe_is_target: bool = False) -> StateMachine:
    states = (state("begin", 0, initial=True), state("run", 0), state("pause", 1), state("slow", 2, target=True))
    return StateMachine("m", (*states, state("safe", 9, target=safe_is_target)), transitions)


@pytest.mark.parametrize("plant", plant_names())
def test_the_plants_decide_on_a_diagnosed_fault(plant: str) -> None:
    assert load_plant(plant, learned=False).description.machine.recovery_event == "fault_diagnosed"


def test_it_is_that_of_decisions_that_lead_to_a_recovery_target_at_once_or_by_themselves() -> None:
    fall = way("run", "safe", "fallback")
    assert machine(fall, way("run", "slow", "help")).recovery_event == "help"
    assert machine(fall, way("run", "pause", "help"), way("pause", "slow", "calm", False)).recovery_event == "help"


def test_a_new_start_is_no_recovery() -> None:
    again, onward = way("safe", "begin", "again"), way("begin", "slow", "ready", False)
    assert machine(again, onward).recovery_event == ""
    assert machine(again, onward, way("run", "slow", "help")).recovery_event == "help"


def test_a_fallback_that_ends_in_a_recovery_target_is_riskier() -> None:
    ways = way("run", "safe", "fallback"), way("run", "slow", "help")
    assert machine(*ways, safe_is_target=True).recovery_event == "help"
