"""Values that are kept once however often they are said: what a card says changes in few places from event to event."""

import json
from collections.abc import Mapping
from typing import Any, final

from homeostat.console.text import to_json

_DEEP = frozenset({"proposal"})
"""Fields that are taken apart again."""


@final
class Pool:
    """Every value once, by its JSON."""

    def __init__(self) -> None:
        """Nothing was said yet."""
        self.values: list[Any] = []
        self._known: dict[str, int] = {}

    def whole(self, value: object) -> int:
        """Number of ``value``."""
        text = to_json(value)
        if text not in self._known:
            self._known[text] = len(self.values)
            self.values.append(json.loads(text))
        return self._known[text]

    def parts(self, value: object) -> int | None:
        """Number of a mapping from each field of the record ``value`` to its own number; None for None."""
        if value is None:
            return None
        return self.whole(self._apart(json.loads(to_json(value))))

    def _apart(self, fields: Mapping[str, Any]) -> dict[str, Any]:
        deep = {n: v for n, v in fields.items() if n in _DEEP and v is not None}
        return {name: self._apart(v) if name in deep else self.whole(v) for name, v in fields.items()}
