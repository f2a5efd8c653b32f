"""``homeostat prompt``: exactly what a language model would be shown, from a run that goes on to its end."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING

from homeostat.cli.options.arguments import UsageError, number

if TYPE_CHECKING:
    from homeostat.cli.options.arguments import Commands
    from homeostat.llm.model import Question

AGENTS = ("planning", "action", "reprompting")
NOT_ASKED = 1
"""Exit status where the run ended without the question."""


def configure(commands: Commands) -> None:
    """Declare the command."""
    command = commands.add_parser(
        "prompt",
        help="show what a language model would be asked",
        description="Run a scenario, and print a question that a language model is asked in it, with its length.",
        allow_abbrev=False,
    )
    command.add_argument("case", metavar="CASE", help="name of the plant")
    command.add_argument("--agent", choices=AGENTS, default="action", help="whose question (default: action)")
    command.add_argument("--fault", metavar="F", help="fault (default: the plant's most frequent one)")
    command.add_argument(
        "--seed", type=int, default=1, metavar="N", help="seed of the plant and its noise (default: 1)"
    )
    command.add_argument("--onset", type=number(), metavar="S", help="when the fault begins [s of process time]")
    command.add_argument("--severity", type=number(), metavar="X", help="size of the fault, in its unit")
    command.add_argument(
        "--number", type=int, default=1, metavar="N",
        help="the agent's N-th question: later ones show what was refused (default: 1)",
    )  # fmt: skip
    command.add_argument(
        "--note", action="append", default=[], metavar="TEXT", help="a note of the operator to the model"
    )
    command.set_defaults(carry_out=carry_out)


def carry_out(options: argparse.Namespace) -> int:
    """Run, stop at the question, print it; 1 where it was never asked."""
    if options.number < 1:
        raise UsageError(f"--number {options.number} must be at least 1")
    from homeostat.agents.language.scripts import reasonable
    from homeostat.evaluate.runner import run
    from homeostat.evaluate.scenario import scenario
    from homeostat.links.clock import DeclaredClock
    from homeostat.llm.scripted import ScriptedModel
    from homeostat.plants.assembly import Language
    from homeostat.plants.plant import load_case

    case = load_case(options.case)
    fault = options.fault or max(case.description.faults, key=lambda f: f.prior).name
    chosen = scenario(case, fault, options.seed, options.onset, options.severity, None)
    asked: list[Question] = []

    def answer(question: Question) -> str:
        if question.agent == options.agent:
            asked.append(question)
        return reasonable(question)

    run(case, chosen, clock=DeclaredClock(), language=Language(ScriptedModel("shown", answer), tuple(options.note)))
    if len(asked) >= options.number:
        _show(asked[options.number - 1])
        return 0
    print(f"{options.agent} was not asked {options.number} times in this run: nothing needed it")
    return NOT_ASKED


def _show(question: Question) -> None:
    from homeostat.llm.tokens import estimate, exact

    schema = json.dumps(question.schema)
    print(question.system, question.prompt, schema, sep="\n\n---\n\n")
    parts = {"system": question.system, "prompt": question.prompt, "schema": schema}
    counts = {name: (estimate(text), exact(text)) for name, text in parts.items()}
    told = ", ".join(f"{name} {about if count is None else count}" for name, (about, count) in counts.items())
    how = "o200k" if all(count is not None for _, count in counts.values()) else "estimated"
    print(f"\n---\n\ntokens ({how}): {told}; prompt files {question.template_sha256[:12]}")
