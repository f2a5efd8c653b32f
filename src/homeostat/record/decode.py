"""Events of a recorded run as the types that they were when they were recorded."""

from __future__ import annotations

import dataclasses
from enum import Enum
from types import ModuleType, UnionType
from typing import Any, Final, Union, get_args, get_origin, get_type_hints

from homeostat.domain.events import guard as guard_events
from homeostat.domain.events import recovery as decisions
from homeostat.domain.events import writes as write_events
from homeostat.journal import Event, Record, Resumed, RunFinished, RunStarted, Signed
from homeostat.journal.calls import ModelCalled


def _declared(module: ModuleType) -> tuple[type[Event], ...]:
    """The events that a module declares."""
    own = (item for item in vars(module).values() if isinstance(item, type) and item.__module__ == module.__name__)
    return tuple(item for item in own if hasattr(item, "kind"))


_OF_RUN: Final = (RunStarted, RunFinished, Resumed, Signed, ModelCalled)
_MODULES: Final = (decisions, guard_events, write_events)
EVENTS: Final[tuple[type[Event], ...]] = (*_OF_RUN, *(event for module in _MODULES for event in _declared(module)))
"""The events that are recalled; a record of another kind is somebody else's."""

_BY_KIND: Final = {event.kind: event for event in EVENTS}


class RecallError(ValueError):
    """A record lacks what its event needs: another version of the project wrote it."""


def recall(record: Record) -> Event | None:
    """The event that ``record`` holds; None for a kind that is not in :data:`EVENTS`."""
    kind = _BY_KIND.get(record.kind)
    if kind is None:
        return None
    try:
        event: Event = _made(kind, dict(record.fields))
    except (LookupError, TypeError, ValueError, ArithmeticError, RecursionError) as error:
        raise RecallError(
            f"event {record.seq} ({record.kind!r}) cannot be read: {error!r}; use the version that recorded it"
        ) from error
    return event


def _made(kind: Any, value: Any) -> Any:
    """``value``, in JSON form, as the type ``kind``."""
    if get_origin(kind) is tuple:
        return tuple(_made(get_args(kind)[0], item) for item in value)
    if get_origin(kind) in (Union, UnionType):
        options = [option for option in get_args(kind) if option is not type(None)]
        return value if value is None or len(options) > 1 else _made(options[0], value)
    if dataclasses.is_dataclass(kind):
        types = get_type_hints(kind)
        given = [field for field in dataclasses.fields(kind) if field.name in value or _is_required(field)]
        made = {field.name: _made(types[field.name], value[field.name]) for field in given}
        return kind(**made) if isinstance(kind, type) else None
    if isinstance(kind, type) and issubclass(kind, Enum):
        return kind[value]
    if kind is float and type(value) in (int, float, str):  # a text for what is not finite
        return float(value)
    if kind in (str, int, bool) and type(value) is not kind:
        raise TypeError(f"{value!r} is no {kind.__name__}")
    return value


def _is_required(field: dataclasses.Field[Any]) -> bool:
    """Whether a record must have the field; one with a default may be younger than the record."""
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
