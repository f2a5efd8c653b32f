"""What language models answered about the published mixing module, as it was recorded, in this project's names.

Two kinds of records: calls of one study (one line per call), and rows of an older one (one line per accepted or
refused pair of a plan and its actuators). Answers that are alike are counted once.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parents[2] / "shared" / "data" / "reference" / "calls"
"""Where the records lie if they are there; they are not part of this project."""
FAULTS = {
    "normal": ("none", None), "pump_failure": ("pump_failure", 1.0), "pump_degradation": ("pump_degradation", 0.6),
    "clogging_fault": ("clogging_main", 1.0), "leak": ("leakage_main", 0.3),
    "sensor_fault": ("sensor_bias_flow", -0.15),
}  # fmt: skip
"""Published fault -> fault and severity here, so large that physics asks for the line that the published rule names.

The published simulator has no severities, and no effect of three of these faults.
"""
BYPASSED = ("pump_failure", "pump_degradation", "clogging_fault", "leak")
"""Faults that the published rule sends through the bypass."""
_STATES = {"state_initialStep": "idle", "state_emptying_tank_B204": "emptying_B204"}
ACTUATORS = {
    **{f"valve_in_B20{n}": f"VI20{n}.cmd" for n in (1, 2, 3, 4)},
    **{f"valve_out_B20{n}": f"VO20{n}.cmd" for n in (1, 2, 3, 4)},
    "pump_P101": "P101.cmd", "pump_P102": "P102.cmd",
}  # fmt: skip
"""A published actuator -> its command here."""


@dataclass(frozen=True, order=True)
class Answer:
    """One answer, whoever gave it."""

    agent: str
    """``planning`` or ``action``."""
    fault: str
    """Published name of the fault."""
    state: str
    """State that the plant is in."""
    target: str
    """State that is named, or that the actuators are for."""
    on: tuple[str, ...]
    """Tags of the actuators that are switched on; empty for planning."""
    correct: bool
    """Whether the published key says so."""

    @property
    def on_the_way(self) -> bool:
        """Whether the state that is named follows on the route by the published rule."""
        states = route(self.fault)
        return states[states.index(self.state) + 1] == self.target


def answers() -> Counter[Answer]:
    """Every recorded answer with how often it was given; FileNotFoundError where the records are not there."""
    found: Counter[Answer] = Counter()
    for record in _lines("mixer_planning_calls.jsonl"):
        found[_planned(record, record["verdict"] == "correct")] += 1
    for record in _lines("mixer_action_calls.jsonl"):
        found[_acted(record, record["proposed_canonical_on"])] += 1
    for record in _lines("mixer_jan2026_rows.jsonl"):
        if not record["duplicate_of_previous_row"]:
            found[_planned(record, record["planning_correct"])] += 1
            found[_acted(record, record["on"])] += 1
    return found


def route(fault: str) -> tuple[str, ...]:
    """The states of a whole batch by the published rule, the initial one first."""
    way = "bypass_emptying" if fault in BYPASSED else "emptying"
    filling, emptying = ([f"{verb}_B20{n}" for n in (1, 2, 3)] for verb in ("filling", way))
    return ("idle", *filling, *emptying, "emptying_B204", "complete")


def _planned(record: dict[str, Any], correct: bool) -> Answer:
    state, named = state_name(record["current_state"]), state_name(record["proposed_next_state"])
    return Answer("planning", record["fault"], state, named, (), correct)


def _acted(record: dict[str, Any], on: list[str]) -> Answer:
    state, target = state_name(record["current_state"]), state_name(record["target_state"])
    tags = tuple(sorted(ACTUATORS[name] for name in on))
    return Answer("action", record["fault"], state, target, tags, not record["missing"] and not record["extra"])


def state_name(name: str) -> str:
    """A published state's name here."""
    return _STATES.get(name, name.removeprefix("state_").replace("_tank", "").replace("_b20", "_B20"))


def _lines(name: str) -> Iterator[dict[str, Any]]:
    with (FOLDER / name).open(encoding="utf-8") as file:
        yield from map(json.loads, file)
