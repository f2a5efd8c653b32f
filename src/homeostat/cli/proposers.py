"""What the options say about who proposes: the same for a run and for an attached plant; nothing is loaded for it."""

import argparse
from typing import Final

from homeostat.cli.arguments import UsageError
from homeostat.service.thinking.consulted import BUDGET_S, ROUTE, SEARCH, Consulted

FOR_A_MODEL: Final = (
    "local_only",
    "allow_host",
    "temperature",
    "model_seed",
    "note",
    "record",
    "grounding",
    "answer_timeout",
    "attempts",
)
"""Values of the options that say nothing to the search."""
MOST_ATTEMPTS: Final = 100
"""Most proposals of a model in one recovery."""
TEMPERATURE: Final = 0.0
"""Temperature of the model where none is given [1]."""
GROUNDING: Final = "graph"
"""What a model is shown of the plant where nothing else is said."""


def consulted(options: argparse.Namespace) -> Consulted:
    """Who is to be asked, whether there is such a model or not; UsageError where options do not go together."""
    given = [f"--{name.replace('_', '-')}" for name in FOR_A_MODEL if _is_given(vars(options)[name])]
    if options.proposer == SEARCH and given:
        raise UsageError(f"{', '.join(given)}: only a language model needs that; name one with --proposer")
    if options.playbook is not None and options.protocol != ROUTE:
        raise UsageError("a playbook has whole recoveries and no single steps; leave --playbook or --protocol out")
    return Consulted(
        proposer=options.proposer,
        local_only=options.local_only,
        allow_hosts=tuple(options.allow_host),
        temperature=temperature(options),
        model_seed=options.model_seed,
        notes=tuple(options.note),
        record=None if options.record is None else str(options.record),
        grounding=options.grounding or GROUNDING,
        answer_s=options.answer_timeout,
        attempts=_attempts(options.attempts),
        budget_s=BUDGET_S if options.budget is None else options.budget,
        protocol=options.protocol,
        playbook=None if options.playbook is None else str(options.playbook),
    )


def temperature(options: argparse.Namespace) -> float:
    """Temperature of the model's sampling [1]."""
    return TEMPERATURE if options.temperature is None else float(options.temperature)


def _attempts(given: int | None) -> int | None:
    if given is not None and not 1 <= given <= MOST_ATTEMPTS:
        raise UsageError(f"--attempts {given} must lie in 1 to {MOST_ATTEMPTS} proposals")
    return given


def _is_given(value: object) -> bool:
    return value is not None and value is not False and value != []  # 0 is given
