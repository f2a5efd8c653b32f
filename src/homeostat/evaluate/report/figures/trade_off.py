"""Danger against loss: what each proposer pays in production for the time outside its limits that it avoids."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from homeostat.evaluate.report.figures.picture import QUIET, Picture, colours, picture, plain, short
from homeostat.evaluate.report.groups import Origin, overall, succeeded
from homeostat.evaluate.report.statistics import Estimate, estimate
from homeostat.record.row import Row

_MARKS: Final = "osD^vP*Xhp"


@dataclass(frozen=True, slots=True)
class Point:
    """One proposer."""

    name: str
    """Proposer with what it goes without."""
    words: str
    """Its name in the legend, with its successes."""
    cost: Estimate
    """Mean production loss [%] or delay [s]."""
    exposure: Estimate
    """Mean time outside hard limits [s]."""
    reference: bool = False
    """Whether it shows what was possible instead of proposing."""


def trade_off(plant: str, rows: Sequence[Row]) -> Picture | None:
    """The figure of one plant; None where fewer than two proposers have both values."""
    batch = any(row.batch for row in rows)
    points = _points(rows, batch)
    if len(points) < 2:
        return None
    best = front([point for point in points if not point.reference])
    title = f"Time outside hard limits against {'delay' if batch else 'production loss'}: {plant}"
    caption = (
        "Means over all runs with 95 % bootstrap intervals; lower left is better. Line: proposers that no other one "
        "beats in both; reference policies are hollow and stand outside of it."
    )
    if batch:
        caption += " Delay is that of completed batches alone; the legend says how many runs succeeded."
    colour = colours(rows)

    def draw(figure: Figure) -> None:
        axis = figure.add_subplot()
        axis.plot([p.cost.mean for p in best], [p.exposure.mean for p in best], color=QUIET, linewidth=1.0, zorder=1)
        for number, point in enumerate(points):
            _mark(axis, point, _MARKS[number % len(_MARKS)], colour[point.name])
        axis.set_yscale("symlog", linthresh=1.0, linscale=0.4)
        axis.yaxis.set_major_formatter(plain)
        axis.set_ylim(bottom=-0.15)
        axis.set_xlabel("delay of completed batches [s]" if batch else "production loss [%]")
        axis.set_ylabel("true time outside\na hard limit [s]")
        axis.grid()
        figure.legend(loc="outside right upper", title="successes of runs", alignment="left")

    return picture(title, caption, (8.6, 3.6), draw)


def front(points: Sequence[Point]) -> list[Point]:
    """Points than which no other is at least as good in both values and better in one, by rising cost."""
    return sorted(
        (p for p in points if not any(_beats(other, p) for other in points)),
        key=lambda p: (p.cost.mean, p.exposure.mean, p.name),
    )


def _beats(one: Point, other: Point) -> bool:
    less = one.cost.mean <= other.cost.mean and one.exposure.mean <= other.exposure.mean
    return less and (one.cost.mean, one.exposure.mean) != (other.cost.mean, other.exposure.mean)


def _points(rows: Sequence[Row], batch: bool) -> list[Point]:
    points = []
    for group in overall(rows):
        costs = [row.delay_s if batch else row.production_loss for row in group.rows]
        cost = estimate([value if batch else 100.0 * value for value in costs if value is not None])
        exposure = estimate([row.exposure_s for row in group.rows])
        if cost is not None and exposure is not None:
            good = sum(succeeded(row) for row in group.rows)
            words = f"{short(group.name)}  {good}/{len(group.rows)}"
            points.append(Point(group.name, words, cost, exposure, group.source is Origin.REFERENCE))
    return points


def _mark(axis: Axes, point: Point, mark: str, colour: str) -> None:
    """A point with its intervals."""
    face = "white" if point.reference else colour
    line: dict[str, Any] = {"color": colour, "elinewidth": 1.0, "capsize": 2.0, "zorder": 2, "label": point.words}
    reach: dict[str, Any] = {"xerr": _reach(point.cost), "yerr": _reach(point.exposure)}
    axis.errorbar(point.cost.mean, point.exposure.mean, **reach, fmt=mark, markersize=7.0, markerfacecolor=face, **line)


def _reach(value: Estimate) -> list[list[float]] | None:
    """Distances from the mean to the ends of its interval."""
    i = value.interval
    return None if i is None else [[max(0.0, value.mean - i.low)], [max(0.0, i.high - value.mean)]]
