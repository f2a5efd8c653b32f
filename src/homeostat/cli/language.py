"""The language model that the options name."""

import argparse

from homeostat.agents.grounding.context import GroundingKind
from homeostat.cli.arguments import SEARCH, UsageError
from homeostat.evaluate.named_model import NamedModel, NoSuchModel
from homeostat.plants.assembly import Language

FOR_A_MODEL = ("local_only", "allow_host", "temperature", "model_seed", "note", "record", "grounding")
"""Values of the options that say nothing to the search."""
TEMPERATURE = 0.0
"""Temperature of the model where none is given [1]."""


def speaker(options: argparse.Namespace) -> Language | None:
    """The model that the options name, ready to be asked; None for the search. UsageError where there is none."""
    if options.proposer == SEARCH:
        if idle := [f"--{name.replace('_', '-')}" for name in FOR_A_MODEL if _is_given(vars(options)[name])]:
            raise UsageError(f"{', '.join(idle)}: only a language model needs that; name one with --proposer")
        return None

    try:
        model = chosen_model(options.proposer, options).make()  # first: where there is none, no file is left behind
    except NoSuchModel as error:
        raise UsageError(str(error)) from error
    if options.record is not None:
        options.record.open("a").close()  # OSError where calls could not be added; an empty file where there was none
    grounding = GroundingKind(options.grounding or GroundingKind.GRAPH)
    return Language(model, tuple(options.note), options.record, grounding)


def _is_given(value: object) -> bool:
    return value is not None and value is not False and value != []  # 0 is given


def chosen_model(name: str, options: argparse.Namespace) -> NamedModel:
    """The model called ``name``, to be asked as the options say."""
    temperature = TEMPERATURE if options.temperature is None else options.temperature
    return NamedModel(name, options.local_only, tuple(options.allow_host), temperature, options.model_seed)
