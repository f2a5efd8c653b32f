"""Files of rows: what a study has done already is not done again."""

from __future__ import annotations

import json
import threading
from pathlib import Path
from typing import Any, final


@final
class Rows:
    """A file of rows, one JSON object a line, which several threads add to."""

    def __init__(self, path: Path) -> None:
        self._path, self._adding = path, threading.Lock()
        path.parent.mkdir(parents=True, exist_ok=True)

    def all(self) -> list[dict[str, Any]]:
        """Every row so far; a torn last one is none."""
        if not self._path.exists():
            return []
        return [json.loads(line) for line in self._path.read_text("utf-8").splitlines() if line.endswith("}")]

    def add(self, row: dict[str, Any]) -> None:
        """Add a row."""
        with self._adding, self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
