"""A run as a picture: one panel per group of tags, the moments of the recovery above, the states below."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Final

from homeostat.campaign.figure_marks import draw_marks
from homeostat.campaign.figure_panel import draw_panel
from homeostat.campaign.milestones import Milestones
from homeostat.campaign.runner import RunResult
from homeostat.campaign.scoring import OutcomeKind
from homeostat.cases.case import Case
from homeostat.domain.behaviour import StateMachine

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BEFORE_S: Final = 300.0
"""How much of a run is shown before the onset [s]."""
_RISK: Final = ("#eef3ee", "#e3ecf6", "#f6ecd2", "#f3dcc4", "#ecc9c1", "#ddb3b3")
"""Backgrounds of the states by their risk, calm ones first."""
_CHARACTER: Final = 0.0085
"""Width of a character in the band of states, as part of the picture [1]."""
_ENDINGS: Final = {
    OutcomeKind.RECOVERED: "recovered",
    OutcomeKind.HANDED_OVER: "handed over to the operator",
    OutcomeKind.NO_ACTION: "left alone",
    OutcomeKind.NOT_DETECTED: "the fault was not noticed",
}


def draw(case: Case, run: RunResult, milestones: Milestones) -> bytes:
    """The picture as PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    first_s = max(0.0, (run.scenario.onset_s or 0.0) - BEFORE_S)
    heights = [0.62, *(1.5 for _ in case.panels), 0.2]
    figure = Figure(figsize=(11.0, 1.0 + 1.32 * sum(heights)), dpi=110)
    FigureCanvasAgg(figure)
    axes: list[Axes] = figure.subplots(
        len(heights), 1, sharex=True, gridspec_kw={"height_ratios": heights, "hspace": 0.12}
    ).tolist()
    figure.subplots_adjust(left=0.085, right=0.9, top=0.935, bottom=0.075)
    axes[0].set_xlim(first_s, run.scenario.end_s)
    started_s = milestones.states[0].at_s if milestones.states else run.scenario.end_s
    for panel, axis in zip(case.panels, axes[1:-1], strict=True):
        draw_panel(axis, panel, case.description, run, started_s)
    draw_marks(axes[0], axes[1:-1], run, milestones)
    _draw_states(axes[-1], case.description.machine, milestones, run.scenario.end_s)
    _caption(axes[0], case, run, first_s)
    content = BytesIO()
    figure.savefig(content, format="png", metadata={"Software": None})
    return content.getvalue()


def _draw_states(axis: Axes, machine: StateMachine, milestones: Milestones, end_s: float) -> None:
    """A band that says in which supervisory state the plant was."""
    first_s = axis.get_xlim()[0]
    entered = [(0.0, machine.initial.name), *((m.at_s, m.what) for m in milestones.states)]
    entered += [(m.at_s, "fallback") for m in milestones.fallbacks]
    entered.sort(key=lambda entry: entry[0])
    ends = [*(at_s for at_s, _ in entered[1:]), end_s]
    known = {state.name: state for state in machine.states}
    joined: list[tuple[float, float, str]] = []
    for (begin, name), end in zip(entered, ends, strict=True):
        if joined and joined[-1][2] == name:
            joined[-1] = (joined[-1][0], end, name)
        else:
            joined.append((begin, end, name))
    for begin, end, name in joined:
        left, right = max(begin, first_s), min(end, end_s)
        if right <= left:
            continue
        risk = known[name].risk if name in known else len(_RISK) - 1
        label = known[name].label if name in known else "Safe state (fallback)"
        room = (right - left) / (end_s - first_s) / _CHARACTER
        words = label if len(label) < room else name
        axis.axvspan(left, right, color=_RISK[min(risk, len(_RISK) - 1)], linewidth=0)
        axis.axvline(left, color="#8a8a8a", linewidth=0.6)
        if len(words) < room:
            axis.text((left + right) / 2, 0.46, words, ha="center", va="center", fontsize=8.5, color="#303030")
    axis.set_ylim(0.0, 1.0)
    axis.set_yticks([])
    axis.set_ylabel("State", rotation=0, ha="right", va="center", fontsize=9)
    axis.tick_params(axis="x", labelsize=9)
    axis.set_xlabel("Process time [s]", fontsize=9.5)


def _caption(axis: Axes, case: Case, run: RunResult, first_s: float) -> None:
    """Title and how to read the picture."""
    sizes = []
    for fault in run.scenario.faults:
        unit = case.description.fault(fault.fault).severity_unit
        sizes.append(f"{fault.fault} {fault.severity:g}{'' if unit == '1' else ' ' + unit}")
    what = " + ".join(sizes) or "no fault"
    figure = axis.figure
    title = f"{case.name}, {what}, seed {run.scenario.seed}: {_ENDINGS[run.outcome]}"
    figure.text(0.085, 0.978, title, fontsize=12, fontweight="bold", va="center")
    shown = f"Shown: {first_s:g} s to {run.scenario.end_s:g} s."
    reading = "Solid: true value. Pale: measured. Dashed: setpoint. Dotted: command. Red: limit (pale: not in force)."
    figure.text(0.085, 0.953, f"{shown} {reading}", fontsize=8.5, color="#555555", va="center")
