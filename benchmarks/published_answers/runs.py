"""One published run as calls of this project, and the file that it is written to."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from homeostat.agents.language.answers import MOST_REASONING
from homeostat.llm.calls import Call

FIRST = 1
"""Number of the first run of a fault; the records count from 0."""


@dataclass(frozen=True)
class PublishedRun:
    """What was answered in one run, in order."""

    campaign: str
    """Year and month: ``2026-01``."""
    model: str
    """The model that answered, without the date of its version."""
    case: str
    """Name of the plant here."""
    scenario: str
    """Published name of the fault."""
    number: int
    """Number of the run, from 1 for each fault of a study."""
    calls: tuple[Call, ...]
    """The answers, and what the published loop decided by itself (served by :data:`SUPPLIED`)."""
    complete: bool
    """Whether the record has every answer of the run; only then is there a file."""
    success: bool
    """The published verdict on the run."""

    @property
    def path(self) -> Path:
        """Of its file: ``2026-01/gpt-4.1-mini/mixing_module-pump_failure-3.jsonl``."""
        return Path(self.campaign) / self.model / f"{self.case}-{self.scenario}-{self.number}.jsonl"


@dataclass(frozen=True)
class Cost:
    """What one answer took."""

    input_tokens: int = 0
    output_tokens: int = 0
    latency_s: float = 0.0


def campaign(experiment: str) -> str:
    """Year and month in the name of an experiment."""
    found = re.search(r"_(\d{4})(\d{2})\d{2}_", experiment)
    if found is None:
        raise ValueError(f"{experiment!r} names no date as in 'mixer_20260804_184352'")
    return f"{found[1]}-{found[2]}"


def model_name(asked: str, served: str) -> str:
    """The model that answered; where another one was asked for, with that one behind it."""
    plain = re.sub(r"-\d{4}-\d{2}-\d{2}$", "", served)
    return plain if plain == asked else f"{plain}-as-{asked}"


def said(
    agent: str, asked: str, served: str, prompt: str, answer: Mapping[str, Any], reasoning: str, cost: Cost,
    at_s: float = 0.0,
) -> Call:  # fmt: skip
    """An answer; ``prompt`` has the beginnings of the lines that the question must have, and no more.

    A reasoning that is longer than an answer may have is cut.
    """
    short = reasoning if len(reasoning) <= MOST_REASONING else f"{reasoning[: MOST_REASONING - 1]}…"
    return Call(
        agent=agent, at_s=at_s, model=asked, served=served, system="", prompt=prompt, schema={},
        answer=json.dumps({"reasoning": short, **answer}), failure=None, detail="", input_tokens=cost.input_tokens,
        output_tokens=cost.output_tokens, cost_usd=None, latency_s=cost.latency_s,
    )  # fmt: skip


def in_state(state: str) -> str:
    """How the line of a prompt begins that says which state the plant is in."""
    return f"State {state} ("


def for_state(state: str) -> str:
    """How the line of a prompt begins that says which state commands are wanted for."""
    return f"# Commands in state {state} ("


def lines(path: Path) -> list[dict[str, Any]]:
    """The records in a file, none where there is no such file."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8") as file:
        return [json.loads(line) for line in file]
