"""What language models were asked in a run, and what it took."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict

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
    tokens: dict[str, list[int]] = {agent: [0, 0, 0] for agent in ("planning", "action", "reprompting")}
    for call, own in pairs:
        sums = tokens[call.agent]
        sums[0] += 1
        sums[1] += call.input_tokens if counted else own.asked_tokens
        sums[2] += call.output_tokens if counted else own.answered_tokens
    costs = [c.cost_usd for c in calls]
    (planning, action, reprompting) = tokens.values()
    columns = UsageColumns(
        planning_calls=planning[0], planning_in=planning[1], planning_out=planning[2],
        action_calls=action[0], action_in=action[1], action_out=action[2],
        reprompting_calls=reprompting[0], reprompting_in=reprompting[1], reprompting_out=reprompting[2],
        tokens_by=(SERVER if counted else ESTIMATE) if calls else "",
        cost_usd=sum(c for c in costs if c is not None) if calls and None not in costs else None,
        failures=sum(bool(c.failure) for c in calls),
    )  # fmt: skip
    return Usage(columns, sum(c.wall_latency_s for c in calls) / len(calls) if calls else None)
