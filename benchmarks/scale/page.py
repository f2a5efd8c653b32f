"""The page of the scale study: tables and fits from what was measured."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.scale.decisions import FAULTS, Decision
from benchmarks.scale.effect import colder_neighbours
from benchmarks.scale.fits import CONTEXTS, fits, table
from benchmarks.scale.plant_graph import KINDS
from benchmarks.scale.retrieval import REPEAT, Retrieval
from benchmarks.scale.study import ASKED, SIMULATED_S, Study
from homeostat.plants.plant import load_plant

TEXT = Path(__file__).parents[1] / "scale_results.md"
"""The page without its numbers."""
MOST_MS = 50.0
"""Time that a retrieval may take [ms]."""
MOST_GROWTH = 0.2
"""By how much a prompt may be longer than on a single module [1]."""


def page(studies: Sequence[Study], alone: Sequence[Retrieval], measured: str) -> str:
    """The whole page; ``alone``: the same questions to the plants without a site."""
    effect = colder_neighbours({kind: load_plant(kind) for kind in KINDS})
    return TEXT.read_text(encoding="utf-8").format(
        measured=measured, cores=os.cpu_count(), asked=ASKED, minutes=SIMULATED_S // 60, result=_result(studies, alone),
        footprints=_footprints(studies), retrievals=_retrievals(studies),
        neighbourhoods=_neighbourhoods(studies, alone),
        decisions=_decisions(studies), scenarios=_scenarios(studies), growths=fits(studies), effect=f"{effect:.2f}",
    )  # fmt: skip


def prompt_ratios(studies: Sequence[Study]) -> tuple[float, ...]:
    """Tokens of each prompt on the largest site, divided by those of the same scenario on a single module."""
    first, last = studies[0].decisions, studies[-1].decisions
    single = {(d.kind, d.fault, d.seed): d for d in first}
    pairs = [(d, single[d.kind, d.fault, d.seed]) for d in last]
    names = ("planning_tokens", "action_tokens")
    return tuple(getattr(d, n) / getattr(one, n) for d, one in pairs for n in names if getattr(one, n))


def _result(studies: Sequence[Study], alone: Sequence[Retrieval]) -> str:
    last, ratios = studies[-1], prompt_ratios(studies)
    contexts = [r for r in last.retrievals if r.question in CONTEXTS]
    median, worst = np.median([r.median_ms for r in contexts]), max(r.worst_cpu_ms for r in contexts)
    good = max(median, worst) <= MOST_MS and last.footprint.triples >= 1e6 and max(ratios) <= 1.0 + MOST_GROWTH
    return (
        f"{'**Holds**' if good else '**Does not hold**'}: at {last.footprint.modules} modules and "
        f"{last.footprint.triples / 1e6:.2f} million triples the context of an agent is retrieved in "
        f"{median:.1f} ms (median; the longest of {len(contexts) * REPEAT} took {worst:.1f} ms of processor time and "
        f"{max(r.worst_ms for r in contexts):.1f} ms by the clock), and prompts have {min(ratios):.3f} to "
        f"{max(ratios):.3f} times the tokens of the same scenario on a single module. Uncut, contexts have up to "
        f"{_longest(last.retrievals, studies[0].retrievals):.2f} times the tokens of those of a single module with "
        f"headers, and up to {_longest(last.retrievals, alone):.2f} times those of the plant without any."
    )


def _longest(found: Sequence[Retrieval], before: Sequence[Retrieval]) -> float:
    """Most tokens of a context divided by those ``before`` of the same plant and question."""
    tokens = {(r.kind, r.question): r.tokens for r in before}
    return max(r.tokens / tokens[r.kind, r.question] for r in found if r.question in CONTEXTS)


def _footprints(studies: Sequence[Study]) -> str:
    heads = (
        "modules", "triples", "load [s]", "memory [MB]", "describe one module [ms]", "simulate [s]",
        "of it processor time of all threads [s]", "load average",
    )  # fmt: skip
    return table(heads, (
        (f.modules, f.triples, f"{f.load_s:.2f}", f"{f.memory_mb:.0f}", f"{f.describe_ms:.0f}", f"{f.simulate_s:.2f}",
         f"{f.simulate_cpu_s:.2f}", f"{f.programs:.1f}")
        for f in (s.footprint for s in studies)
    ))  # fmt: skip


def _retrievals(studies: Sequence[Study]) -> str:
    names = list(dict.fromkeys(r.question for r in studies[0].retrievals))
    return table(("modules", *names), (
        (s.footprint.modules, *(_times([r for r in s.retrievals if r.question == name]) for name in names))
        for s in studies
    ))  # fmt: skip


def _times(rows: Sequence[Retrieval]) -> str:
    worked = f"{np.median([r.cpu_ms for r in rows]):.2f} ({max(r.worst_cpu_ms for r in rows):.1f})"
    return f"{worked}; {np.median([r.median_ms for r in rows]):.2f} ({max(r.worst_ms for r in rows):.1f})"


def _neighbourhoods(studies: Sequence[Study], alone: Sequence[Retrieval]) -> str:
    columns = [(kind, question) for kind in KINDS for question in CONTEXTS]
    rows = [("case alone", alone), *((str(s.footprint.modules), s.retrievals) for s in studies)]
    return table(("modules", *(f"{k}, {q.removesuffix('_excerpt')}" for k, q in columns)), (
        (name, *(_range([r.tokens for r in found if (r.kind, r.question) == c]) for c in columns))
        for name, found in rows
    ))  # fmt: skip


def _decisions(studies: Sequence[Study]) -> str:
    heads = (
        "modules", "success", "latency [s], median (max)", "processor time [s], median (max)",
        "planning prompt [tokens]", "action prompt [tokens]", "things left out of both",
        "graph questions [ms], median (max)", "neighbours [s per process second]",
    )  # fmt: skip
    return table(heads, (_decision_row(s.footprint.modules, s.decisions) for s in studies))


def _decision_row(modules: int, found: Sequence[Decision]) -> tuple[object, ...]:
    latencies = [d.latency_s for d in found if np.isfinite(d.latency_s)]
    worked = [d.cpu_s for d in found if np.isfinite(d.cpu_s)]
    return (
        modules, f"{sum(d.good for d in found)}/{len(found)}", f"{np.median(latencies):.2f} ({max(latencies):.2f})",
        f"{np.median(worked):.2f} ({max(worked):.2f})",
        _range([d.planning_tokens for d in found if d.planning_tokens]),
        _range([d.action_tokens for d in found if d.action_tokens]), _range([d.left_out for d in found]),
        f"{np.median([d.question_median_ms for d in found]):.2f} ({max(d.question_worst_ms for d in found):.1f})",
        f"{np.mean([d.neighbours_s / d.process_s for d in found]):.5f}",
    )  # fmt: skip


def _scenarios(studies: Sequence[Study]) -> str:
    rows = []
    for kind in KINDS:
        for fault in FAULTS[kind]:
            mine = [[d for d in s.decisions if (d.kind, d.fault) == (kind, fault)] for s in studies]
            rows.append((kind, fault, *("; ".join(_short(d) for d in found) for found in mine)))
    return table(("case", "fault", *(str(s.footprint.modules) for s in studies)), rows)


def _short(decision: Decision) -> str:
    return f"{decision.outcome}, {decision.actor}, {decision.latency_s:.1f} s"


def _range(values: Sequence[int]) -> str:
    low, high = min(values), max(values)
    return f"{low}" if low == high else f"{low} to {high}"
