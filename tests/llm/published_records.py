"""Records in the form of the published studies, made by the published rule: small stand-ins for those of others."""

from __future__ import annotations

import json
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import Any

from benchmarks.mixing_calls import route

Record = dict[str, Any]
PLANS, ACTS, ROWS, REACTOR = "mixer_planning_calls", "mixer_action_calls", "mixer_jan2026_rows", "cstr_calls"
AUGUST, JANUARY = "mixer_20260804_184352", "ablation_4omini_normal_20260129_215042"
MAIN_LINE = "emptying_B201"
RIGHT, CORRECTED, STUCK, COOLED = (
    "2026-08/gpt-4.1-mini/mixing_module-pump_degradation-1",
    "2026-01/gpt-4o-mini/mixing_module-pump_failure-1",
    "2026-01/gpt-4o-mini/mixing_module-pump_degradation-1",
    "2026-08/gpt-4o-mini/cstr-cool_stuck_closed-1",
)
"""The runs of :func:`campaigns`, by the paths of their files."""


def published(state: str) -> str:
    """The published name of a state of ours."""
    if state == "idle":
        return "state_initialStep"
    verb, _, tank = state.rpartition("_")
    return f"state_{verb}_tank_{tank.replace('B', 'b') if verb.startswith('bypass') else tank}"


def actuators(target: str) -> list[str]:
    """What the published key switches on for a state of ours."""
    verb, _, tank = target.rpartition("_")
    if verb == "filling":
        return [f"valve_in_{tank}"]
    if tank == "B204":
        return ["valve_out_B204"]
    return ["pump_P102" if verb.startswith("bypass") else "pump_P101", "valve_in_B204", f"valve_out_{tank}"]


def steps(fault: str) -> list[tuple[str, str]]:
    """(State, the next one) of a batch by the published rule, until the collecting tank drains."""
    states = route(fault)[:-1]
    return list(pairwise(states))


def right_batch(fault: str, model: str = "gpt-4.1-mini") -> dict[str, list[Record]]:
    """A run of August in which every answer is right: file -> records."""
    found: dict[str, list[Record]] = {PLANS: [], ACTS: []}
    for n, (state, target) in enumerate(steps(fault), start=1):
        common = {
            "experiment": AUGUST, "model": model, "model_snapshot": f"{model}-2025-04-14", "fault": fault, "run": 0,
            "iteration": n, "current_state": published(state), "verdict": "correct", "reasoning": "It follows.",
            "input_tokens": 4000, "output_tokens": 80, "latency_s": 1.5,
        }  # fmt: skip
        found[PLANS].append(common | {"call_index": 2 * n - 1, "proposed_next_state": published(target)})
        found[ACTS].append(common | {
            "call_index": 2 * n, "target_state": published(target), "proposed_canonical_on": actuators(target),
            "missing": [], "extra": [],
        })  # fmt: skip
    return found


def row(fault: str, at: tuple[int, int], state: str, target: str, on: list[str] | None = None) -> Record:
    """A row of January: plan ``target`` in ``state`` and its actuators, the ``at[1]``-th in iteration ``at[0]``."""
    key, said = actuators(target), actuators(target) if on is None else on
    return {
        "experiment": JANUARY, "model": "gpt-4o-mini", "fault": fault, "run": 0, "iteration": at[0],
        "row_in_iteration": at[1], "duplicate_of_previous_row": False, "current_state": published(state),
        "proposed_next_state": published(target), "planning_correct": (state, target) in steps(fault),
        "planning_reasoning": "", "target_state": published(target), "on": said,
        "missing": sorted(set(key) - set(said)), "extra": sorted(set(said) - set(key)), "action_reasoning": None,
        "planning_input_tokens": 4590, "planning_output_tokens": 72, "action_input_tokens": 3231,
        "action_output_tokens": 83, "planning_time_s": 2.0, "action_time_s": 2.5,
    }  # fmt: skip


def corrected_batch(fault: str) -> list[Record]:
    """Rows of a run that names the main line first where the rule wants the bypass, and is then right."""
    rows: list[Record] = []
    for n, (state, target) in enumerate(steps(fault), start=1):
        if target == f"bypass_{MAIN_LINE}":
            rows.append(row(fault, (n, 1), state, MAIN_LINE))
        wrong_before = bool(rows) and rows[-1]["iteration"] == n
        rows.append(row(fault, (n, 2 if wrong_before else 1), state, target))
    return rows


def stuck_batch(fault: str) -> list[Record]:
    """Rows of a run that ends in its first state: six times wrong actuators of one right plan."""
    on = ["valve_in_B201", "valve_in_B204", "valve_out_B201"]
    return [row(fault, (1, n), "idle", "filling_B201", on) for n in range(1, 7)]


def reactor_run(*feeds: float, model: str = "gpt-4o-mini") -> list[Record]:
    """Calls of a run of the reactor that proposes these feeds [L/s], the last one accepted."""
    present = {"T_sp": 310.0, "L_sp": 10.0, "Fin_sp": 1 / 30}
    return [
        {
            "experiment": "cstr_20260803_182646", "model": model, "model_served": f"{model}-2024-07-18",
            "fault": "cool_stuck_closed", "run": 0, "call_index": n, "n_calls_in_run": len(feeds), "time_s": 2134.0,
            "current_setpoints": present, "proposed_setpoints": present | {"Fin_sp": feed}, "reasoning": "Less feed.",
            "input_tokens": 4405, "output_tokens": 72, "latency_s": 2.6, "run_success": 1,
        }
        for n, feed in enumerate(feeds, start=1)
    ]  # fmt: skip


def campaigns() -> dict[str, list[Record]]:
    """Four runs: file -> records."""
    rows = corrected_batch("pump_failure") + stuck_batch("pump_degradation")
    return {**right_batch("pump_degradation"), ROWS: rows, REACTOR: reactor_run(0.0283333333, 1 / 30)}


def written(folder: Path, records: dict[str, Iterable[Record]]) -> Path:
    """The folder, with a file of each kind of records."""
    for name, found in records.items():
        (folder / f"{name}.jsonl").write_text("".join(json.dumps(r) + "\n" for r in found), encoding="utf-8")
    return folder
