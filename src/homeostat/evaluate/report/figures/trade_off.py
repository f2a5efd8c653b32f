"""Danger against loss: what each proposer pays in production for the time outside its limits that it avoids."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from homeostat.evaluate.report.figures.svg import QUIET, Picture, as_svg, colours, look, plain, short
from homeostat.evaluate.report.groups import Source, overall, succeeded
from homeostat.evaluate.report.statistics import Estimate, estimate
from homeostat.evaluate.study.row import Row

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
    yardstick: bool = False
    """Whether it shows what was possible instead of proposing."""


def trade_off(case: str, rows: Sequence[Row], name: str) -> Picture | None:
    """The figure of one case; None where fewer than two proposers have both values."""
    batch = any(row.batch for row in rows)
    points = _points(rows, batch)
    if len(points) < 2:
        return None
    best = front([point for point in points if not point.yardstick])
    title = f"Time outside hard limits against {'delay' if batch else 'production loss'}: {case}"
    caption = (
        "Means over all runs with 95 % bootstrap intervals; lower left is better. Line: proposers that no other one "
        "beats in both; yardsticks are hollow and stand outside of it."
    )
    if batch:
        caption += " Delay is that of completed batches alone; the legend says how many runs succeeded."
    return Picture(title, caption, _draw(points, best, batch, colours(rows), name, title))


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
            points.append(Point(group.name, words, cost, exposure, group.source is Source.YARDSTICK))
    return points


def _draw(
    points: Sequence[Point], best: Sequence[Point], batch: bool, colour: dict[str, str], name: str, spoken: str
) -> str:
    from matplotlib.figure import Figure

    with look(name):
        figure = Figure(figsize=(8.6, 3.6), layout="constrained")
        axis = figure.add_subplot()
        axis.plot([p.cost.mean for p in best], [p.exposure.mean for p in best], color=QUIET, linewidth=1.0, zorder=1)
        for number, point in enumerate(points):
            x, y = point.cost, point.exposure
            axis.errorbar(
                x.mean, y.mean, xerr=_reach(x), yerr=_reach(y), fmt=_MARKS[number % len(_MARKS)], markersize=7.0,
                color=colour[point.name], elinewidth=1.0, capsize=2.0,
                markerfacecolor="white" if point.yardstick else colour[point.name], label=point.words, zorder=2,
            )  # fmt: skip
        axis.set_yscale("symlog", linthresh=1.0, linscale=0.4)
        axis.yaxis.set_major_formatter(plain)
        axis.set_ylim(bottom=-0.15)
        axis.set_xlabel("delay of completed batches [s]" if batch else "production loss [%]")
        axis.set_ylabel("true time outside\na hard limit [s]")
        axis.grid(color="#e6e9ed", linewidth=0.6)
        axis.set_axisbelow(True)
        figure.legend(loc="outside right upper", title="successes of runs", alignment="left")
        return as_svg(figure, name, spoken)


def _reach(value: Estimate) -> list[list[float]] | None:
    """Distances from the mean to the ends of its interval."""
    i = value.interval
    return None if i is None else [[max(0.0, value.mean - i.low)], [max(0.0, i.high - value.mean)]]
