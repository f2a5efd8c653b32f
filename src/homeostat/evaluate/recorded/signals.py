"""What a plant's run or history measured, as a table for detectors: its tags, and its features beside them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from homeostat.agents.monitoring.features import FeatureFilter
from homeostat.detectors.error import DetectionError
from homeostat.detectors.tables.reading import MOST_VALUES
from homeostat.detectors.tables.table import SignalTable
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.snapshot import Snapshot
from homeostat.history.quality import severity
from homeostat.history.samples import Series, Span
from homeostat.history.store import HistoryReader
from homeostat.history.times import told_time
from homeostat.journal.beside.artifacts import TIME
from homeostat.record.directory import MEASURED, TRAJECTORY

Values = NDArray[np.float64]
STALE: Final = 3
"""Rows for which a reading of a history counts after it was taken."""


def signals_of_run(run_dir: Path, plant: PlantDescription) -> SignalTable:
    """What the instruments of ``plant`` said in the run in ``run_dir``, and its features.

    Raises DetectionError where the run has kept no trajectory, because it goes on or was killed.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = run_dir / TRAJECTORY
    if not path.is_file():
        text = f"{str(run_dir)!r} has no {TRAJECTORY}: the run goes on, or was ended before it was kept"
        raise DetectionError(f"{text}; take its history (run --history), or another run")
    try:
        table = pq.read_table(path)
        times = np.asarray(table[TIME], dtype=np.float64)
        names = [name for name in table.schema.names if name.startswith(MEASURED)]
        readings = {n.removeprefix(MEASURED): np.asarray(table[n], dtype=np.float64) for n in names}
    except (pa.ArrowException, KeyError, ValueError) as error:
        raise DetectionError(f"{str(path)!r} is no trajectory: {' '.join(str(error).split()):.200}") from error
    return _table(str(run_dir), times, readings, plant, "")


def signals_of_history(history: HistoryReader, name: str, span: Span, plant: PlantDescription | None) -> SignalTable:
    """What ``history`` has of ``span``, a row per tick of ``plant``, and its features; per second without a plant.

    Raises DetectionError where that is too much.
    """
    tick_s = plant.timing.tick_s if plant is not None else 1.0
    known = {tag.name for tag in plant.tags} if plant is not None else None
    tags = [tag for tag in history.tags() if known is None or tag in known]
    step_us = round(tick_s * 1e6)
    at_us = np.arange(span.from_us, span.to_us, step_us, dtype=np.int64)
    if not tags or len(at_us) < 2:
        raise DetectionError(f"{name}: there are {len(tags)} tags in {len(at_us)} rows; nothing can be judged")
    if len(at_us) * len(tags) > MOST_VALUES:
        text = f"{name}: {len(at_us)} rows of {len(tags)} tags are more than {MOST_VALUES} values"
        raise DetectionError(f"{text}; take less of it with --last, or --from and --to")
    early = Span(span.from_us - STALE * step_us, span.to_us)
    readings = {tag: _each(series, at_us, STALE * step_us) for tag, series in history.read(tags, early).items()}
    return _table(name, (at_us - at_us[0]) / 1e6, readings, plant, told_time(int(at_us[0])))


def _each(series: Series, at_us: NDArray[np.int64], stale_us: int) -> Values:
    """The latest good sample at each time, NaN where there is none that is fresh, shape (times,)."""
    good = (severity(series.quality) == 0) & np.isfinite(series.value)
    times, values = series.time_us[good], series.value[good]
    if not len(times):
        return np.full(len(at_us), np.nan)
    latest = np.maximum(np.searchsorted(times, at_us, side="right") - 1, 0)
    age_us = at_us - times[latest]
    return np.where((age_us >= 0) & (age_us <= stale_us), values[latest], np.nan)


def _table(
    name: str, times: Values, readings: Mapping[str, Values], plant: PlantDescription | None, start: str
) -> SignalTable:
    """The readings and the features of ``plant``, from the first row on in which all of these are known.

    Tags without any reading are left out: nobody set or measured them.
    """
    readings = {tag: values for tag, values in readings.items() if np.isfinite(values).any()}
    if not readings:
        raise DetectionError(f"{name}: no tag has any good reading; nothing can be judged")
    features = plant.features if plant is not None else ()
    filters = [FeatureFilter(feature, plant.timing.tick_s) for feature in features] if plant is not None else []
    tags, columns = tuple(readings), np.stack(list(readings.values()), axis=1)
    found = np.full((len(times), len(filters)), np.nan)
    for k, at_s in enumerate(times.tolist()):
        snapshot = Snapshot(at_s, dict(zip(tags, columns[k].tolist(), strict=True)))
        found[k] = [np.nan if value is None else value for value in (f.update(snapshot) for f in filters)]
    known = ~np.isnan(found).all(axis=0)
    ready = int((~np.isnan(found[:, known])).all(axis=1).argmax()) if known.any() else 0
    names = (*tags, *(f.name for f, is_known in zip(features, known, strict=True) if is_known))
    values = np.concatenate([columns, found[:, known]], axis=1)
    return SignalTable(name, names, times[ready:], values[ready:], start)
