"""Recorded answers said again by a `ReplayModel` and read as today's typed answers of the action agent."""

from __future__ import annotations

import asyncio
import json
from collections import Counter
from collections.abc import Sequence

from benchmarks.recorded_calls import RecordedCall
from homeostat.agents.language.answers import Unusable, action_type, read, schema
from homeostat.domain.plant.state_machine import State
from homeostat.llm.calls import Call
from homeostat.llm.model import Question
from homeostat.llm.replay import ReplayModel
from homeostat.plants.plant import Plant

TARGETS = ("compensated", "reduced_load")
"""States whose commands the recorded setpoints could be; planning chooses between them."""


def as_call(recorded: RecordedCall, target: State) -> Call:
    """The recorded answer as it would stand in a file of recorded calls for ``target``."""
    s = recorded.proposed
    given: dict[str, float | None] = {"T1.sp": s.temperature, "L1.sp": s.level, "F1.sp": s.feed, "V2.man": None}
    commands = {r.tag: given[r.tag] for r in target.open_setpoints}
    return Call(
        agent="action", at_s=float(recorded.time_s), model="recorded", served=recorded.model_served, system="",
        prompt="", schema={}, answer=json.dumps({"reasoning": "", "commands": commands}), failure=None, detail="",
        input_tokens=0, output_tokens=0, cost_usd=None, latency_s=0.0,
    )  # fmt: skip


def answer_rows(plant: Plant, calls: Sequence[RecordedCall]) -> list[tuple[object, ...]]:
    """Fault, state, answers, usable ones, and why the others are not."""
    rows: list[tuple[object, ...]] = []
    for fault in sorted({c.fault for c in calls}):
        for name in TARGETS:
            target = plant.description.machine.state(name)
            group = [c for c in calls if c.fault == fault]
            said = asyncio.run(_read_all(plant, target, group))
            reasons = Counter(f.message for found in said if isinstance(found, Unusable) for f in found.findings)
            why = "; ".join(f"{text} ({n})" for text, n in reasons.most_common())
            rows.append((fault, name, len(said), sum(not isinstance(f, Unusable) for f in said), why or "-"))
    return rows


async def _read_all(plant: Plant, target: State, group: Sequence[RecordedCall]) -> list[object]:
    kind = action_type(target.open_setpoints, plant.description.tags_by_name)
    model = ReplayModel("recorded", [as_call(c, target) for c in group])
    said: list[object] = []
    for call in group:
        reply = await model.ask(Question("action", float(call.time_s), "", "", schema(kind), ""), 1.0)
        said.append(read(kind, reply.answer))
    return said
