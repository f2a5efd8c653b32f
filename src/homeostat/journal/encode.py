"""Values to JSON, always the same way: the same event gives the same bytes on every run and machine."""

import dataclasses
import hashlib
import json
import math
from collections.abc import Mapping
from enum import Enum
from typing import Any, TypeAlias, cast

import numpy as np

Json: TypeAlias = "bool | int | float | str | list[Json] | dict[str, Json] | None"
"""What a line of the journal is made of."""

TYPE_KEY = "@type"
"""Key under which a nested dataclass carries its class name; no Python field can have this name."""


def canonical(value: Json) -> str:
    """One line of ASCII JSON without spaces; keys stay in the order in which they were put."""
    return json.dumps(value, ensure_ascii=True, allow_nan=False, separators=(",", ":"))


def encode(value: object, where: str = "value") -> Json:
    """The JSON form of ``value``; ``where`` names it in the error.

    Numbers and text stay; numpy scalars become numbers; NaN and the infinities become the strings ``NaN``, ``Infinity``
    and ``-Infinity``; an enum becomes its name; tuples and lists become lists; a set is sorted; a mapping is sorted by
    key; a frozen dataclass becomes an object that starts with its class name under ``@type``; an array becomes its
    shape, type and digest, because trajectories belong in a Parquet file.

    Raises TypeError for anything else.

    >>> encode((1.5, float("nan"), {"b": True, "a": None}))
    [1.5, 'NaN', {'a': None, 'b': True}]
    """
    if isinstance(value, Enum):
        return value.name
    if value is None or isinstance(value, bool | int | float | str | np.generic):
        return _scalar(value, where)
    if isinstance(value, tuple | list):
        return [encode(item, f"{where}[{i}]") for i, item in enumerate(value)]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {TYPE_KEY: type(value).__name__, **encode_fields(value, where)}
    if isinstance(value, Mapping):
        return _mapping(value, where)
    if isinstance(value, set | frozenset):
        return sorted((encode(item, f"an item of {where}") for item in value), key=canonical)
    if isinstance(value, np.ndarray):
        return _array(value, where)
    raise _unfit(value, where)


def encode_fields(record: object, where: str) -> dict[str, Json]:
    """The fields of a frozen dataclass instance in the order of their declaration."""
    return {name: encode(getattr(record, name), f"{where}.{name}") for name in field_names(type(record))}


def field_names(cls: type) -> tuple[str, ...]:
    """The field names of a dataclass; TypeError unless it is frozen, because a trace must not change after the fact."""
    if not dataclasses.is_dataclass(cls) or not cast("Any", cls).__dataclass_params__.frozen:
        raise TypeError(
            f"{cls.__name__!r} is not a frozen dataclass; declare it with @dataclass(frozen=True, slots=True)"
        )
    return tuple(field.name for field in dataclasses.fields(cls))


def _scalar(value: object, where: str) -> Json:
    plain = value.item() if isinstance(value, np.generic) else value
    if isinstance(plain, float):
        if math.isfinite(plain):
            return float(plain)
        return "NaN" if math.isnan(plain) else "Infinity" if plain > 0 else "-Infinity"
    if plain is None or isinstance(plain, bool | int | str):
        return plain
    raise _unfit(value, where)


def _mapping(value: Mapping[object, object], where: str) -> Json:
    encoded: dict[str, Json] = {}
    for key, item in value.items():
        name = key.name if isinstance(key, Enum) else key
        if not isinstance(name, str) or name in encoded:
            raise TypeError(f"key {key!r} of {where} is not a unique text; use text or enum members as keys")
        encoded[name] = encode(item, f"{where}[{name!r}]")
    return dict(sorted(encoded.items()))


def _array(value: np.ndarray, where: str) -> Json:
    if value.dtype.hasobject:
        raise TypeError(f"{where} is an array of Python objects, which has no digest; make it an array of numbers")
    return {
        TYPE_KEY: "array",
        "shape": list(value.shape),
        "dtype": value.dtype.str,
        "sha256": hashlib.sha256(value.tobytes()).hexdigest(),
    }


def _unfit(value: object, where: str) -> TypeError:
    return TypeError(
        f"{where} is a {type(value).__name__!r}, which a trace cannot hold; "
        "use numbers, text, enums, tuples, mappings or frozen dataclasses"
    )
