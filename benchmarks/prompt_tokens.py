"""Count the tokens of the reactor's prompts with a real tokenizer (o200k): ``python -m benchmarks.prompt_tokens``.

One row per fault and agent: the first question that a language model is asked after the fault was diagnosed, and the
second one to the action agent, which shows what was refused.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass

from benchmarks.language_runs import reactor, run_with
from homeostat.agents.language.scripts import stubborn
from homeostat.llm.model import Question
from homeostat.llm.scripted import ScriptedModel
from homeostat.llm.tokens import estimate, exact

PUBLISHED = 4450
"""Tokens of one call of the published implementation, without hypotheses, trends and limits."""


@dataclass(frozen=True)
class Count:
    """Length of one question."""

    fault: str
    """Injected fault."""
    agent: str
    """Who asked."""
    number: int
    """Which of its questions."""
    system: int
    """Tokens of role and rules."""
    prompt: int
    """Tokens of the situation."""
    schema: int
    """Tokens of the JSON schema."""
    estimated: float
    """Our own estimate of system and prompt, divided by what was counted."""

    @property
    def shown(self) -> int:
        """Tokens that the model reads as text."""
        return self.system + self.prompt


def counted(text: str) -> int:
    """Tokens by o200k; an error where the tokenizer is missing: an estimate proves nothing here."""
    tokens = exact(text)
    if tokens is None:
        raise SystemExit("the tokenizer is missing: pip install 'homeostat[llm]'")
    return tokens


def counts() -> Iterator[Count]:
    """Every fault, every agent."""
    for fault in reactor().description.faults:
        model = ScriptedModel("scripted:stubborn", stubborn)
        run_with(model, fault.name, 1, end_s=6000.0)
        for agent, number in (("planning", 1), ("action", 1), ("action", 2)):
            asked = [q for q in model.asked if q.agent == agent]
            if len(asked) >= number:
                yield count(fault.name, number, asked[number - 1])


def count(fault: str, number: int, question: Question) -> Count:
    """Length of one question."""
    system, prompt = counted(question.system), counted(question.prompt)
    ratio = estimate(question.system + question.prompt) / (system + prompt)
    return Count(fault, question.agent, number, system, prompt, counted(json.dumps(question.schema)), ratio)


def main() -> None:
    """Print the table."""
    heads = "".join(f"{name:>8}" for name in ("system", "prompt", "shown", "schema"))
    print(f"{'fault':20} {'agent':10} {'question':>8}{heads} {'estimate':>9}")
    for c in counts():
        numbers = f"{c.system:7} {c.prompt:7} {c.shown:7} {c.schema:7} {c.estimated:8.2f}x"
        print(f"{c.fault:20} {c.agent:10} {c.number:8} {numbers}")
    print(f"published implementation: {PUBLISHED} per call")


if __name__ == "__main__":
    main()
