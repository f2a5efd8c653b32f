"""The mixing module's runs: calls of the August study, and rows of the January one.

The published loop asks planning and action in every state until the collecting tank drains, and then ends by itself.
Ours asks once more what follows then; that answer is the published loop's, and marked so.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

from benchmarks.mixing_calls import ACTUATORS, state_name
from benchmarks.published_answers.runs import (
    FIRST,
    Cost,
    PublishedRun,
    campaign,
    for_state,
    in_state,
    lines,
    model_name,
    said,
)
from homeostat.llm.calls import Call
from homeostat.llm.replay import SUPPLIED

CASE = "mixing_module"
DRAINING, END = "emptying_B204", "complete"
ATTEMPTS = 6
"""After so many attempts in one state the published loop gives up."""
_Key = tuple[str, str, str, int]


def mixing_runs(folder: Path) -> Iterator[PublishedRun]:
    """Every run of which something is recorded in ``folder``."""
    plans = [{**r, "agent": "planning"} for r in lines(folder / "mixer_planning_calls.jsonl")]
    acts = [{**r, "agent": "action"} for r in lines(folder / "mixer_action_calls.jsonl")]
    for key, records in _grouped(plans + acts).items():
        yield _from_calls(key, sorted(records, key=lambda r: int(r["call_index"])))
    for key, records in _grouped(lines(folder / "mixer_jan2026_rows.jsonl")).items():
        yield _from_rows(key, [r for r in records if not r["duplicate_of_previous_row"]])


def _grouped(records: Iterable[dict[str, Any]]) -> dict[_Key, list[dict[str, Any]]]:
    found: dict[_Key, list[dict[str, Any]]] = {}
    for r in records:
        found.setdefault((r["experiment"], r["model"], r["fault"], r["run"]), []).append(r)
    return found


def _from_calls(key: _Key, records: list[dict[str, Any]]) -> PublishedRun:
    whole = [r["call_index"] for r in records] == list(range(1, len(records) + 1))
    calls = [_call(r, r["model_snapshot"], r["agent"], "", r["latency_s"]) for r in records]
    acts = [r for r in records if r["agent"] == "action"]
    attempts = sum(r["iteration"] == records[-1]["iteration"] for r in acts)
    success = bool(acts) and acts[-1]["verdict"] == "correct" and state_name(acts[-1]["target_state"]) == DRAINING
    return _run(key, records[0]["model_snapshot"], calls, whole and (success or attempts >= ATTEMPTS), success)


def _from_rows(key: _Key, rows: list[dict[str, Any]]) -> PublishedRun:
    """A row has a plan and its actuators; after wrong actuators of a right plan only these were asked for again."""
    calls: list[Call] = []
    before: dict[str, Any] | None = None
    for row in rows:
        again = before is not None and before["iteration"] == row["iteration"]
        if not (again and before is not None and before["planning_correct"]):
            calls.append(_call(row, row["model"], "planning", "planning_", row["planning_time_s"]))
        calls.append(_call(row, row["model"], "action", "action_", row["action_time_s"]))
        before = row
    last = rows[-1]
    right = last["planning_correct"] and not last["missing"] and not last["extra"]
    success = bool(right) and state_name(last["target_state"]) == DRAINING
    ended = success or last["row_in_iteration"] >= ATTEMPTS
    return _run(key, last["model"], calls, _without_gaps(rows) and ended, success)


def _without_gaps(rows: list[dict[str, Any]]) -> bool:
    """Whether the rows count through every iteration from the first one on."""
    at = [(r["iteration"], r["row_in_iteration"]) for r in rows]
    return at[0] == (1, 1) and all(b in ((a[0], a[1] + 1), (a[0] + 1, 1)) for a, b in pairwise(at))


def _call(record: dict[str, Any], served: str, agent: str, prefix: str, latency_s: float) -> Call:
    """One answer; ``prefix``: of the names of its fields where a record holds a plan and its actuators."""
    state = state_name(record["current_state"])
    cost = Cost(record[f"{prefix}input_tokens"], record[f"{prefix}output_tokens"], latency_s)
    reasoning = record[f"{prefix}reasoning"] or ""
    if agent == "planning":
        path = {"path": state_name(record["proposed_next_state"])}
        return said(agent, record["model"], served, in_state(state), path, reasoning, cost)
    on = record["on"] if prefix else record["proposed_canonical_on"]
    prompt = f"{in_state(state)}\n{for_state(state_name(record['target_state']))}"
    return said(agent, record["model"], served, prompt, {"commands": _commands(on)}, reasoning, cost)


def _commands(on: Iterable[str]) -> dict[str, float]:
    """Every actuator; the published loop switches off what an answer does not name."""
    switched = {ACTUATORS[name] for name in on}
    return {tag: float(tag in switched) for tag in ACTUATORS.values()}


def _run(key: _Key, served: str, calls: list[Call], complete: bool, success: bool) -> PublishedRun:
    experiment, asked, fault, run = key
    closing = _closing(asked) if success else ()
    name = model_name(asked, served)
    return PublishedRun(
        campaign(experiment), name, CASE, fault, run + FIRST, (*calls, *closing), complete, success
    )  # fmt: skip


def _closing(asked: str) -> tuple[Call, ...]:
    """What the published loop does by itself once the collecting tank drains: the batch ends, everything off."""
    told = "No model was asked: the published loop ends the batch by itself."
    prompt = f"{in_state(DRAINING)}\n{for_state(END)}"
    return (
        said("planning", asked, SUPPLIED, in_state(DRAINING), {"path": END}, told, Cost()),
        said("action", asked, SUPPLIED, prompt, {"commands": _commands(())}, told, Cost()),
    )
