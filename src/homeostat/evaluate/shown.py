"""What a run shows to whoever watches it: every snapshot, and the state that the plant is in."""

from collections.abc import Callable
from typing import TypeAlias

from homeostat.domain.observation import Observation
from homeostat.domain.snapshot import Snapshot

Watcher: TypeAlias = Callable[[Snapshot], None]
"""Called with each snapshot before anybody thinks about it."""


class Shown:
    """Follows a run, tick by tick."""

    def __init__(self, state: str, watcher: Watcher | None = None) -> None:
        """``state``: the one that the plant begins in; ``watcher`` is shown every snapshot, nobody where None."""
        self._watcher = watcher
        self.state = state
        """State that the plant is in."""

    def __call__(self, seen: Observation) -> None:
        """Take one tick of a guard."""
        self.state = seen.state
        if seen.snapshot is not None:
            self.sampled(seen.snapshot)

    def sampled(self, snapshot: Snapshot) -> bool:
        """Take one snapshot of a plant that nobody guards; False, as nobody wants it to end."""
        if self._watcher is not None:
            self._watcher(snapshot)
        return False
