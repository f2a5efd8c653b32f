"""What the paper scores: success, recovery, single steps, tokens and time; and who solved what.

Every value is None where nothing can be said: nobody was asked, or nothing of the kind happened.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from homeostat.evaluate.report.groups import succeeded
from homeostat.evaluate.report.statistics import Estimate, Rate, Spread, estimate, pooled, rate, spread
from homeostat.evaluate.study.row import Row

AGENTS: Final = ("planning", "action", "reprompting")
"""Agents that may ask a language model."""
_NOBODY: Final = "none"


@dataclass(frozen=True, slots=True)
class Success:
    """How often the plant was saved, and how right single steps were."""

    n: int
    """Runs."""
    success: Rate
    """Runs that succeeded; one in which a fallback acted did not."""
    recovery: Rate | None
    """Successes among the runs in which at least one proposal was refused."""
    plans: Rate | None
    """Next states that were named rightly."""
    actions: Rate | None
    """Sets of actuators that were named rightly."""
    precision: Rate | None
    """Actuators that had to be switched on, among those that were."""
    recall: Rate | None
    """Actuators that were switched on, among those that had to be."""


@dataclass(frozen=True, slots=True)
class Tokens:
    """What one agent asked per run, over the runs in which any question was asked."""

    agent: str
    """Name of the agent."""
    calls: Spread
    """Questions per run."""
    read: Spread
    """Tokens of the questions per run."""
    written: Spread
    """Tokens of the answers per run."""


@dataclass(frozen=True, slots=True)
class Effort:
    """What the proposals cost, over the runs in which a language model was asked."""

    asked: int
    """Runs in which a language model was asked."""
    calls: Spread | None
    """Questions per run."""
    read: Estimate | None
    """Tokens of all questions per run, as the paper gives them: a mean."""
    written: Estimate | None
    """Tokens of all answers per run: a mean."""
    cost: Spread | None
    """Price per run [USD]; None where any is not known."""
    failures: int
    """Questions that got no answer, over all runs."""
    counted_by: str
    """Who counted the tokens."""
    agents: tuple[Tokens, ...]
    """Of each agent that asked anything."""


@dataclass(frozen=True, slots=True)
class Latency:
    """Wall-clock times; they depend on the machine."""

    decision: Spread | None
    """Thinking until the first action [s]."""
    thinking: Spread
    """All thinking of a run [s]."""
    call: Spread | None
    """Mean time of an answer, per run [s]."""
    mean_call: Estimate | None
    """Mean of these, as the paper gives it [s]."""
    run: Estimate | None
    """Time of a run, as the paper gives it: a mean [s]."""


def success_of(rows: Sequence[Row]) -> Success:
    """Success and correctness of one group; ``rows`` must not be empty."""
    outcome = rate([succeeded(row) for row in rows])
    assert outcome is not None
    right = _total(rows, lambda row: row.on_right)
    return Success(
        n=len(rows),
        success=outcome,
        recovery=rate([succeeded(row) for row in rows if row.refused > 0]),
        plans=pooled(_total(rows, lambda row: row.plans_right), _total(rows, lambda row: row.plans)),
        actions=pooled(_total(rows, lambda row: row.actions_right), _total(rows, lambda row: row.actions)),
        precision=pooled(right, right + _total(rows, lambda row: row.on_wrong)),
        recall=pooled(right, right + _total(rows, lambda row: row.on_missed)),
    )


def effort_of(rows: Sequence[Row]) -> Effort:
    """Questions, tokens and price of one group."""
    asked = [row for row in rows if sum(calls_of(row, agent) for agent in AGENTS)]
    prices = [row.cost_usd for row in asked if row.cost_usd is not None]
    spoke = [agent for agent in AGENTS if any(calls_of(row, agent) for row in asked)]
    return Effort(
        asked=len(asked),
        calls=spread([sum(calls_of(row, agent) for agent in AGENTS) for row in asked]),
        read=estimate([sum(read_of(row, agent) for agent in AGENTS) for row in asked]),
        written=estimate([sum(written_of(row, agent) for agent in AGENTS) for row in asked]),
        cost=spread(prices) if len(prices) == len(asked) else None,
        failures=sum(row.failures for row in rows),
        counted_by=", ".join(sorted({row.tokens_by for row in asked if row.tokens_by})),
        agents=tuple(_tokens(agent, asked) for agent in spoke),
    )


def latency_of(rows: Sequence[Row]) -> Latency:
    """Times of one group; ``rows`` must not be empty."""
    thinking = spread([row.wall_thinking_s for row in rows])
    assert thinking is not None
    calls = [row.wall_call_s for row in rows if row.wall_call_s is not None]
    return Latency(
        decision=spread([row.wall_decision_s for row in rows if row.wall_decision_s is not None]),
        thinking=thinking,
        call=spread(calls),
        mean_call=estimate(calls),
        run=estimate([row.wall_s for row in rows]),
    )


def solvers(rows: Sequence[Row]) -> dict[str, int]:
    """Who acted in the runs that succeeded -> how many these are; ``none`` where the plant was left alone."""
    names = sorted({row.actor for row in rows if succeeded(row)}, key=lambda name: (name == _NOBODY, name))
    return {name: sum(row.actor == name for row in rows if succeeded(row)) for name in names}


def calls_of(row: Row, agent: str) -> int:
    """Questions of ``agent``."""
    return {"planning": row.planning_calls, "action": row.action_calls, "reprompting": row.reprompting_calls}[agent]


def read_of(row: Row, agent: str) -> int:
    """Tokens of the questions of ``agent``."""
    return {"planning": row.planning_in, "action": row.action_in, "reprompting": row.reprompting_in}[agent]


def written_of(row: Row, agent: str) -> int:
    """Tokens of the answers to ``agent``."""
    return {"planning": row.planning_out, "action": row.action_out, "reprompting": row.reprompting_out}[agent]


def _tokens(agent: str, asked: Sequence[Row]) -> Tokens:
    calls, read, written = (spread([of(row, agent) for row in asked]) for of in (calls_of, read_of, written_of))
    assert calls is not None and read is not None and written is not None
    return Tokens(agent, calls, read, written)


def _total(rows: Sequence[Row], of: Callable[[Row], int | None]) -> int:
    return sum(of(row) or 0 for row in rows)
