"""All figures of a report, in its order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from homeostat.evaluate.report.figures.heat_map import heat_map
from homeostat.evaluate.report.figures.reliability import reliability_plot
from homeostat.evaluate.report.figures.strips import PROCESS, TIMES, strips
from homeostat.evaluate.report.figures.svg import Picture
from homeostat.evaluate.report.figures.tokens import token_bars
from homeostat.evaluate.report.figures.trade_off import trade_off
from homeostat.evaluate.report.groups import cases, in_order
from homeostat.evaluate.study.row import Row


@dataclass(frozen=True, slots=True)
class Gallery:
    """The figures of a campaign; what there is no data for is left out."""

    success: tuple[Picture, ...]
    """Heat maps."""
    safety: tuple[Picture, ...]
    """Every run's exposure, margin, loss, delay and detection, and what danger is traded for."""
    diagnosis: tuple[Picture, ...]
    """What a probability is worth."""
    effort: tuple[Picture, ...]
    """Tokens per agent."""
    times: tuple[Picture, ...]
    """Wall-clock times; they depend on the machine."""


def gallery(rows: Sequence[Row]) -> Gallery:
    """Draw them."""
    ordered = in_order(rows)
    per_case = [(f"c{i}", case, [row for row in ordered if row.case == case]) for i, case in enumerate(cases(ordered))]
    safety = [
        picture
        for key, case, own in per_case
        for picture in (strips(f"Every run: {case}", own, PROCESS, f"runs-{key}"), trade_off(case, own, f"trade-{key}"))
    ]
    return Gallery(
        success=tuple(heat_map(case, own, f"heat-{key}") for key, case, own in per_case),
        safety=_drawn(safety),
        diagnosis=_drawn([reliability_plot(ordered, "reliability")]),
        effort=_drawn([token_bars(case, own, f"tokens-{key}") for key, case, own in per_case]),
        times=_drawn([strips(f"Times: {case}", own, TIMES, f"times-{key}") for key, case, own in per_case]),
    )


def _drawn(pictures: Sequence[Picture | None]) -> tuple[Picture, ...]:
    return tuple(picture for picture in pictures if picture is not None)
