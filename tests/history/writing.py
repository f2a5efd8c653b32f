"""A process that writes a store until it is killed, and says what was acknowledged: ``python writing.py DIR``."""

from __future__ import annotations

import sys
from pathlib import Path

from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.settings import HistorySettings
from tests.contracts.history_store import T0, S, batch, plain

TAGS = 40


def main(folder: str) -> None:
    """Append second after second; a line with the number of each batch after the store has taken it."""
    store = EmbeddedStore(folder, HistorySettings(segment_s=40.0))
    extent = store.extent()
    first = 0 if extent is None else (extent.to_us - T0) // S + 1
    for k in range(first, first + 1_000_000):
        now = T0 + k * S
        store.append(batch(*(plain(f"tag {n:02d}", now, k + n / 100) for n in range(TAGS)), own_us=now))
        sys.stdout.write(f"{k}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(str(Path(sys.argv[1])))
