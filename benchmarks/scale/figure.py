"""The figure of the scale study: four quantities against the number of modules, on logarithmic axes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, NullLocator, ScalarFormatter

from benchmarks.scale.study import Study

BLUE, ORANGE, GREEN = "#0072B2", "#D55E00", "#009E73"
"""Colours that colour-blind readers can tell apart."""


def draw(studies: Sequence[Study], path: Path) -> None:
    """Write the figure as PNG to ``path``."""
    figure = Figure(figsize=(9.6, 6.6), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True)
    sizes = [s.footprint.modules for s in studies]
    _graph(axes[0, 0], sizes, studies)
    _retrieval(axes[0, 1], sizes, studies)
    _tokens(axes[1, 0], sizes, studies)
    _latency(axes[1, 1], sizes, studies)
    for ax in axes.flat:
        ax.set_xscale("log")
        ax.set_xticks(sizes)
        ax.xaxis.set_major_formatter(ScalarFormatter())
        ax.xaxis.set_minor_locator(NullLocator())
        ax.grid(True, which="major", alpha=0.3)
        ax.legend(fontsize=8, frameon=False)
    for ax in axes[1]:
        ax.set_xlabel("modules of the site")
    figure.savefig(path, dpi=150)


def _graph(ax: Axes, sizes: Sequence[int], studies: Sequence[Study]) -> None:
    ax.plot(sizes, [s.footprint.triples for s in studies], "o-", color=BLUE, label="triples of the graph")
    ax.axhline(1e6, color="0.5", ls=":", lw=1, label="one million")
    ax.set(yscale="log", ylabel="triples", title="The plant grows ...")


def _retrieval(ax: Axes, sizes: Sequence[int], studies: Sequence[Study]) -> None:
    for question, colour, label in (
        ("planning_excerpt", BLUE, "context of planning"),
        ("action_excerpt", ORANGE, "context of action"),
        ("candidate_faults", GREEN, "candidate faults"),
    ):
        mine = [[r for r in s.retrievals if r.question == question] for s in studies]
        ax.plot(sizes, [np.median([r.cpu_ms for r in rows]) for rows in mine], "o-", color=colour, label=label)
        ax.plot(sizes, [max(r.worst_cpu_ms for r in rows) for rows in mine], "^", color=colour, ms=5, mfc="none")
    ax.axhline(50.0, color="0.5", ls=":", lw=1, label="required: at most 50 ms")
    ax.plot([], [], "^", color="0.3", ms=5, mfc="none", label="longest")
    ax.set(
        yscale="log",
        ylabel="processor time of one retrieval [ms]",
        title="... retrieval does not (medians)",
        ylim=(0.005, 200),
    )


def _tokens(ax: Axes, sizes: Sequence[int], studies: Sequence[Study]) -> None:
    for name, colour, label in (("planning_tokens", BLUE, "planning"), ("action_tokens", ORANGE, "action")):
        ax.plot(sizes, [_mean(s, name) for s in studies], "o-", color=colour, label=f"prompt of {label}")
    for question, colour, label in (("planning_excerpt", BLUE, "planning"), ("action_excerpt", ORANGE, "action")):
        means = [np.mean([r.tokens for r in s.retrievals if r.question == question]) for s in studies]
        ax.plot(sizes, means, "s--", color=colour, mfc="none", label=f"neighbourhood of {label}, uncut")
    ax.set(yscale="log", ylabel="tokens", title="Prompts, and what they are cut from (means)", ylim=(500, 5000))
    ax.yaxis.set_major_formatter(ScalarFormatter())
    ax.set_yticks([500, 1000, 2000, 5000])
    ax.yaxis.set_minor_formatter(NullFormatter())


def _latency(ax: Axes, sizes: Sequence[int], studies: Sequence[Study]) -> None:
    for kind, colour, name in (("cstr", BLUE, "reactor"), ("mixing_module", ORANGE, "Mixing Module")):
        mine = [[d.latency_s for d in s.decisions if d.kind == kind and np.isfinite(d.latency_s)] for s in studies]
        for size, values in zip(sizes, mine, strict=True):
            ax.plot([size] * len(values), values, ".", color=colour, alpha=0.4)
        ax.plot(sizes, [np.median(values) for values in mine], "o-", color=colour, label=f"fault in a {name}, median")
    cost = [s.footprint.simulate_s / 600.0 for s in studies]
    ax.plot(sizes, cost, "s--", color="0.4", mfc="none", label="simulating all modules, per process second")
    ax.set(yscale="log", ylabel="wall-clock time [s]", title="From detection to first action")


def _mean(study: Study, name: str) -> float:
    """Mean of the questions that were asked."""
    return float(np.mean([getattr(d, name) for d in study.decisions if getattr(d, name)]))
