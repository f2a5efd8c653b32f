"""``homeostat prompt``: exactly what a language model would be shown, from a run that ends with the question."""

import argparse
import contextlib
import json

from homeostat.agents.language.scripts import reasonable
from homeostat.cli.arguments import UsageError
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.scenario import scenario
from homeostat.links.clock import DeclaredClock
from homeostat.llm.model import Question
from homeostat.llm.scripted import ScriptedModel
from homeostat.llm.tokens import estimate, exact
from homeostat.plants.plant import load_plant
from homeostat.plants.wired.assembly import Language, model_alone

NOT_ASKED = 1
"""Exit status where the run ended without the question."""


class _Asked(BaseException):
    """Ends a run as an interrupt does: the question is there, and nothing that comes after it is shown."""


def carry_out(options: argparse.Namespace) -> int:
    """Run until the question is asked and print it; 1 where it never is."""
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

    def watcher(_: Snapshot) -> None:
        if len(asked) >= options.number:
            raise _Asked

    language = Language(ScriptedModel("shown", answer), tuple(options.note))
    with contextlib.suppress(_Asked):
        run(plant, chosen, clock=DeclaredClock(), proposing=Proposing(language, propose=model_alone), watcher=watcher)
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
