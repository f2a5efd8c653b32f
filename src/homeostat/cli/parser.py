"""Every command with its arguments, as ``commands.toml`` has them."""

import argparse
import tomllib
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any, TypeAlias

from homeostat import __version__
from homeostat.cli.arguments import ENDINGS, LEAST_DIGITS, Parser, number, whole

Commands: TypeAlias = "argparse._SubParsersAction[Parser]"
ENDING = """\
exit status:
  0  done; a run: the plant recovered, or was rightly left alone
  1  a problem was found (graph check, plant verify, trace verify, replay, monitor), there was nothing to show
     (prompt), or runs of a study could not be carried out; or an error of the program itself; a run: its result
     could not be stored, a full disk for example
  2  the command cannot be carried out as given; one line on standard error says why
  3  a run: the plant is held, or the fallback acted; an order to a run: refused by its guard; trace verify: nobody
     signed the run, which is in the format from before signatures
  4  a run: something was done without need, or a fault that violates a limit was not detected
  5  a run: a hard limit was violated that could have been kept, or is violated at the end
  130  interrupted with Ctrl-C; the trace of the run is closed
"""


def parser() -> Parser:
    """The parser of the whole command line; a parsed command has the name of its function in ``carry_out``."""
    top = Parser(
        prog="homeostat",
        description="Closed-loop fault recovery for process plants: propose, try on the twin, judge, release.",
        epilog=ENDING,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    top.add_argument("--version", action="version", version=f"homeostat {__version__}")
    content = tomllib.loads(files(__package__).joinpath("commands.toml").read_text("utf-8"))
    texts = {**content.pop("texts"), "endings": ENDINGS, "digits": str(LEAST_DIGITS)}
    shared = content.pop("shared")

    def declare(commands: Commands, entries: Mapping[str, Any]) -> None:
        for name, entry in entries.items():
            if "does" in entry:
                _command(commands, name, entry, shared, texts)
            else:
                inner = commands.add_parser(name, help=entry.pop("help"))
                declare(inner.add_subparsers(metavar="WHAT", required=True), entry)

    declare(top.add_subparsers(metavar="COMMAND", required=True), content)
    return top


def _command(
    commands: Commands, name: str, entry: Mapping[str, Any], shared: Mapping[str, Any], texts: Mapping[str, str]
) -> None:
    """One command, which the function ``does`` ("module:function" below `homeostat.cli.commands`) carries out."""
    about, ending = entry["about"], Template(entry.get("ending", "")).substitute(texts)
    made = commands.add_parser(name, help=entry["help"], description=about, epilog=ending or None, allow_abbrev=False)
    groups: dict[str, Any] = {}
    for option in (o for given in entry["options"] for o in shared.get(given.get("use"), (given,))):
        given = {**option, "help": Template(option["help"]).substitute(texts)}
        names, kind, either = given.pop("name").split(), given.pop("type", None), given.pop("either", None)
        if kind is not None:
            given["type"] = {"path": Path, "int": int}[kind]
        for converter in (number, whole):
            if (ends := given.pop(converter.__name__, None)) is not None:
                given["type"] = converter(*ends)
        if either is not None and either not in groups:
            groups[either] = made.add_mutually_exclusive_group()
        groups.get(either, made).add_argument(*names, **given)
    made.set_defaults(command=made, carry_out=entry["does"], **entry.get("defaults", {}))
