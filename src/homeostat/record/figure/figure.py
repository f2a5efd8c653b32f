"""A run as a picture: one panel per group of tags, the moments of the recovery above, the states below."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from typing import TYPE_CHECKING, Any, Final

from homeostat.domain.outcome import Outcome
from homeostat.domain.plant.tag import Role
from homeostat.domain.quotation import printable
from homeostat.record.figure.clock import Clock
from homeostat.record.figure.lines import draw_lines
from homeostat.record.figure.marks import draw_marks, explained, strip_rows
from homeostat.record.figure.panel import LinePanel, StripPanel
from homeostat.record.figure.shown import ShownPlant, ShownRun
from homeostat.record.figure.states import draw_states, rows
from homeostat.record.figure.strips import draw_strips

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BEFORE_S: Final = 300.0
"""How much of a run is shown before the onset, by the reference [s]."""
AFTER: Final = 0.06
"""How much is shown after the last moment of a completed batch, as part of the time until then [1]."""
_WIDTH: Final = 11.2
"""Width of the picture [in]; heights below are in inches too."""
_LEFT, _RIGHT, _TOP, _BOTTOM = 1.42, 1.2, 0.85, 0.55
"""Room beside the panels: names of axes and rows, legends, title, time axis [in]."""
_NAMES: Final = 0.82
"""Room between an axis and its name, for the names of rows [in]."""
_BETWEEN: Final = 0.15
_LINES: Final = 1.4
_ROW: Final = 0.19
_ENDINGS: Final = {
    Outcome.LIMIT_VIOLATED: "Limit violated",
    Outcome.FALLBACK: "Fallback activated",
    Outcome.NOT_DETECTED: "The fault was not detected",
    Outcome.NEEDLESS_ACTION: "Needless action",
    Outcome.RECOVERED: "Recovered",
    Outcome.NO_ACTION: "No action",
    Outcome.HELD: "Held: next to nothing is produced at the end",
}
_PLAIN: Final[dict[Any, Any]] = {"text.parse_math": False, "text.usetex": False}
"""Words come from tables: a price of 5 $ is no formula."""
LONGEST_TITLE = 80
"""Most characters of what was wrong that the title has room for."""


def draw(run: ShownRun) -> bytes:
    """The picture as PNG."""
    from matplotlib import rc_context

    content = BytesIO()
    with rc_context(_PLAIN):  # marks of axes are made only now
        compose(run).savefig(content, format="png", metadata={"Software": None})
    return content.getvalue()


def compose(run: ShownRun) -> Figure:
    """The picture, from the top: title, moments, panels, states."""
    from matplotlib import rc_context

    with rc_context(_PLAIN):
        return _composed(run)


def _composed(run: ShownRun) -> Figure:
    plant = run.plant
    machine = plant.description.machine
    first_s, last_s = window(run)
    clock = Clock((first_s, last_s), plant.description.timing)
    marks = explained(run, machine, clock)
    states = rows(machine, run.record, first_s, last_s)
    heights = [_LINES if isinstance(panel, LinePanel) else _ROW * len(panel.tags) for panel in plant.panels]
    strip, *axes = _stack([_ROW * strip_rows(marks, run), *heights, _ROW * len(states)])
    strip.set_xlim(first_s, last_s)
    for axis in axes:
        axis.yaxis.set_label_coords(-_NAMES / (_WIDTH - _LEFT - _RIGHT), 0.5)
    started_s = run.record.started_s(run.scenario.end_s)
    for panel, axis in zip(plant.panels, axes[:-1], strict=True):
        match panel:
            case LinePanel():
                draw_lines(axis, panel, plant.description, run, started_s)
            case StripPanel():
                draw_strips(axis, panel, run.truth)
    draw_states(axes[-1], states)
    draw_marks(strip, axes, marks, run, clock)
    axes[-1].tick_params(axis="x", labelsize=9, labelbottom=True)
    clock.mark(axes[-1])
    figure = axes[-1].figure.get_figure(root=True)
    assert figure is not None
    _caption(figure, run, f"{clock.told(first_s)} to {clock.told(last_s)} of {clock.told(run.scenario.end_s)}")
    return figure


def window(run: ShownRun) -> tuple[float, float]:
    """Part of the run that is shown [s]: from before the onset to its end; of a batch that was completed, all of it."""
    onset_s, end_s = run.scenario.onset_s or 0.0, run.scenario.end_s
    if run.complete_s is None:
        return max(0.0, onset_s - run.plant.description.timing.time_s(BEFORE_S)), end_s
    record = run.record
    moments = [at_s for at_s, _ in (*record.fallbacks, *record.diagnosed)]
    moments += [at_s for _, at_s in record.states] + [release.at_s for release in record.releases]
    last_s = max(run.complete_s, onset_s, *moments)
    return 0.0, min(end_s, (1.0 + AFTER) * last_s)


def _stack(heights: Sequence[float]) -> list[Axes]:
    """Axes of the given heights [in] below each other, with one time axis."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    total = _TOP + sum(heights) + _BETWEEN * (len(heights) - 1) + _BOTTOM
    figure = Figure(figsize=(_WIDTH, total), dpi=110)
    FigureCanvasAgg(figure)
    axes: list[Axes] = []
    top = total - _TOP
    for height in heights:
        place = (_LEFT / _WIDTH, (top - height) / total, (_WIDTH - _LEFT - _RIGHT) / _WIDTH, height / total)
        axes.append(figure.add_axes(place, sharex=axes[0] if axes else None))
        axes[-1].tick_params(axis="x", labelbottom=False)
        top -= height + _BETWEEN
    return axes


def _caption(figure: Figure, run: ShownRun, shown: str) -> None:
    """Title and how to read the picture; ``shown``: how much of the run there is."""
    plant, sizes = run.plant, []
    for fault in run.scenario.faults:
        unit = plant.description.fault(fault.fault).severity_unit
        sizes.append(f"{fault.fault} {fault.severity:g}{'' if unit == '1' else ' ' + unit}")
    what = " + ".join((*sizes, *map(str, run.scenario.disturbances))) or "no fault"
    end = plant.description.machine.state(run.state).label
    if len(what) > LONGEST_TITLE:
        what = f"{what[:LONGEST_TITLE]} ..."
    title = f"{printable(plant.name)}, {what}, seed {run.scenario.seed}"
    left, height = _LEFT / _WIDTH, figure.get_figheight()
    figure.text(left, 1 - 0.2 / height, title, fontsize=12, fontweight="bold", va="center")
    outcome = f"{_ENDINGS[run.outcome]}. At the end: {end}."
    figure.text(left, 1 - 0.42 / height, outcome, fontsize=10.5, va="center")
    span = f"Shown: {shown}."
    figure.text(left, 1 - 0.63 / height, f"{span} {_key(plant)}", fontsize=8.5, color="#555555", va="center")


def _key(plant: ShownPlant) -> str:
    """What the lines and bars of the plant's panels mean."""
    lines = [panel for panel in plant.panels if isinstance(panel, LinePanel)]
    roles = {plant.description.tag(tag).role for panel in lines for tag in panel.tags}
    meanings = {
        "Solid: true value. Pale: measured.": bool(lines),
        "Dashed: setpoint.": Role.SP in roles,
        "Dotted: command.": Role.MV in roles,
        "Red: limit (pale: not in force).": any(panel.limits for panel in lines),
        "Grey: a step ends.": any(panel.guards for panel in lines),
        "Bar: as high as the value.": len(lines) < len(plant.panels),
    }
    return " ".join(words for words, present in meanings.items() if present)
