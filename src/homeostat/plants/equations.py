"""Do the equations of a plant's flowsheet agree with its tables in their units?"""

from collections.abc import Iterator

from homeostat.domain.plant.description import PlantDescription
from homeostat.plants.error import PlantError
from homeostat.process.blocks.agreement import StatedUnits, disagreements
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.model import ProcessModel


def unit_mistakes(name: str, plant: PlantDescription, model: ProcessModel) -> Iterator[str]:
    """Where units of the plant called ``name`` do not agree, a sentence each; none where no flowsheet is known."""
    if isinstance(model, ComposedModel):
        parameters = {p.symbol: p.unit for p in plant.parameters}
        variables = {signal.variable: signal.tag.unit for signal in plant.signals}
        stated = StatedUnits(parameters, variables, {f.name: f.severity_unit for f in plant.faults})
        for each in disagreements(model.flowsheet, stated):
            yield f"{name}: {each}; correct the equation or the unit in its table"


def refuse_wrong_units(name: str, plant: PlantDescription, model: ProcessModel) -> None:
    """PlantError with the first mistake that :func:`unit_mistakes` finds, and the number of the others."""
    found = list(unit_mistakes(name, plant, model))
    if found:
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        raise PlantError(f"{found[0]}{more}")
