"""``homeostat cases``: the plants that are installed, and what can go wrong with them."""

import argparse

from homeostat.cli.table import show_table
from homeostat.domain.diagnosis import FaultMode
from homeostat.plants.files.folder import plant_names
from homeostat.plants.plant import load_plant


def carry_out(options: argparse.Namespace) -> int:
    """Print every plant."""
    for number, name in enumerate(plant_names()):
        plant = load_plant(name)
        print("\n" * bool(number) + f"{name}: {plant.title}")
        show_table(("fault", "nominal", "range", "unit", "what it is"), list(map(_told, plant.description.faults)), 2)
    return 0


def _told(fault: FaultMode) -> tuple[str, ...]:
    span, unit = fault.severity_range, "-" if fault.severity_unit == "1" else fault.severity_unit
    return fault.name, f"{fault.severity_nominal:g}", f"{span.low:g} to {span.high:g}", unit, fault.label
