"""Every event of a run as a type: what a journal holds."""

from types import ModuleType
from typing import Final

from homeostat.domain.events import deviations, foresight, guard, people, recovery, trips, writes
from homeostat.domain.events.deviations import *  # noqa: F403
from homeostat.domain.events.foresight import *  # noqa: F403
from homeostat.domain.events.guard import *  # noqa: F403
from homeostat.domain.events.people import *  # noqa: F403
from homeostat.domain.events.recovery import *  # noqa: F403
from homeostat.domain.events.trips import *  # noqa: F403
from homeostat.domain.events.writes import *  # noqa: F403
from homeostat.journal import Event, Resumed, RunFinished, RunStarted, Signed
from homeostat.journal.calls import ModelCalled


def declared(module: ModuleType) -> tuple[type[Event], ...]:
    """The events that a module declares."""
    own = (item for item in vars(module).values() if isinstance(item, type) and item.__module__ == module.__name__)
    return tuple(item for item in own if hasattr(item, "kind"))


_MODULES = recovery, deviations, foresight, guard, trips, people, writes
EVENTS: Final[tuple[type[Event], ...]] = (
    *(RunStarted, RunFinished, Resumed, Signed, ModelCalled),
    *(event for module in _MODULES for event in declared(module)),
)
"""The events that are decoded; a record of another kind is somebody else's."""

__all__ = [event.__name__ for event in EVENTS]
