"""What language models were asked in a run, and what it took."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict, cast

from homeostat.evaluate.conditions.transcript import Said
from homeostat.journal.calls import ModelCalled
from homeostat.journal.events import Event
from homeostat.llm.situated import SUPPLIED

SERVER, ESTIMATE = "server", "estimate"
"""Who counted tokens."""


class UsageColumns(TypedDict):
    """The columns of a row that are about language models."""

    planning_calls: int
    planning_in: int
    planning_out: int
    action_calls: int
    action_in: int
    action_out: int
    reprompting_calls: int
    reprompting_in: int
    reprompting_out: int
    tokens_by: str
    cost_usd: float | None
    failures: int


@dataclass(frozen=True, slots=True)
class Usage:
    """Sums over a run."""

    columns: UsageColumns
    """As a row has them."""
    wall_call_s: float | None
    """Mean time of an answer [s]; None where nobody was asked."""


def usage_of(events: Sequence[Event], said: Sequence[Said]) -> Usage:
    """Sums over the calls in ``events``; ``said`` holds our own counts of the same calls, in the same order.

    Tokens are the server's count where it counted in every call, else our estimate in every call.
    """
    every = [e for e in events if isinstance(e, ModelCalled)]
    pairs = [(call, own) for call, own in zip(every, said, strict=True) if call.served != SUPPLIED]
    calls = [call for call, _ in pairs]
    counted = bool(calls) and all(c.input_tokens > 0 for c in calls if not c.failure)
    sums = {f"{agent}_{what}": 0 for agent in ("planning", "action", "reprompting") for what in ("calls", "in", "out")}
    for call, own in pairs:
        sums[f"{call.agent}_calls"] += 1
        sums[f"{call.agent}_in"] += call.input_tokens if counted else own.asked_tokens
        sums[f"{call.agent}_out"] += call.output_tokens if counted else own.answered_tokens
    costs = [c.cost_usd for c in calls if c.cost_usd is not None]
    whole: dict[str, str | int | float | None] = {
        **sums,
        "tokens_by": (SERVER if counted else ESTIMATE) if calls else "",
        "cost_usd": sum(costs) if calls and len(costs) == len(calls) else None,
        "failures": sum(bool(c.failure) for c in calls),
    }
    columns = cast(UsageColumns, whole)
    return Usage(columns, sum(c.wall_latency_s for c in calls) / len(calls) if calls else None)
