"""``homeostat cases``: the plants that are installed, and what can go wrong with them."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from homeostat.cli.options.arguments import Commands


def configure(commands: Commands) -> None:
    """Declare the command."""
    command = commands.add_parser(
        "cases",
        help="list the plants and their faults",
        description="List the installed plants, and the faults of each with nominal severity, range and unit.",
        allow_abbrev=False,
    )
    command.set_defaults(carry_out=carry_out)


def carry_out(options: argparse.Namespace) -> int:
    """Print every case."""
    from homeostat.cli.table import table
    from homeostat.plants.folder import case_names
    from homeostat.plants.plant import load_case

    for number, name in enumerate(case_names()):
        case = load_case(name)
        if number:
            print()
        print(f"{name}: {case.title}")
        rows = [
            (f.name, f"{f.severity_nominal:g}", f"{f.severity_range.low:g} to {f.severity_range.high:g}",
             "-" if f.severity_unit == "1" else f.severity_unit, f.label)
            for f in case.description.faults
        ]  # fmt: skip
        for line in table(("fault", "nominal", "range", "unit", "what it is"), rows):
            print(f"  {line}")
    return 0
