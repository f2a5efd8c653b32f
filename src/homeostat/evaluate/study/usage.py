"""What language models were asked in a run, and what it took."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from homeostat.evaluate.conditions.transcript import TranscriptEntry
from homeostat.journal.calls import ModelCalled
from homeostat.llm.situated import SUPPLIED

AGENTS = ("planning", "action", "reprompting")
"""Who asks language models."""
SERVER, ESTIMATE = "server", "estimate"
"""Who counted tokens."""


def usage_of(every: Sequence[ModelCalled], transcript: Sequence[TranscriptEntry]) -> dict[str, Any]:
    """The columns of a row that are about language models; ``said`` holds our own counts of the calls, in order.

    Tokens are the server's count where it counted in every call, else our estimate in every call.
    """
    pairs = [(call, own) for call, own in zip(every, transcript, strict=True) if call.served != SUPPLIED]
    calls = [call for call, _ in pairs]
    counted = bool(calls) and all(c.input_tokens > 0 for c in calls if not c.failure)
    columns: dict[str, Any] = {f"{agent}_{what}": 0 for agent in AGENTS for what in ("calls", "in", "out")}
    for call, own in pairs:
        tokens = (call.input_tokens, call.output_tokens) if counted else (own.asked_tokens, own.answered_tokens)
        for what, count in zip(("calls", "in", "out"), (1, *tokens), strict=True):
            columns[f"{call.agent}_{what}"] += count
    costs = [c.cost_usd for c in calls]
    return {
        **columns,
        "tokens_by": (SERVER if counted else ESTIMATE) if calls else "",
        "cost_usd": sum(c for c in costs if c is not None) if calls and None not in costs else None,
        "failures": sum(bool(c.failure) for c in calls),
        "wall_call_s": sum(c.wall_latency_s for c in calls) / len(calls) if calls else None,
    }
