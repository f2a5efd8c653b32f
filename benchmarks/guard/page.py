"""The page of the guard: each claim with its bar beside the figure, and what was missed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from benchmarks.guard.claims import Results, both, claims, median_of, table
from benchmarks.guard.store import newest
from benchmarks.host import ROOT, commit

PAGE = ROOT / "docs" / "results" / "guard.md"


def page(names: Sequence[str]) -> str:
    """The page, from the newest results of every part."""
    parts = {name: found for name in names if (found := newest(name)) is not None}
    sections = [
        HEAD.format(commit=commit().rstrip("+")),
        claims(parts),
        _trips(parts),
        _days(parts),
        _kills(parts),
        _asked(parts),
        _wire(parts),
        _cost(parts),
        _mutation(parts),
        _measured(parts, names),
    ]
    return "\n\n".join(s for s in sections if s) + "\n"


HEAD = """# The guard: what was measured

Made by `python -m benchmarks.guard_results` for the sources of `{commit}`; the last table says on which commit and
host each part was measured, and what is not complete. Times of the host stand beside a yardstick: a fixed computation
measured in the same run. *Tick*: one second of the plant's time. The attacks themselves are tests (`tests/safety`),
and what each claim covers and does not cover stands in `docs/assurance.md`."""


def _trips(parts: dict[str, Results]) -> str:
    if "trips" not in parts:
        return ""
    found, quiet = parts["trips"], parts["trips"]["quiet"]
    rows = [
        (s["base_k"], s["over_k"], s["runs"], f"{s['median_s']:.0f}", f"{s['max_s']:.0f}", s["early"])
        for s in found["steps"]
    ]
    return f"""## Trips

The reactor's own tables (quality, cumulative sum, fallback) on a plant without a model: the temperature stands at a
base and steps over the limit of 313 K, noise 0.5 K. Time from the first reading of the step to the first command of
the fallback on the wire.

{table(("base [K]", "over the limit [K]", "steps", "median [s]", "longest [s]", "before the step"), rows)}

At 312.7 K, {quiet["runs"]} runs of {quiet["length_s"]:.0f} s: {len(quiet["tripped"])} trips."""


def _days(parts: dict[str, Results]) -> str:
    bad, quiet = both(parts, "bad"), both(parts, "quiet")
    if not bad and not quiet:
        return ""
    days = [("bad", d) for d in bad] + [("fault-free", d) for d in quiet]
    rows = [
        (
            d["plant"],
            kind,
            f"{d['length_s'] / 3600:.0f}",
            d["ticks"],
            f"{d['decision']['median_ms']:.3f}",
            f"{d['decision']['p99_ms']:.2f}",
            f"{d['decision']['cpu_p99_ms']:.2f}",
            f"{d['memory'][-1][1]:.0f}",
            f"{100 * d['growth']:+.1f}",
            f"{d['wall_s']:.0f}",
        )
        for kind, d in days
    ]
    text = f"""## Days

A *bad* day is one on a scripted plant without twin on which something is wrong every 20 minutes, by a seeded script;
a scripted person comes five minutes later, resets, raises the mode, brings tags back and starts again. Each incident
has reactions with a bound in ticks (`benchmarks/guard/day_script.py`): a violated limit and one that cannot be judged
trip, are answered by a fallback in the same tick and the fallback is read back; a lie is uncertain at once, a frozen
or missing value bad in its time; a plant that does not obey is given up strategy by strategy, shed, and gets the
fallback once it obeys; a tag changed by hand is out of service one tick later. Its journal lies in memory: a
simulated second takes a fraction of a millisecond, and a disk that hangs for a tenth of a second would hang for
minutes of the plant's time. A *fault-free* day has everything on: the simulated plant, guard, recovery, twin, and a
journal on the disk; the batch plant rests after its one batch, because repeated batches are not supported.

