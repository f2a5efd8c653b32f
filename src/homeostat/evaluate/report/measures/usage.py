"""What language models were asked in a run, agent by agent."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from homeostat.evaluate.report.statistics import Spread, spread
from homeostat.evaluate.study.row import Row

AGENTS: Final = ("planning", "action", "reprompting")
"""Agents that may ask a language model."""


class Usage(NamedTuple):
    """Questions of one run."""

    calls: int
    """Number of questions."""
    read: int
    """Their tokens."""
    written: int
    """Tokens of the answers."""


class Tokens(NamedTuple):
    """What one agent asked per run, over the runs in which any question was asked."""

    agent: str
    """Name of the agent."""
    calls: Spread
    """Questions."""
    read: Spread
    """Their tokens."""
    written: Spread
    """Tokens of the answers."""


def usage(row: Row, agent: str) -> Usage:
    """What ``agent`` asked in a run."""
    match agent:
        case "planning":
            return Usage(row.planning_calls, row.planning_in, row.planning_out)
        case "action":
            return Usage(row.action_calls, row.action_in, row.action_out)
        case _:
            return Usage(row.reprompting_calls, row.reprompting_in, row.reprompting_out)


def asked(row: Row) -> Usage | None:
    """What all agents asked in a run together; None where nobody was asked."""
    calls, read, written = map(sum, zip(*(usage(row, agent) for agent in AGENTS), strict=True))
    return Usage(calls, read, written) if calls else None


def tokens_of(rows: Sequence[Row]) -> list[Tokens]:
    """What each agent asked that asked anything."""
    found = []
    for agent in AGENTS:
        used = [usage(row, agent) for row in rows if asked(row)]
        if any(one.calls for one in used):
            calls, read, written = (spread(values) for values in zip(*used, strict=True))
            assert calls is not None and read is not None and written is not None
            found.append(Tokens(agent, calls, read, written))
    return found
