"""Do the equations of a plant's flowsheet agree with its tables in their units?"""

from collections.abc import Iterator

from homeostat.domain.plant.description import PlantDescription
from homeostat.plants.error import PlantError
from homeostat.process.blocks.agreement import StatedUnits
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.wrong_unit import WrongUnit, wrong_units
from homeostat.process.model import ProcessModel


def units_of(plant: PlantDescription, model: ProcessModel) -> Iterator[WrongUnit]:
    """Where units do not agree, each mistake once with the cells that explain it; none where no flowsheet is known."""
    if isinstance(model, ComposedModel):
        parameters = {p.symbol: p.unit for p in plant.parameters}
        variables = {signal.variable: signal.tag.unit for signal in plant.signals}
        stated = StatedUnits(parameters, variables, {f.name: f.severity_unit for f in plant.faults})
        yield from wrong_units(model.flowsheet, stated)


def unit_mistakes(name: str, plant: PlantDescription, model: ProcessModel) -> Iterator[str]:
    """Where units of the plant called ``name`` do not agree, a sentence each; none where no flowsheet is known."""
    for each in units_of(plant, model):
        told = " or ".join(f"{cell.name} in {cell.needed} instead of {cell.unit}" for cell in each.cells)
        cause = f", which {told} would put right" if told else ""
        yield f"{name}: {each.said}{cause}; correct the equation or the unit in its table"


def refuse_wrong_units(name: str, plant: PlantDescription, model: ProcessModel) -> None:
    """PlantError with the first mistake that :func:`unit_mistakes` finds, and the number of the others."""
    found = list(unit_mistakes(name, plant, model))
    if found:
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        raise PlantError(f"{found[0]}{more}")
