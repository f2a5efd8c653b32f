"""Where a story is shown: plain lines in a pipe, or a terminal (its own file)."""

from collections.abc import Mapping
from typing import Protocol, TextIO, final

from homeostat.record.story.line import Line


class View(Protocol):
    """Shows a run. Whoever looks may go away: that must never stop the run."""

    def show(self, line: Line) -> None:
        """Show one line."""

    def progress(self, at_s: float, values: Mapping[str, float], phase: str, state: str) -> None:
        """The plant at process time ``at_s`` [s]: tag -> measured value, what the system does, the state."""

    def close(self) -> None:
        """Nothing more comes."""


@final
class PlainView:
    """One line of text per line of the story, at once."""

    def __init__(self, stream: TextIO | None) -> None:
        """``stream``: where the lines go; None where nothing is shown."""
        self._stream = stream

    def show(self, line: Line) -> None:
        """Write the line, unless nobody reads any more."""
        if self._stream is not None:
            try:
                print(line, file=self._stream, flush=True)
            except OSError:
                self._stream = None

    def progress(self, at_s: float, values: Mapping[str, float], phase: str, state: str) -> None:
        """Nothing: a file or a pipe has no use for it."""

    def close(self) -> None:
        """Nothing to restore."""
