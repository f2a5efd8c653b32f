"""Balances of a plant's settings: what may be disturbed by what nobody knows of."""

import math
from collections.abc import Iterable, Mapping

from homeostat.domain.plant.description import PlantDescription
from homeostat.plants.error import PlantError
from homeostat.plants.settings.settings import BalanceTable
from homeostat.process.model import ProcessModel
from homeostat.stl.constants import filled
from homeostat.stl.formula import Expression, FormulaError, parse_expression
from homeostat.stl.spelling import near_matches
from homeostat.stl.text import render
from homeostat.twin.settings import Balance


def read_balances(
    file: str, tables: Mapping[str, BalanceTable], plant: PlantDescription, model: ProcessModel
) -> tuple[Balance, ...]:
    """The ``[twin.balances]`` tables; PlantError naming ``file`` where one names what plant or model do not have."""
    found = []
    for state, table in tables.items():
        where = f"{file}: twin, balances, {state}"
        _refuse_unknown(where, "state variable", state, model.states)
        _refuse_unknown(where, "component", table.component, (c.name for c in plant.components))
        capacity = _capacity(where, table.capacity, plant)
        own = table.quantity, table.component, table.unit, capacity, table.large, table.only_lost
        found.append(Balance(state, *own, most=math.inf if table.most is None else table.most))
    return tuple(found)


def _capacity(where: str, text: str, plant: PlantDescription) -> Expression:
    """The expression with numbers in place of parameters."""
    tags = plant.tags_by_name
    values = {p.symbol: p.value for p in plant.parameters if p.symbol not in tags}
    try:
        read = parse_expression(text)
        for name in sorted(read.tags - values.keys()):
            _refuse_unknown(where, "tag or parameter", name, {*tags, *values})
        return parse_expression(render(filled(read.root, values)))
    except FormulaError as error:
        raise PlantError(f"{where}: capacity {text!r}: {error}") from None


def _refuse_unknown(where: str, what: str, name: str, known: Iterable[str]) -> None:
    have = sorted(known)
    if name not in have:
        raise PlantError(f"{where}: the plant has no {what} {name!r}{near_matches(name, have)}")
