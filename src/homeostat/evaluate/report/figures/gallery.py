"""All figures of a report, in its order."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from homeostat.evaluate.report.figures.heat_map import heat_map
from homeostat.evaluate.report.figures.picture import Picture
from homeostat.evaluate.report.figures.reliability import reliability_plot
from homeostat.evaluate.report.figures.strips import PROCESS, TIMES, strips
from homeostat.evaluate.report.figures.tokens import token_bars
from homeostat.evaluate.report.figures.trade_off import trade_off
from homeostat.evaluate.report.groups import in_order, plants
from homeostat.record.row import Row


class Gallery(NamedTuple):
    """The figures of a study; what there is no data for is left out."""

    pictures: tuple[Picture, ...]
    """Success, what the plant went through, what was diagnosed, what was asked."""
    times: tuple[Picture, ...]
    """Wall-clock times; they depend on the machine."""


def gallery(rows: Sequence[Row]) -> Gallery:
    """Draw them."""
    ordered = in_order(rows)
    own = {plant: [row for row in ordered if row.case == plant] for plant in plants(ordered)}

    def drawn() -> Iterator[Picture | None]:
        yield from (heat_map(plant, mine) for plant, mine in own.items())
        for plant, mine in own.items():
            yield strips(f"Every run: {plant}", mine, PROCESS)
            yield trade_off(plant, mine)
        yield reliability_plot(ordered)
        yield from (token_bars(plant, mine) for plant, mine in own.items())

    times = [strips(f"Times: {plant}", mine, TIMES) for plant, mine in own.items()]
    return Gallery(tuple(filter(None, drawn())), tuple(filter(None, times)))
