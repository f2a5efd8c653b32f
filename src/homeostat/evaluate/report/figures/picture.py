"""How figures of the report look, and how they are drawn into pictures that need nothing else."""

import base64
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import Any, Final

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from homeostat.evaluate.report.groups import arms
from homeostat.evaluate.report.tables.table import one_line
from homeostat.record.row import DO_NOTHING, FALLBACK_ONLY, HINDSIGHT, Row

INK: Final = "#24292f"
"""Words and marks that belong to no proposer."""
QUIET: Final = "#6e7781"
"""Lines that only help to read."""
BAD: Final = "#b3261e"
"""Runs that did not succeed."""
LONGEST: Final = 34
"""Characters of a name in a figure; longer ones lose their middle."""
_PALETTE: Final = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#7a5c00", "#5e4fa2", "#a6761d")
"""Told apart by those who confuse red and green, after Okabe and Ito 2008."""
_GREYS: Final = {HINDSIGHT: "#444444", DO_NOTHING: "#999999", FALLBACK_ONLY: "#6e6e6e"}
_LOOK: Final[dict[Any, Any]] = {
    **{"font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans"], "font.size": 9.0, "axes.titlesize": 9.5},
    **{"axes.labelsize": 9.0, "axes.titlelocation": "left", "axes.spines.top": False, "axes.spines.right": False},
    **dict.fromkeys(("axes.labelcolor", "text.color", "xtick.color", "ytick.color"), INK),
    **{"axes.edgecolor": QUIET, "grid.color": "#e6e9ed", "grid.linewidth": 0.6, "axes.axisbelow": True},
    **{"text.parse_math": False, "text.usetex": False, "figure.facecolor": "none", "legend.frameon": False},
    **{"svg.fonttype": "path", "svg.hashsalt": "homeostat"},
}
"""Letters are shapes, so that no font is needed; names inside the SVG follow from what is drawn."""


@dataclass(frozen=True, slots=True)
class Picture:
    """One figure of the report."""

    title: str
    """What it shows."""
    caption: str
    """How to read it."""
    svg: bytes
    """The picture as a file."""

    @property
    def source(self) -> str:
        """The picture itself as the source of an image in HTML, a document of its own that names no other place."""
        return f"data:image/svg+xml;base64,{base64.b64encode(self.svg).decode()}"


def picture(
    title: str, caption: str, size: tuple[float, float], draw: Callable[[Figure], None], layout: Any = "constrained"
) -> Picture:
    """What ``draw`` makes of a figure of ``size`` [in]; equal drawings give equal bytes."""
    content = BytesIO()
    with mpl.rc_context(_LOOK), warnings.catch_warnings():
        # Names come from files; a letter that the font lacks becomes a box.
        warnings.filterwarnings("ignore", message="Glyph")
        figure = Figure(figsize=size, layout=layout)
        draw(figure)
        figure.savefig(content, format="svg", metadata={"Date": None}, bbox_inches="tight", pad_inches=0.05)
    return Picture(title, caption, content.getvalue())


def lined(axis: Axes, names: Sequence[str]) -> None:
    """One line per name, the first on top."""
    axis.set_yticks(range(len(names)), names)
    axis.set_ylim(len(names) - 0.4, -0.6)
    axis.tick_params(axis="y", length=0)
    axis.grid(axis="x")


def small(axis: Axes, words: str, at: tuple[float, float], on: Any, shift: tuple[int, int], **look: Any) -> None:
    """Small ``words`` beside ``at`` in the coordinates ``on``, away from it by ``shift`` [points]."""
    axis.annotate(words, at, xycoords=on, xytext=shift, textcoords="offset points", fontsize=7.5, **look)


def plain(value: float, _: object) -> str:
    """A number beside a logarithmic axis."""
    return f"{value:g}"


def colours(rows: Sequence[Row]) -> dict[str, str]:
    """Proposer with what it goes without -> its colour, the same in every figure; reference policies are grey."""
    names = arms(rows)
    proposing = [name for name in names if name not in _GREYS]
    return {name: _GREYS.get(name) or _PALETTE[proposing.index(name) % len(_PALETTE)] for name in names}


def short(name: str) -> str:
    """A name that fits beside an axis."""
    text = one_line(name)
    half = LONGEST // 2
    return text if len(text) <= LONGEST else f"{text[: half - 1]}…{text[-half:]}"
