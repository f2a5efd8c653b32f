"""What the page gets, as JSON: numbers that are none become null, and enumerations their words."""

import dataclasses
import json
import math
from collections.abc import Mapping
from enum import Enum
from typing import Any


def to_json(value: Any) -> str:
    """``value`` in JSON that any browser reads: records as objects, no NaN, no infinity."""
    return json.dumps(_plain(value), ensure_ascii=True, allow_nan=False, separators=(",", ":"))


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Enum):
        return value.value
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value
