"""What of a site grows with the plant, as a table of exponents."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence

import numpy as np

from benchmarks.scale.growth import growth
from benchmarks.scale.study import Study

CONTEXTS = ("planning_excerpt", "action_excerpt")
"""Questions whose answer an agent is shown."""


def fits(studies: Sequence[Study]) -> str:
    """The table of the exponents."""
    rows: list[tuple[str, str]] = []
    asked = [(s.footprint.modules, r) for s in studies for r in s.retrievals]
    made = [(s.footprint.modules, d) for s in studies for d in s.decisions]

    def told(name: str, values: Iterable[tuple[int, float, Hashable]]) -> None:
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
    footprint("processor time to simulate, 30 modules and more", lambda s: s.footprint.simulate_cpu_s, least=30)
    return table(("quantity", "exponent, 95 % confidence"), rows)


def table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(str(cell) for cell in line)} |" for line in lines)
