"""Every claim on the guard with its bar beside the figure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from benchmarks.guard.cost import EARLIER
from benchmarks.guard.store import FULL

PLANTS = ("cstr", "mixing_module")
Results = dict[str, Any]


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join([*lines, *("| " + " | ".join(str(c) for c in r) + " |" for r in rows)])


def both(parts: dict[str, Results], kind: str) -> list[Results]:
    return [parts[f"{kind}-{plant}"] for plant in PLANTS if f"{kind}-{plant}" in parts]


def _row(claim: str, bar: str, figure: str, met: bool) -> tuple[str, str, str, str]:
    return claim, bar, figure, "yes" if met else "**no**"


def claims(parts: dict[str, Results]) -> str:
    """Every claim with its bar; those that could not be measured are missing and are named at the end."""
    rows = [*_trip_claims(parts), *_day_claims(parts), *_other_claims(parts)]
    return "## Claims\n\n" + table(("claim", "bar", "measured", "met"), rows)


def _trip_claims(parts: dict[str, Results]) -> list[tuple[str, str, str, str]]:
    if "trips" not in parts:
        return []
    steps = [s for s in parts["trips"]["steps"] if s["over_k"] == 3.0]
    worst, runs, early = max(s["max_s"] for s in steps), sum(s["runs"] for s in steps), sum(s["early"] for s in steps)
    quiet = parts["trips"]["quiet"]
    return [
        _row(
            "A step of 3 K over the limit trips",
            "<= 10 s",
            f"{worst:.0f} s at most, {runs} steps",
            worst <= 10.0 and not early,
        ),
        _row(
            "Nuisance trips 0.3 K below the limit, noise 0.5 K",
            f"0 of {FULL.quiet} runs",
            f"{len(quiet['tripped'])} of {quiet['runs']}",
            not quiet["tripped"],
        ),
    ]


def _day_claims(parts: dict[str, Results]) -> list[tuple[str, str, str, str]]:
    rows, bad, quiet = [], both(parts, "bad"), both(parts, "quiet")
    if bad:
        missed = sum(len(d["missed"]) + len(d["unexpected"]) + len(d["not_back"]) + len(d["raised"]) for d in bad)
        count = sum(sum(d["incidents"].values()) for d in bad)
        text = f"{missed} of {sum(d['expected'] for d in bad)} reactions to {count} incidents"
        rows.append(
            _row("Bad days of 24 h: reactions missed, or fallbacks that nothing asked for", "0", text, not missed)
        )
    if quiet:
        lost = sum(d["dropped"] + d["fallbacks"] + int(d["length_s"] - d["ticks"]) for d in quiet)
        rows.append(_row("Fault-free days: ticks, samples or trips lost or too many", "0", str(lost), not lost))
    if bad or quiet:
        growth = [d["growth"] for d in (*bad, *quiet)]
        rows.append(
            _row(
                "Memory after the first hour, every day",
                "+5 %",
                f"{100 * max(growth):+.1f} % at most",
                max(growth) <= 0.05,
            )
        )
    if quiet:
        p99 = max(d["decision"]["p99_ms"] for d in quiet)
        rows.append(_row("A decision on a fault-free day, 99th percentile", "<= 2 ms", f"{p99:.2f} ms", p99 <= 2.0))
    if bad:
        p99 = max(d["decision"]["p99_ms"] for d in bad)
        cpu_ms = max(d["decision"]["cpu_p99_ms"] for d in bad)
        text = f"{p99:.2f} ms ({cpu_ms:.2f} ms of it CPU, the rest waits for the thread of the journal)"
        rows.append(_row("A decision on a bad day, 99th percentile", "<= 2 ms", text, p99 <= 2.0))
    return rows


def _other_claims(parts: dict[str, Results]) -> list[tuple[str, str, str, str]]:
    rows = []
    if kills := both(parts, "kills"):
        wrong, deaths = sum(len(k["wrong"]) for k in kills), sum(k["deaths"] for k in kills)
        text = f"{wrong} in {sum(k['lives'] for k in kills)} lives, {deaths} deaths"
        rows.append(
            _row(
                "Deaths at random instants: anything repeated, lost, unnoticed or unsafe", "0 in 1,000", text, not wrong
            )
        )
    if asked := both(parts, "asked"):
        wrong = sum(len(a["wrongly"]) + len(a["altered"]) + len(a["unanswered"]) for a in asked)
        text = f"{wrong} of {sum(a['asked'] for a in asked):,} ({sum(a['accepted'] for a in asked):,} accepted)"
        rows.append(
            _row(
                "Requests accepted that break a check, altered or not answered",
                "0 of 10,000 per plant",
                text,
                not wrong,
            )
        )
    if runs := [r for w in both(parts, "wire") for r in w["runs"]]:
        same = sum(r["same"] for r in runs)
        text = f"{same} of {len(runs)} runs, {sum(r['arrived'] for r in runs)} writes"
        rows.append(
            _row(
                "What arrives on the wire = attempts in the journal, one for one, in order",
                "every run",
                text,
                same == len(runs),
            )
        )
    if "mutation" in parts:
        found = parts["mutation"]["rows"]
        asked_of, left = sum(r["asked"] for r in found), sum(r["asked"] - r["noticed"] for r in found)
        text = f"{left} of {asked_of:,} ({sum(r['equivalent'] for r in found)} more are equivalent)"
        rows.append(_row("Mutants of the guard and of recovery's loop that no test notices", "0", text, not left))
    if "cost" in parts:
        median = max(t["median_ms"] for t in parts["cost"]["ticks"])
        rows.append(_row("Guard per tick, median, batch and recovery", "<= 0.5 ms", f"{median:.2f} ms", median <= 0.5))
        if parts["cost"]["demo"]:
            now, before = median_of(parts["cost"]["demo"]["now"]), median_of(parts["cost"]["demo"][EARLIER])
            text = f"{now:.1f} s against {before:.1f} s, CPU"
            rows.append(_row(f"The demo command against `{EARLIER}`", "not dearer", text, now <= before))
    return rows


def median_of(values: Sequence[float]) -> float:
    return sorted(values)[len(values) // 2]
