"""The page of the scale study: tables and fits from what was measured."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.scale.decisions import FAULTS, Decision
from benchmarks.scale.growth import growth
from benchmarks.scale.plant_graph import KINDS
from benchmarks.scale.retrieval import REPEAT, Retrieval
from benchmarks.scale.study import ASKED, SIMULATED_S, Study

TEXT = Path(__file__).parents[1] / "scale_results.md"
"""The page without its numbers."""
CONTEXTS = ("planning_excerpt", "action_excerpt")
"""Questions whose answer an agent is shown."""
MOST_MS = 50.0
"""Time that a retrieval may take [ms]."""
MOST_GROWTH = 0.2
"""By how much a prompt may be longer than on a single module [1]."""


def page(studies: Sequence[Study], alone: Sequence[Retrieval], python: str) -> str:
    """The whole page; ``alone``: the same questions to the cases without a site."""
    return TEXT.read_text(encoding="utf-8").format(
        python=python, cores=os.cpu_count(), asked=ASKED, minutes=SIMULATED_S // 60, result=_result(studies),
        footprints=_footprints(studies), retrievals=_retrievals(studies),
        neighbourhoods=_neighbourhoods(studies, alone),
        decisions=_decisions(studies), scenarios=_scenarios(studies), growths=_growths(studies),
    )  # fmt: skip


def prompt_ratios(studies: Sequence[Study]) -> tuple[float, ...]:
    """Tokens of each prompt on the largest site, divided by those of the same scenario on a single module."""
    first, last = studies[0].decisions, studies[-1].decisions
    single = {(d.kind, d.fault, d.seed): d for d in first}
    pairs = [(d, single[d.kind, d.fault, d.seed]) for d in last]
    names = ("planning_tokens", "action_tokens")
    return tuple(getattr(d, n) / getattr(one, n) for d, one in pairs for n in names if getattr(one, n))


def _result(studies: Sequence[Study]) -> str:
    last, ratios = studies[-1], prompt_ratios(studies)
    contexts = [r for r in last.retrievals if r.question in CONTEXTS]
    worst = max(r.worst_ms for r in contexts)
    good = worst <= MOST_MS and last.footprint.triples >= 1e6 and max(ratios) <= 1.0 + MOST_GROWTH
    return (
        f"{'Holds' if good else '**Does not hold**'}: at {last.footprint.modules} modules and "
        f"{last.footprint.triples / 1e6:.2f} million triples the context of an agent is retrieved in "
        f"{np.median([r.median_ms for r in contexts]):.1f} ms (median; the longest of {len(contexts) * REPEAT} took "
        f"{worst:.1f} ms), and prompts have {min(ratios):.3f} to {max(ratios):.3f} times the tokens of the same "
        "scenario on a single module."
    )


def _footprints(studies: Sequence[Study]) -> str:
    heads = ("modules", "triples", "load [s]", "memory [MB]", "describe one module [ms]", "simulate [s]")
    return _table(heads, (
        (f.modules, f.triples, f"{f.load_s:.2f}", f"{f.memory_mb:.0f}", f"{f.describe_ms:.0f}", f"{f.simulate_s:.2f}")
        for f in (s.footprint for s in studies)
    ))  # fmt: skip


def _retrievals(studies: Sequence[Study]) -> str:
    names = list(dict.fromkeys(r.question for r in studies[0].retrievals))
    return _table(("modules", *names), (
        (s.footprint.modules, *(_times([r for r in s.retrievals if r.question == name]) for name in names))
        for s in studies
    ))  # fmt: skip


def _times(rows: Sequence[Retrieval]) -> str:
    return f"{np.median([r.median_ms for r in rows]):.2f} ({max(r.worst_ms for r in rows):.1f})"


def _neighbourhoods(studies: Sequence[Study], alone: Sequence[Retrieval]) -> str:
    columns = [(kind, question) for kind in KINDS for question in CONTEXTS]
    rows = [("case alone", alone), *((str(s.footprint.modules), s.retrievals) for s in studies)]
    return _table(("modules", *(f"{k}, {q.removesuffix('_excerpt')}" for k, q in columns)), (
        (name, *(_range([r.tokens for r in found if (r.kind, r.question) == c]) for c in columns))
        for name, found in rows
    ))  # fmt: skip


def _decisions(studies: Sequence[Study]) -> str:
    heads = (
        "modules", "success", "latency [s], median (max)", "processor time [s], median (max)",
        "planning prompt [tokens]", "action prompt [tokens]",
        "graph questions [ms], median (max)", "neighbours [s per process second]",
    )  # fmt: skip
    return _table(heads, (_decision_row(s.footprint.modules, s.decisions) for s in studies))


def _decision_row(modules: int, found: Sequence[Decision]) -> tuple[object, ...]:
    latencies = [d.latency_s for d in found if np.isfinite(d.latency_s)]
    worked = [d.cpu_s for d in found if np.isfinite(d.cpu_s)]
    return (
        modules, f"{sum(d.good for d in found)}/{len(found)}", f"{np.median(latencies):.2f} ({max(latencies):.2f})",
        f"{np.median(worked):.2f} ({max(worked):.2f})",
        _range([d.planning_tokens for d in found if d.planning_tokens]),
        _range([d.action_tokens for d in found if d.action_tokens]),
        f"{np.median([d.question_median_ms for d in found]):.2f} ({max(d.question_worst_ms for d in found):.1f})",
        f"{np.mean([d.neighbours_s / d.process_s for d in found]):.5f}",
    )  # fmt: skip


def _scenarios(studies: Sequence[Study]) -> str:
    rows = []
    for kind in KINDS:
        for fault in FAULTS[kind]:
            mine = [[d for d in s.decisions if (d.kind, d.fault) == (kind, fault)] for s in studies]
            rows.append((kind, fault, *("; ".join(_short(d) for d in found) for found in mine)))
    return _table(("case", "fault", *(str(s.footprint.modules) for s in studies)), rows)


def _short(decision: Decision) -> str:
    return f"{decision.outcome}, {decision.actor}, {decision.latency_s:.1f} s"


def _growths(studies: Sequence[Study]) -> str:
    rows: list[tuple[str, str]] = []
    asked = [(s.footprint.modules, r) for s in studies for r in s.retrievals]
    made = [(s.footprint.modules, d) for s in studies for d in s.decisions]

    def told(name: str, values: Iterable[tuple[int, float, object]]) -> None:
        found = [v for v in values if np.isfinite(v[1]) and v[1] > 0]
        rows.append((name, str(growth([v[0] for v in found], [v[1] for v in found], [v[2] for v in found]))))

    def footprint(name: str, of: Callable[[Study], float], least: int = 1) -> None:
        told(name, ((s.footprint.modules, of(s), "") for s in studies if s.footprint.modules >= least))

    footprint("triples", lambda s: s.footprint.triples)
    footprint("time to load", lambda s: s.footprint.load_s)
    for question in dict.fromkeys(r.question for _, r in asked):
        mine = [(n, r) for n, r in asked if r.question == question]
        told(f"time of {question}", ((n, r.median_ms, r.kind) for n, r in mine))
        told(f"processor time of {question}", ((n, r.cpu_ms, r.kind) for n, r in mine))
        if question in CONTEXTS:
            told(f"tokens of {question}, uncut", ((n, r.tokens, r.kind) for n, r in mine))
    told("tokens of planning prompts", ((n, d.planning_tokens, (d.fault, d.seed)) for n, d in made))
    told("tokens of action prompts", ((n, d.action_tokens, (d.fault, d.seed)) for n, d in made))
    told("decision latency", ((n, d.latency_s, (d.fault, d.seed)) for n, d in made))
    told("processor time of a decision", ((n, d.cpu_s, (d.fault, d.seed)) for n, d in made))
    footprint("simulating every module, 30 modules and more", lambda s: s.footprint.simulate_s, least=30)
    return _table(("quantity", "exponent, 95 % confidence"), rows)


def _range(values: Sequence[int]) -> str:
    low, high = min(values), max(values)
    return f"{low}" if low == high else f"{low} to {high}"


def _table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(str(cell) for cell in line)} |" for line in lines)
