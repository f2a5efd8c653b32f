"""Batches in tables: one line per family, and every batch that was not as good as it could have been."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

from benchmarks.cstr_results import table
from benchmarks.mixing_batches import PUBLISHED, Row, safe

WHOLE = 0.9
"""A batch that gives less than this share of the fault-free product has given a part of it only [1]."""


def summary(rows: Sequence[Row]) -> str:
    """One line per family."""
    lines = []
    whole_L = WHOLE * median(r.totals["delivered_L"] for r in rows if r.family == "none")
    for family in dict.fromkeys(r.family for r in rows):
        mine = [r for r in rows if r.family == family]
        done = [r for r in mine if r.complete_s is not None]
        possible = [r for r in mine if r.best_s is not None]
        late = [r.complete_s - r.nominal_s for r in done if r.complete_s is not None and r.nominal_s is not None]
        thought = [r.thinking_s for r in mine if r.attempts]
        lines.append([
            family, f"{len(done)}/{len(mine)}", f"{sum(r.totals['delivered_L'] < whole_L for r in done)}",
            f"{sum(r.state == 'held' for r in mine)}",
            f"{sum(r.actor == 'fallback' for r in mine)}", f"{sum(safe(r) for r in mine)}/{len(mine)}",
            f"{sum(not safe(r) and r.latest_s is None for r in mine)}",
            f"{sum(r.complete_s is not None for r in possible)}/{len(possible)}",
            f"{sum(r.bypass for r in mine)}", f"{sum(r.best_bypass for r in mine)}",
            f"{median(late):.0f} ({max(late):.0f})" if late else "",
            f"{max(r.totals['spilled_L'] for r in mine):.2f}",
            f"{median(thought):.1f} ({max(thought):.1f})" if thought else "", f"{sum(r.departures for r in mine)}",
        ])  # fmt: skip
    head = [
        "fault", "complete", "with part of the product", "held", "fallback",
        "no overflow, dry run, dead head, hard limit", "beyond any fallback", "complete where possible",
        "by the bypass", "bypass best by hindsight", "later than nominal, median (max) [s]", "spilled, max [L]",
        "thinking, median (max) [s]", "departures from the prediction",
    ]  # fmt: skip
    return table(head, lines)


def needless(rows: Sequence[Row]) -> str:
    """How often the bypass was taken although the main line was the best way by hindsight, and the other way round."""
    done = [r for r in rows if r.family in PUBLISHED and r.best_s is not None and r.complete_s is not None]
    main = [r for r in done if not r.best_bypass]
    other = [r for r in done if r.best_bypass]
    return (
        f"Of {len(main)} batches with a published fault whose best way by hindsight is the main line, "
        f"{sum(r.bypass for r in main)} went through the bypass; of {len(other)} whose best way is the bypass, "
        f"{sum(not r.bypass for r in other)} stayed on the main line and were "
        f"{max((_later_s(r) for r in other if not r.bypass), default=0.0):.0f} s later at most."
    )


def odd(rows: Sequence[Row]) -> str:
    """Batches that were possible and not completed, or not safe."""
    found = [r for r in rows if not safe(r) or (r.best_s is not None and r.complete_s is None)]
    lines = [
        [r.fault, str(r.seed), numbers(r.severity, "g"), numbers(r.onset_s, ".0f"), r.state, r.actor,
         "" if r.best_s is None else f"{r.best_s:.0f}", _latest(r),
         ", ".join(f"{k} {v:.3g}" for k, v in r.totals.items() if v)]
        for r in found
    ]  # fmt: skip
    head = [
        "fault",
        "seed",
        "severity",
        "onset [s]",
        "ended in",
        "actor",
        "best complete [s]",
        "latest fallback [s after the onset]",
        "totals",
    ]
    return table(head, lines) if found else "None."


def _latest(row: Row) -> str:
    """How late a fallback could have acted, for a batch that was not safe."""
    if safe(row):
        return ""
    return "none in time" if row.latest_s is None else f"{row.latest_s}"


def numbers(found: Sequence[float], form: str) -> str:
    """One number per fault."""
    return " + ".join(format(number, form) for number in found)


def _later_s(row: Row) -> float:
    """How much later than the best by hindsight a batch was complete [s]."""
    assert row.complete_s is not None and row.best_s is not None
    return row.complete_s - row.best_s
