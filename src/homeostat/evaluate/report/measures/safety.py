"""What the paper does not measure: what the plant went through, and what was produced."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from homeostat.evaluate.report.statistics import Rate, Spread, rate, spread
from homeostat.evaluate.study.row import Row


@dataclass(frozen=True, slots=True)
class Safety:
    """Limits, production and losses of one group, by the true values of the plant."""

    none_outside: Rate
    """Runs in which no hard limit was ever broken."""
    exposure: Spread
    """Longest time outside any one hard limit [s]."""
    exposure_detected: Spread | None
    """The same from detection on [s]."""
    margin: Spread
    """Least margin to any hard limit, each in scales of its unit; negative: broken [1]."""
    closest: str
    """Limit with the worst margin."""
    loss: Spread | None
    """Part of the fault-free production that was lost [1]."""
    complete: Rate | None
    """Batches that were completed; None for a plant that knows no batch."""
    delay: Spread | None
    """How much later than fault-free batches were complete [s]; of those that were."""
    spilled: Spread | None
    """Volume that leaked or overflowed [L]."""


def safety_of(rows: Sequence[Row]) -> Safety:
    """Limits, production and losses of one group; ``rows`` must not be empty."""
    unbroken = rate([row.exposure_s <= 0.0 for row in rows])
    exposure = spread([row.exposure_s for row in rows])
    margin = spread([row.least_margin for row in rows], more_is_better=True)
    assert unbroken is not None and exposure is not None and margin is not None
    return Safety(
        none_outside=unbroken,
        exposure=exposure,
        exposure_detected=spread([row.exposure_detected_s for row in rows if row.exposure_detected_s is not None]),
        margin=margin,
        closest=min((row.least_margin, row.least_margin_limit) for row in rows)[1],
        loss=spread([row.production_loss for row in rows if row.production_loss is not None]),
        complete=rate([row.complete_s is not None for row in rows if row.batch]),
        delay=spread([row.delay_s for row in rows if row.delay_s is not None]),
        spilled=spread([row.spilled_L for row in rows if row.spilled_L is not None]),
    )
