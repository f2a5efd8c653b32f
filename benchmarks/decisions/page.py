"""The page: what decisions cost against the best constant, and how a repaired plant comes back."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from statistics import fmean

from benchmarks.decisions.measure import FAR, Decision
from benchmarks.decisions.repair import WITHIN_S, Repair
from benchmarks.host import commit, measured_on
from benchmarks.unknown.sections import table

HEAD = """# What decisions cost

Made by `python -m benchmarks.decisions` for commit `{commit}`: both plants with mismatch `plant`, faults of the
tables with severities and onsets that a seed draws, everything on, thinking declared as one second. The command
is resumable; each section says how many of its runs are in."""
BEST = """## Against the best constant

Costs in points of the design production, from detection to the end of the run. *Best constant*: the least cost
over constant values of everything that may be commanded, manual outputs too, from one second after detection
on, found with hindsight on the true plant, of those that keep every hard limit. Asked for: within 3 points of
it in the mean, 95 % of the runs within 8. Runs for which no constant keeps the limits are counted apart."""
ROUTE = """## Batches against the best route

The same of the batch module. *Best route*: the least cost of leaving the batch alone and of every way through the
machine from the state that it is in at detection, with three values of everything that is open on the way, found
with hindsight on the true plant, of those that keep every hard limit."""
FURTHER = f"""Every run that costs more than {FAR:.0f} points more. *On the knowledge of the moment*: what the
cheapest of all choices on a grid, leaving the plant alone among them, costs on the true plant, where the twin that the
first decision was made on chooses in place of hindsight, and what it chooses stays for good."""
REPAIR = """## The way back

The fault is repaired 1,500 s after its onset, and the plant is followed for 2,700 s. Asked for: back in normal
operation within 30 minutes, at most 1 K and 0.2 L off the ramped setpoint after the return, nothing violated.
Runs that a fallback had stopped before are counted apart: from there a person starts the plant again. So are runs
that were in normal operation when the fault was repaired, and stayed there: they have no way back."""


def write(path: Path, sections: Sequence[str]) -> None:
    """Write the page of what is in."""
    head = HEAD.format(commit=commit("src", "benchmarks/decisions"))
    path.write_text("\n\n".join((head, *sections, measured_on())) + "\n", encoding="utf-8")


def against_constants(decisions: Sequence[Decision], runs: int) -> str:
    """The section about the reactor, of which so many ``runs`` are wanted."""
    return f"{BEST}\n\n{_against(decisions, runs, 'best constant')}"


def against_routes(decisions: Sequence[Decision], runs: int) -> str:
    """The section about batches, of which so many ``runs`` are wanted."""
    return f"{ROUTE}\n\n{_against(decisions, runs, 'best route')}"


def way_back(repairs: Sequence[Repair], runs: int) -> str:
    """The section about repairs, of which so many ``runs`` are wanted."""
    return f"{REPAIR}\n\n{_back(repairs, runs)}"


def _against(decisions: Sequence[Decision], runs: int, best: str) -> str:
    header = (
        "fault",
        "runs",
        "detected",
        "cost",
        best,
        "more in the mean",
        f"within {FAR:.0f} points",
        f"no {best.removeprefix('best ')}",
        "outside a hard limit",
        "fallbacks",
    )
    rows = []
    for fault in dict.fromkeys(d.fault for d in decisions):
        every = [d for d in decisions if d.fault == fault]
        held = [(d.cost, d.best) for d in every if d.cost is not None and d.best is not None]
        more = [cost - best for cost, best in held]
        rows.append((
            fault, len(every), sum(d.detected_s is not None for d in every), _mean([c for c, _ in held]),
            _mean([b for _, b in held]), _mean(more), f"{sum(x <= FAR for x in more)} of {len(more)}",
            sum(d.cost is not None and d.best is None for d in every), sum(d.outside_s > 0.0 for d in every),
            sum(d.outcome == "fallback" for d in every),
        ))  # fmt: skip
    return f"{len(decisions)} of {runs} runs are in.\n\n{table(header, rows)}{_far(decisions, best)}"


def _far(decisions: Sequence[Decision], best: str) -> str:
    """Every run that costs far more than the best, beside what could be known; empty where there is none."""
    rows = [
        (d.fault, f"{d.severity:.3f}", d.seed, d.outcome.replace("_", " "), _told(d.cost), _told(d.best),
         _told(d.informed), _told(d.alone, "violates a limit"))
        for d in sorted(decisions, key=lambda d: (d.fault, d.seed))
        if d.cost is not None and d.best is not None and d.cost - d.best > FAR
    ]  # fmt: skip
    header = ("fault", "severity", "seed", "outcome", "cost", best, "on the knowledge of the moment", "left alone")
    return f"\n\n{FURTHER}\n\n{table(header, rows)}" if rows else ""


def _back(repairs: Sequence[Repair], runs: int) -> str:
    header = (
        "fault",
        "runs",
        "stopped before",
        "never away",
        f"back within {WITHIN_S / 60:.0f} min",
        "noticed after, mean",
        "back after, mean",
        "furthest off T1 [K]",
        "furthest off L1 [L]",
        "within 1 K and 0.2 L",
        "violated after",
    )
    rows = []
    for fault in dict.fromkeys(r.fault for r in repairs):
        every = [r for r in repairs if r.fault == fault]
        stayed = [r for r in every if r.stayed and not r.stopped]
        going = [r for r in every if not (r.stopped or r.stayed)]
        back = [r for r in going if r.returned]
        near = sum(r.off["T1"] <= 1.0 and r.off["L1"] <= 0.2 for r in back)
        rows.append((
            fault, len(every), sum(r.stopped for r in every), len(stayed), f"{len(back)} of {len(going)}",
            _mean([r.noticed_s for r in going if r.noticed_s is not None], " s"),
            _mean([r.back_s for r in back if r.back_s is not None], " s"), _most([r.off["T1"] for r in back]),
            _most([r.off["L1"] for r in back]), f"{near} of {len(back)}",
            sum(r.outside_s > 0.0 for r in (*going, *stayed)),
        ))  # fmt: skip
    return f"{len(repairs)} of {runs} runs are in.\n\n{table(header, rows)}"


def _told(value: float | None, lacking: str = "none") -> str:
    return lacking if value is None else f"{value:.1f}"


def _mean(values: Sequence[float], unit: str = "") -> str:
    return f"{fmean(values):.1f}{unit}" if values else "none"


def _most(values: Sequence[float]) -> str:
    return f"{max(values):.2f}" if values else "none"
