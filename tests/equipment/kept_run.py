"""A simulated run's readings as the history of an attached plant, with its process time."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.samples import Batch
from homeostat.service.historian.observed import PROCESS_TIME

BEGIN_US = 1_764_000_000_000_000


def kept(
    folder: Path, readings: Mapping[str, NDArray[np.float64]], begin_s: float, without: Collection[int] = ()
) -> EmbeddedHistory:
    """The history in ``folder`` of ``readings`` once a second from process time ``begin_s`` on, some left out."""
    tags, length = (*readings, PROCESS_TIME), len(next(iter(readings.values())))
    with EmbeddedStore(folder) as store:
        for k in range(length):
            if k in without:
                continue
            at = np.full(len(tags), BEGIN_US + k * 1_000_000, dtype=np.int64)
            values = np.array([*(column[k] for column in readings.values()), begin_s + k])
            store.append(Batch(tags, at, values, np.zeros(len(tags), dtype=np.uint32), at, int(at[0])))
    return EmbeddedHistory(folder)