{_table_of_days(rows)}"""
    if not bad:
        return text
    kinds = list(bad[0]["incidents"])
    lines = [
        (
            d["plant"],
            *(d["incidents"][k] for k in kinds),
            d["expected"],
            len(d["missed"]),
            len(d["unexpected"]),
            len(d["not_back"]),
            d["fallbacks"],
            d["orders"],
        )
        for d in bad
    ]
    header = (
        "plant",
        *kinds,
        "reactions expected",
        "missed",
        "fallbacks not asked for",
        "not back in 15 min",
        "fallbacks sent",
        "orders given",
    )
    misses = [f"- {m}" for d in bad for m in (*d["missed"], *d["unexpected"], *d["raised"])]
    return "\n\n".join([text, table(header, lines), *(["\n".join(misses)] if misses else [])])


def _table_of_days(rows: Sequence[Sequence[object]]) -> str:
    header = (
        "plant",
        "day",
        "hours",
        "ticks",
        "decision, median [ms]",
        "99th [ms]",
        "99th, CPU [ms]",
        "memory [MB]",
        "after the first hour [%]",
        "took [s]",
    )
    return table(header, rows)


def _kills(parts: dict[str, Results]) -> str:
    kills = both(parts, "kills")
    if not kills:
        return ""
    places: Counter[str] = Counter()
    for k in kills:
        places.update(k["places"])
    groups = Counter[str]()
    for place, count in places.items():
        groups[_group(place)] += count
    rows = [(k["plant"], k["lives"], k["deaths"], len(k["wrong"])) for k in kills]
    wrong = [f"- {w}" for k in kills for w in k["wrong"]]
    fell = sum(k["kinds"].get("fallback that the gap called for", 0) for k in kills)
    return "\n\n".join(
        [
            f"""## Deaths

Guard and journal run in one process that dies at an instant drawn at random: between ticks, around each line of the
journal, before and after a sync, before, inside (half of the commands arrive) and after a write, around lease and
heartbeat; in two of five lives again soon after the restart. The simulated plant lives on, without a guard for 1 to 8
s. Of the journal is left what was synced, or all of it, or something in between with a torn line. Scenes: start-up or
batch, a request, a trip, a tag moved by hand with a fallback, a reset and the way on.

Wrong would be: a synced line lost or a chain that does not verify; a write repeated whose effect had been read; a
write of which nobody says what became; an arrival without an intention; a fallback that is not latched or not read
back; a plant outside its hard limits without a fallback; another end than without a death. In {fell} lives the gap
itself brought a limit to be violated, and the fallback acted.""",
            table(("plant", "lives", "deaths", "wrong"), rows),
            table(("died", "times"), groups.most_common()),
            *(["\n".join(wrong)] if wrong else []),
        ]
    )


def _group(place: str) -> str:
    if place in ("between ticks",):
        return place
    if "sync" in place:
        return "around a sync"
    if "a write" in place:
        return place
    return "around lease and heartbeat" if "lease" in place or "heartbeat" in place else "around a line of the journal"


def _asked(parts: dict[str, Results]) -> str:
    asked = both(parts, "asked")
    if not asked:
        return ""
    names = sorted(
        {n for a in asked for n in a["refusals"]}, key=lambda n: (-sum(a["refusals"].get(n, 0) for a in asked), n)
    )
    rows = [(f"`{n}`", *(a["refusals"].get(n, 0) for a in asked)) for n in names]
    totals = [
        ("asked", *(a["asked"] for a in asked)),
        ("accepted", *(a["accepted"] for a in asked)),
        ("of them although they break a check", *(len(a["wrongly"]) for a in asked)),
        ("not answered", *(len(a["unanswered"]) for a in asked)),
    ]
    return f"""## Requests

Random requests with at most two things done to them (`tests/guard/adversary.py`): wrong tags, ranges, rates, states,
paths, ages, NaN, future, replays, empty ones, several at once, altered in the mailbox or during the write; readings
with noise, failing instruments and limits at their edge. The oracle knows the tables and nothing of the guard.
Withdrawn requests and those that somebody altered into others are in no row. No single decision of the batch plant
leads to where a recovery may end, so its guard is a new one for every few requests: a replay meets the check of its age
there, and only the reactor shows that a seal is used once.

{table(("", *(a["plant"] for a in asked)), totals)}

