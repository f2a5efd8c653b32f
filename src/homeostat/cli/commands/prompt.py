"""``homeostat prompt``: exactly what a language model would be shown, from a run that goes on to its end."""

import argparse
import json

from homeostat.agents.language.scripts import reasonable
from homeostat.cli.arguments import UsageError
from homeostat.evaluate.scenario import scenario
from homeostat.links.clock import DeclaredClock
from homeostat.llm.model import Question
from homeostat.llm.scripted import ScriptedModel
from homeostat.llm.tokens import estimate, exact
from homeostat.plants.assembly import Language
from homeostat.plants.plant import load_plant

NOT_ASKED = 1
"""Exit status where the run ended without the question."""


def carry_out(options: argparse.Namespace) -> int:
    """Run, stop at the question, print it; 1 where it was never asked."""
    if options.number < 1:
        raise UsageError(f"--number {options.number} must be at least 1")
    from homeostat.evaluate.proposing import Proposing
    from homeostat.evaluate.runner import run

    plant = load_plant(options.case)
    fault = options.fault or max(plant.description.faults, key=lambda f: f.prior).name
    chosen = scenario(plant, fault, options.seed, options.onset, options.severity, None)
    asked: list[Question] = []

    def answer(question: Question) -> str:
        if question.agent == options.agent:
            asked.append(question)
        return reasonable(question)

    language = Language(ScriptedModel("shown", answer), tuple(options.note))
    run(plant, chosen, clock=DeclaredClock(), proposing=Proposing(language))
    if len(asked) >= options.number:
        _show(asked[options.number - 1])
        return 0
    print(f"{options.agent} was not asked {options.number} times in this run: nothing needed it")
    return NOT_ASKED


def _show(question: Question) -> None:
    schema = json.dumps(question.schema)
    print(question.system, question.prompt, schema, sep="\n\n---\n\n")
    parts = {"system": question.system, "prompt": question.prompt, "schema": schema}
    counts = {name: (estimate(text), exact(text)) for name, text in parts.items()}
    told = ", ".join(f"{name} {about if count is None else count}" for name, (about, count) in counts.items())
    how = "o200k" if all(count is not None for _, count in counts.values()) else "estimated"
    print(f"\n---\n\ntokens ({how}): {told}; prompt files {question.template_sha256[:12]}")
