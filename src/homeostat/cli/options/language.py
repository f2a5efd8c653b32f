"""Options of commands that may ask a language model, and the model that they name."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from homeostat.cli.options.arguments import UsageError, number

if TYPE_CHECKING:
    from homeostat.evaluate.named_model import NamedModel
    from homeostat.plants.assembly import Language

SEARCH = "search"
"""The proposer that is always there."""
FORMS = (
    "search, openai:MODEL, anthropic:MODEL, ollama:MODEL, http://HOST:PORT/v1#MODEL, replay:FILE, situated:FILE, "
    "scripted:reasonable, scripted:stubborn"
)

FOR_A_MODEL = {
    "--local-only": "local_only", "--allow-host": "allow_host", "--temperature": "temperature",
    "--model-seed": "model_seed", "--note": "note", "--record": "record", "--grounding": "grounding",
}  # fmt: skip
"""Options that say nothing to the search -> name of their value."""
TEMPERATURE = 0.0
"""Temperature of the model where none is given [1]."""


def configure(command: argparse.ArgumentParser) -> None:
    """Declare the options."""
    command.add_argument(
        "--proposer", default=SEARCH, metavar="P",
        help=f"who proposes first: {FORMS} (default: search; it follows every other one)",
    )  # fmt: skip
    configure_model(command)
    command.add_argument(
        "--note", action="append", default=[], metavar="TEXT", help="a note of the operator to the model"
    )
    command.add_argument("--record", type=Path, metavar="FILE", help="add every call of the model to FILE (JSON lines)")
    command.add_argument(
        "--grounding", choices=("graph", "documents", "none"),
        help="what the model is shown of the plant: a part of the graph (default), the same facts as text, nothing",
    )  # fmt: skip


def configure_model(command: argparse.ArgumentParser) -> None:
    """Declare the options on how a model is asked."""
    command.add_argument("--local-only", action="store_true", help="refuse any model that is not on this machine")
    command.add_argument(
        "--allow-host", action="append", default=[], metavar="HOST", help="with --local-only: a host to allow as well"
    )
    command.add_argument(
        "--temperature", type=number(0.0, 2.0), metavar="X", help="temperature of the model (default: 0)"
    )
    command.add_argument("--model-seed", type=int, metavar="N", help="seed of the model's own sampling, if it has one")


def speaker(options: argparse.Namespace) -> Language | None:
    """The model that the options name, ready to be asked; None for the search. UsageError where there is none."""
    if options.proposer == SEARCH:
        if idle := [option for option, name in FOR_A_MODEL.items() if _is_given(vars(options)[name])]:
            raise UsageError(f"{', '.join(idle)}: only a language model needs that; name one with --proposer")
        return None
    from homeostat.agents.grounding.context import GroundingKind
    from homeostat.evaluate.named_model import NoSuchModel
    from homeostat.plants.assembly import Language

    try:
        model = chosen_model(options.proposer, options).make()  # first: where there is none, no file is left behind
    except NoSuchModel as error:
        raise UsageError(str(error)) from error
    if options.record is not None:
        _try_to_write(options.record)
    grounding = GroundingKind(options.grounding or GroundingKind.GRAPH)
    return Language(model, tuple(options.note), options.record, grounding)


def _is_given(value: object) -> bool:
    return value is not None and value is not False and value != []  # 0 is given


def chosen_model(name: str, options: argparse.Namespace) -> NamedModel:
    """The model called ``name``, to be asked as the options say."""
    from homeostat.evaluate.named_model import NamedModel

    temperature = TEMPERATURE if options.temperature is None else options.temperature
    return NamedModel(name, options.local_only, tuple(options.allow_host), temperature, options.model_seed)


def _try_to_write(path: Path) -> None:
    """OSError where calls could not be added to ``path``; an empty file is left where there was none."""
    with path.open("a", encoding="utf-8"):
        pass
