"""``homeostat graph check``: does a plant's graph have its shape, and does it agree with tables and model?"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from homeostat.cli.arguments import Commands
    from homeostat.cli.graphs import Place
    from homeostat.knowledge.consistency import ModelInterface
    from homeostat.knowledge.store import GraphStore


def configure(commands: Commands) -> None:
    """Declare the command."""
    command = commands.add_parser(
        "check",
        help="check a plant's graph against shapes, tables and process model",
        description="Check a plant's graph: its shapes (SHACL), its consistency, its agreement with the engineering "
        "tables that it was built from and with the process model. Every problem is one line. So is every text that "
        "reads as if it were written for a language model, but that is a warning and no problem.",
        epilog="Exit status: 0 no problem, 1 problems were found, 2 the graph cannot be read.",
        allow_abbrev=False,
    )
    command.add_argument("case", metavar="CASE", help="name of the plant")
    command.add_argument("--graph", type=Path, metavar="FILE", help="Turtle file to check instead of the plant's own")
    command.set_defaults(carry_out=carry_out)


def carry_out(options: argparse.Namespace) -> int:
    """Print every problem; 1 where there is any."""
    from homeostat.cli.graphs import opened, place

    where = place(options.case, options.graph)
    store = opened(where)
    count = 0
    for problem in _problems(where, store):
        print(" ".join(problem.split()))
        count += 1
    warnings = _warn(store)
    told = f"{count} problem{'' if count == 1 else 's'}" if count else "no problem"
    print(f"{where.path}: {told}" + (f", {warnings} suspicious text{'' if warnings == 1 else 's'}" if warnings else ""))
    return 1 if count else 0


def _warn(store: GraphStore) -> int:
    """Print every suspicious text; how many there are."""
    from homeostat.knowledge.suspicion import suspicions

    found = suspicions(store)
    for suspicion in found:
        print(f"warning: {suspicion}")
    return len(found)


def _problems(where: Place, store: GraphStore) -> Iterator[str]:
    from homeostat.knowledge.conformance import check_shapes
    from homeostat.knowledge.consistency import inconsistencies
    from homeostat.knowledge.description.plant import read_plant
    from homeostat.knowledge.graph_error import Code, GraphError
    from homeostat.knowledge.provenance import stale_tables

    for table in stale_tables(where.folder, where.path.read_bytes()):
        yield f"[{Code.STALE_GRAPH}] table {table!r}: changed after the graph was built; run 'make graph'"
    yield from map(str, check_shapes(store))
    try:
        plant = read_plant(store, where.system)
    except GraphError as error:
        yield str(error)  # what cannot be read cannot be compared
        return
    yield from map(str, inconsistencies(plant, _interface(where)))


def _interface(where: Place) -> ModelInterface:
    """What the case's process model offers; a case whose own graph is wrong cannot be loaded as a whole."""
    import importlib

    from homeostat.cases.graph import interface
    from homeostat.process.model import ProcessModel

    module, _, attribute = where.model.partition(":")
    model: ProcessModel = getattr(importlib.import_module(module), attribute)()
    return interface(model, where.horizon_s)
