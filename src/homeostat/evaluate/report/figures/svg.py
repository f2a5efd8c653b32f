"""How figures of the report look, and how they become SVG that can stand in a page."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any, Final

from homeostat.evaluate.report.groups import entrants
from homeostat.evaluate.report.tables.table import one_line
from homeostat.evaluate.study.row import DO_NOTHING, FALLBACK_ONLY, HINDSIGHT, Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
_YARDSTICKS: Final = {HINDSIGHT: "#444444", DO_NOTHING: "#999999", FALLBACK_ONLY: "#6e6e6e"}
_LOOK: Final = {
    "font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans"], "font.size": 9.0, "axes.labelsize": 9.0,
    "axes.titlesize": 9.5, "axes.titlelocation": "left", "axes.spines.top": False, "axes.spines.right": False,
    "axes.edgecolor": QUIET, "axes.labelcolor": INK, "text.color": INK, "xtick.color": INK, "ytick.color": INK,
    "svg.fonttype": "path", "text.parse_math": False, "text.usetex": False, "figure.facecolor": "none",
    "legend.frameon": False,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Picture:
    """One figure of the report."""

    title: str
    """What it shows."""
    caption: str
    """How to read it."""
    svg: str
    """The picture as an element of HTML."""


def look(name: str) -> AbstractContextManager[None]:
    """Settings of matplotlib for the figure ``name``; it makes the names inside the SVG unlike those of others."""
    import matplotlib as mpl

    settings: dict[Any, Any] = {**_LOOK, "svg.hashsalt": name}
    return mpl.rc_context(settings)


def plain(value: float, _: object) -> str:
    """A number beside a logarithmic axis."""
    return f"{value:g}"


def as_svg(figure: Figure, name: str, spoken: str) -> str:
    """``figure`` as an element of HTML that names no other place, has no date, and is read aloud as ``spoken``."""
    from html import escape

    content = BytesIO()
    with warnings.catch_warnings():
        # Names come from files; a letter that the font lacks becomes a box.
        warnings.filterwarnings("ignore", message="Glyph")
        nameless = {"Date": None, "Creator": None}
        figure.savefig(content, format="svg", metadata=nameless, bbox_inches="tight", pad_inches=0.05)
    text = content.getvalue().decode("utf-8")
    text = text[text.index("<svg") :].strip()
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'\s+xmlns(:\w+)?="[^"]*"', "", text).replace("xlink:href", "href")
    text = _names_apart(text, name)
    opening = f'<svg role="img" aria-label="{escape(one_line(spoken))}" '
    return re.sub(r"\n\s*", "\n", text.replace("<svg ", opening, 1))


def colours(rows: Sequence[Row]) -> dict[str, str]:
    """Proposer with what it goes without -> its colour, the same in every figure; yardsticks are grey."""
    names = entrants(rows)
    proposing = [name for name in names if name not in _YARDSTICKS]
    return {name: _YARDSTICKS.get(name) or _PALETTE[proposing.index(name) % len(_PALETTE)] for name in names}


def short(name: str) -> str:
    """A name that fits beside an axis."""
    text = one_line(name)
    half = LONGEST // 2
    return text if len(text) <= LONGEST else f"{text[: half - 1]}…{text[-half:]}"


def _names_apart(text: str, name: str) -> str:
    """``text`` without names that nothing refers to; those left begin with ``name``, so that figures do not mix."""
    used = set(re.findall(r'href="#([^"]+)"', text)) | set(re.findall(r"url\(#([^)]+)\)", text))
    text = re.sub(r'\s+id="([^"]+)"', lambda m: f' id="{name}-{m[1]}"' if m[1] in used else "", text)
    text = re.sub(r'href="#([^"]+)"', rf'href="#{name}-\1"', text)
    return re.sub(r"url\(#([^)]+)\)", rf"url(#{name}-\1)", text)
