"""``homeostat cases``: the plants that have a name here, and what can go wrong with them."""

import argparse
import sys

from homeostat.cli.table import show_table
from homeostat.domain.diagnosis import FaultMode
from homeostat.domain.quotation import printable
from homeostat.knowledge.store.error import GraphError
from homeostat.plants.error import PlantError
from homeostat.plants.files.places import plant_names, troubles
from homeostat.plants.plant import load_plant


def carry_out(options: argparse.Namespace) -> int:
    """Print every plant; 1 where one cannot be loaded."""
    status = 0
    for line in troubles():
        print(printable(f"homeostat: {line}"), file=sys.stderr)
        status = 1
    for number, name in enumerate(plant_names()):
        try:
            plant = load_plant(name)
        except (PlantError, GraphError) as error:
            print(printable(f"homeostat: plant {name!r} cannot be loaded: {error}"), file=sys.stderr)
            status = 1
            continue
        print("\n" * bool(number) + f"{name}: {plant.title}")
        show_table(("fault", "nominal", "range", "unit", "what it is"), list(map(_told, plant.description.faults)), 2)
    return status


def _told(fault: FaultMode) -> tuple[str, ...]:
    span, unit = fault.severity_range, "-" if fault.severity_unit == "1" else fault.severity_unit
    return fault.name, f"{fault.severity_nominal:g}", f"{span.low:g} to {span.high:g}", unit, fault.label
