"""A run on a terminal: coloured lines above, the plant as it is now in the last line."""

from collections.abc import Mapping, Sequence
from typing import Final, TextIO, final

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Column, Table
from rich.text import Text

from homeostat.domain.plant.tag import Tag
from homeostat.record.story.line import Line, Tone

_STYLES: Final = {
    Tone.PLAIN: "",
    Tone.GOOD: "bold green",
    Tone.WARNING: "yellow",
    Tone.BAD: "bold red",
    Tone.MUTED: "dim",
}
_BAR: Final = 24
"""Width of the bar in characters."""


@final
class TerminalView:
    """Implements `homeostat.cli.views.View` with rich; honours NO_COLOR."""

    def __init__(self, stream: TextIO, end_s: float, tags: Sequence[Tag]) -> None:
        """``tags`` are shown while the run goes on, which ends at ``end_s`` [s]."""
        self._console = Console(file=stream, highlight=False)
        self._end_s, self._tags = end_s, tuple(tags)
        self._now: tuple[float, Mapping[str, float], str, str] = (0.0, {}, "starting", "")
        self._live = Live(self, console=self._console, refresh_per_second=8, transient=True)
        self._live.start()

    def show(self, line: Line) -> None:
        """Print the line above the status."""
        told = (line.text, _STYLES[line.tone])
        text = Text.assemble((f"{line.at_s:7.10g} s  ", "dim"), (f"{line.label:<9} ", "bold"), told)
        self._console.print(text, soft_wrap=True)

    def progress(self, at_s: float, values: Mapping[str, float], phase: str, state: str) -> None:
        """Remember the plant for the next refresh."""
        self._now = (at_s, values, phase, state)

    def close(self) -> None:
        """Take the status away."""
        self._live.stop()

    def __rich__(self) -> Table:
        """The status line."""
        at_s, values, phase, state = self._now
        shown = [f"{tag.name} {values[tag.name]:7.2f} {tag.unit}" for tag in self._tags if tag.name in values]
        whole = (Column(no_wrap=True) for _ in range(3 + len(shown)))  # where it is too long, the state gives way
        line = Table.grid(*whole, Column(), padding=(0, 2))
        bar = ProgressBar(self._end_s, at_s, _BAR, complete_style="cyan")
        line.add_row(Text(f"{at_s:7.10g} s", "dim"), bar, Text(f"{phase:<11}", "bold"), *map(Text, (*shown, state)))
        return line