{table(("refused by", *(a["plant"] for a in asked)), rows)}"""


def _wire(parts: dict[str, Results]) -> str:
    wires = both(parts, "wire")
    if not wires:
        return ""
    rows = []
    for w in wires:
        runs = w["runs"]
        by: Counter[str] = Counter()
        for r in runs:
            by.update(r["by"])
        rows.append(
            (
                w["plant"],
                f"{len(runs)} of {w['wanted_faults']}",
                sum(r["arrived"] for r in runs),
                sum(r["commands"] for r in runs),
                sum(r["intended"] for r in runs),
                by["sequence"],
                by["request"],
                by["fallback"],
                sum(not r["same"] for r in runs),
            )
        )
    return f"""## The wire

The nominal run and one with every fault of the tables, on the simulated plants, with recovery (one declared second of
thinking). Arrivals are counted inside the simulated plant, attempts in the journal.

{table(WIRE, rows)}"""


WIRE = (
    "plant", "runs", "arrivals", "commands", "attempts", "of the sequence", "of requests", "of fallbacks",
    "runs that differ",
)  # fmt: skip


def _cost(parts: dict[str, Results]) -> str:
    if "cost" not in parts:
        return ""
    rows = [
        (t["plant"], t["fault"], t["ticks"], f"{t['median_ms']:.3f}", f"{t['p99_ms']:.2f}", f"{t['cpu_p99_ms']:.2f}")
        for t in parts["cost"]["ticks"]
    ]
    demo = parts["cost"]["demo"]
    text = "## Cost\n\n" + table(("plant", "fault", "ticks", "median [ms]", "99th [ms]", "99th, CPU [ms]"), rows)
    if not demo:
        return text
    seconds = [(name, len(s), ", ".join(f"{x:.1f}" for x in s), f"{median_of(s):.1f}") for name, s in demo.items()]
    return f"""{text}

`homeostat run cstr --fault cool_stuck_closed --seed N`, CPU seconds of the whole command for the seeds from 1 on,
alternately at both commits after one run of each that is not counted:

{table(("commit", "seeds", "CPU [s]", "median [s]"), seconds)}

What it costs more are the guard's decisions, 6000 of those above, the handing of every tick to recovery in a thread of
its own and back, and the outcome, for which other decisions are tried on the true plant: two loops cost this."""


def _mutation(parts: dict[str, Results]) -> str:
    if "mutation" not in parts:
        return ""
    found = parts["mutation"]["rows"]
    rows = [(f"`{r['module'].removeprefix('homeostat.')}`", r["noticed"], r["asked"], r["equivalent"]) for r in found]
    survivors = [f"- `{s}`" for r in found for s in r["survivors"]]
    text = f"""## Mutation

`python -m tests.guard.mutate`: every operator, constant, operand, branch, call, filter and assignment of a module is
changed, one at a time, and a fast test must fail, or not come back in its time. *Equivalent*: nobody can tell the
difference, for the reason in `tests/guard/equivalent.py`.

{table(("module", "noticed", "mutants", "equivalent besides"), rows)}"""
    return "\n\n".join([text, *(["Not noticed:\n\n" + "\n".join(survivors)] if survivors else [])])


def _measured(parts: dict[str, Results], names: Sequence[str]) -> str:
    rows = []
    for name in names:
        found = parts.get(name)
        if found is None:
            rows.append((name, "**not measured**", "", "", ""))
        else:
            host = found["host"]
            rows.append(
                (name, f"`{found['commit']}`", complete(name, found), f"{host['yardstick_s']:.3f}", host["load"])
            )
    return f"""## What was measured where

Python {next(iter(parts.values()))["host"]["python"]}, two cores that were shared with other work: *load* is the
average number of processes that wanted to run when the part ended. CPU times bear that, times by the wall less so.
*Yardstick*: two million steps of a congruential generator. Not on this page: the attacks, which are tests.

{table(("part", "commit", "complete", "yardstick [s]", "load"), rows)}"""


def complete(name: str, found: Results) -> str:
    """Whether a part was measured in full ("yes"), or how much of it was."""
    if name.startswith("wire"):
        return (
            "yes"
            if len(found["runs"]) == found["wanted_faults"]
            else f"**{len(found['runs'])} of {found['wanted_faults']}**"
        )
    if name == "mutation" and len(found["rows"]) < found["modules"]:
        return f"**{len(found['rows'])} of {found['modules']} modules**"
    if math.isnan(found.get("growth", 0.0)):
        return "**too short**"
    return "yes"
