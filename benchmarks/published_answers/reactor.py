"""The reactor's runs: one study's calls.

The published loop asks for three setpoints and for no plan. Ours asks for a path first. What leads to the setpoints is
read from them, not chosen: where they leave the feed as it was it is the state in which the feed is fixed, otherwise
the one in which it is free. These answers are the published loop's, and marked so.

Setpoints are said in whole increments of the signal list, the nearest ones and of two equally near ones the lower; the
published grid is another one, and a question of ours does not admit anything else. They are those that the model gave,
not those that the published rule for repeated proposals made of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

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

CASE = "cstr"
START = "normal"
INCREMENTS = {"T1.sp": 0.1, "L1.sp": 0.1, "F1.sp": 0.0005}
"""Of the signal list, in the tag's unit."""
_NAMES = {"T1.sp": "T_sp", "L1.sp": "L_sp", "F1.sp": "Fin_sp"}
_FIXED = {"compensated": frozenset({"F1.sp"}), "reduced_load": frozenset[str]()}
"""State -> what it is not asked for."""


def reactor_runs(folder: Path, as_said: bool = False) -> Iterator[PublishedRun]:
    """Every run of which something is recorded in ``folder``; ``as_said``: setpoints to the last digit."""
    groups: dict[tuple[str, str, str, int], list[dict[str, Any]]] = {}
    for r in lines(folder / "cstr_calls.jsonl"):
        groups.setdefault((r["experiment"], r["model"], r["fault"], r["run"]), []).append(r)
    for (experiment, asked, fault, run), records in groups.items():
        records.sort(key=lambda r: int(r["call_index"]))
        name = model_name(asked, records[0]["model_served"])
        numbers = [r["call_index"] for r in records]
        complete = numbers == list(range(1, records[0]["n_calls_in_run"] + 1))
        calls = tuple(call for r in records for call in _calls(r, as_said))
        success = bool(records[0]["run_success"])
        yield PublishedRun(campaign(experiment), name, CASE, fault, run + FIRST, calls, complete, success)


def target(given: Mapping[str, float], present: Mapping[str, float]) -> str:
    """The state in which setpoints are possible that leave the feed as it was, or do not."""
    return "compensated" if math.isclose(given["Fin_sp"], present["Fin_sp"]) else "reduced_load"


def setpoint(tag: str, value: float, as_said: bool) -> float:
    """``value`` in whole increments of ``tag``, unless as it was said."""
    if as_said:
        return value
    step = INCREMENTS[tag]
    return round(math.ceil(round(value / step - 0.5, 6)) * step, 9)


def _calls(record: dict[str, Any], as_said: bool) -> tuple[Call, Call]:
    """The path that the setpoints need, and the setpoints."""
    asked, given, at_s = record["model"], record["proposed_setpoints"], float(record["time_s"])
    state = target(given, record["current_setpoints"])
    told = "No model was asked: the published loop has no plan, and the setpoints that follow need this path."
    path = {"path": f"{START} > {state}"}
    commands: dict[str, float | None] = {
        tag: setpoint(tag, given[name], as_said) for tag, name in _NAMES.items() if tag not in _FIXED[state]
    }
    cost = Cost(record["input_tokens"], record["output_tokens"], record["latency_s"])
    answer = {"commands": commands | {"V2.man": None}}
    prompt = f"{in_state(START)}\n{for_state(state)}"
    return (
        said("planning", asked, SUPPLIED, in_state(START), path, told, Cost(), at_s),
        said("action", asked, record["model_served"], prompt, answer, record["reasoning"] or "", cost, at_s),
    )
