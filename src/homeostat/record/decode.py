"""Events of a recorded run as the types that they were when they were recorded."""

import dataclasses
from enum import Enum
from functools import cache
from types import UnionType
from typing import Any, Final, Union, get_args, get_origin, get_type_hints

from homeostat.journal import Event, Record
from homeostat.record.events import EVENTS

_BY_KIND: Final = {event.kind: event for event in EVENTS}


class DecodeError(ValueError):
    """A record lacks what its event needs: another version of the project wrote it."""


def decode(record: Record) -> Event | None:
    """The event that ``record`` holds; None for a kind that is not in :data:`~homeostat.record.events.EVENTS`."""
    kind = _BY_KIND.get(record.kind)
    if kind is None:
        return None
    try:
        event: Event = made_of(kind, dict(record.fields))
    except (LookupError, TypeError, ValueError, ArithmeticError, RecursionError) as error:
        raise DecodeError(
            f"event {record.seq} ({record.kind!r}) cannot be read: {error!r}; use the version that recorded it"
        ) from error
    return event


def made_of(kind: Any, value: Any) -> Any:
    """``value``, in JSON form, as the type ``kind``; LookupError, TypeError or ValueError where it is none."""
    if get_origin(kind) is tuple:
        return tuple(made_of(get_args(kind)[0], item) for item in value)
    if get_origin(kind) in (Union, UnionType):
        options = [option for option in get_args(kind) if option is not type(None)]
        return value if value is None or len(options) > 1 else made_of(options[0], value)
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        types = _types(kind)
        given = [field for field in dataclasses.fields(kind) if field.name in value or _is_required(field)]
        made = {field.name: made_of(types[field.name], value[field.name]) for field in given}
        return kind(**made)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return kind[value]
    if kind is float and type(value) in (int, float, str):  # a text for what is not finite
        return float(value)
    if kind in (str, int, bool) and type(value) is not kind:
        raise TypeError(f"{value!r} is no {kind.__name__}")
    return value


@cache
def _types(kind: Any) -> dict[str, Any]:
    """Field -> type of an event, or of a part of one; finding them is most of the work."""
    return get_type_hints(kind)


def _is_required(field: dataclasses.Field[Any]) -> bool:
    """Whether a record must have the field; one with a default may be younger than the record."""
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
