"""Everything that the page may ask of a run, answered beforehand."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from homeostat.console.card.evidence import Evidence
from homeostat.console.drawn import held_s
from homeostat.console.events.alarms import alarm_list
from homeostat.console.events.lines import Verified, journal_lines
from homeostat.console.kept.pool import Pool
from homeostat.console.opened import OpenedRun
from homeostat.console.outlook import changes_s
from homeostat.console.readings import Readings, Values, thinned
from homeostat.console.view import Seen, seen, shown
from homeostat.domain.plant.limits import LimitKind
from homeostat.stl.formula import FormulaError

MOST_SAMPLES: Final = 20_000
"""Most samples that are kept; of more those stay that draw the same picture."""
MOST_MOMENTS: Final = 3000
"""Most moments at which something happened; of more the last ones."""
_DIGITS: Final = 6


def kept_record(run: OpenedRun, verified: Verified, notice: str) -> dict[str, Any]:
    """What the page needs of ``run``; ``notice`` says what kind of file it is."""
    told, readings = shown(run), run.readings
    broken = [] if readings is None else [*_violated(run, readings)]
    known = {0.0, *(e.at_s for e in run.entries), run.last_s, *_changes(run, broken)}
    times = sorted(at_s for at_s in known if at_s <= run.last_s)
    more = f" Of {len(times)} moments the last {MOST_MOMENTS} are in it." if len(times) > MOST_MOMENTS else ""
    pool, found = Pool(), []
    features: dict[str, None] = {}
    for at_s in times[-MOST_MOMENTS:]:
        one = seen(run, at_s)
        features |= dict.fromkeys(s.feature for s in one.card.seen if s.feature) if one.card else {}
        alarms = pool.whole(alarm_list(run.until(at_s), at_s))
        found.append([at_s, *_moment(one, pool), alarms, pool.whole(one.told)])
    following = "The run goes on; this page follows it."
    said = f"{notice}{more} {told.notice.replace(following, 'The run went on when it was made.')}"
    return {
        "run": replace(told, live=False, closed=True, attached=False, notice=said.strip()),
        "moments": found,
        "pool": pool.values,
        "violated": broken,
        "readings": None if readings is None else _columns(readings),
        "features": {} if readings is None else _features(run, readings, features),
        "journal": journal_lines(run.run_dir),
        "verified": verified,
    }


def _changes(run: OpenedRun, broken: Sequence[tuple[float, tuple[str, ...]]]) -> Iterator[float]:
    """Moments between two events, or after the last, at which what comes next is said in other words [s].

    ``broken``: from when on which limits are violated.
    """
    for at_s, _ in broken:
        yield at_s
        yield from _around(at_s + held_s(run.plant.description), run.last_s)
    events_s = sorted({e.at_s for e in run.entries})
    for at_s, next_s in zip(events_s, [*events_s[1:], run.last_s], strict=True):
        for then_s in changes_s(run.stands(at_s), run.plant.description):
            if then_s > at_s:
                yield from _around(then_s, next_s)


def _around(at_s: float, before_s: float) -> Iterator[float]:
    """``at_s`` and the moment after it, where that is ``before_s`` [s]."""
    if at_s < before_s:
        yield from (at_s, math.nextafter(at_s, math.inf))


def _moment(one: Seen, pool: Pool) -> Sequence[int | None]:
    card, overview = pool.parts(one.card), pool.parts(one.overview)
    return card, overview, pool.whole(one.quality), pool.whole(one.targets)


def _violated(run: OpenedRun, readings: Readings) -> Iterator[tuple[float, tuple[str, ...]]]:
    """From when on which limits were violated [s]; start-up apart."""
    rows: dict[str, Values] = {}
    for limit in run.plant.description.limits.limits:
        if limit.kind is LimitKind.PERMISSIVE or not limit.formula.tags <= readings.signals.keys():
            continue
        signals = {tag: readings.signals[tag] for tag in limit.formula.tags}
        try:
            rows[limit.name] = limit.formula.margins(signals, readings.dt_s)[0] < 0.0
        except FormulaError:
            continue
    last: tuple[str, ...] | None = None
    for index, at_s in enumerate(readings.times_s.tolist()):
        started = run.stands(at_s).started
        now = tuple(name for name, flags in rows.items() if flags[index]) if started else ()
        if now != last:
            last = now
            yield at_s, now


def _columns(readings: Readings) -> dict[str, Any]:
    """Times, and tag -> values at them, None where there is none."""
    kept = _kept(readings.times_s, readings.signals.values())
    return {
        "times_s": [round(at_s, 3) for at_s in readings.times_s[kept].tolist()],
        "signals": {tag: _short(values[kept]) for tag, values in readings.signals.items()},
    }


def _kept(times_s: Values, series: Any) -> Any:
    """Samples that are kept: every one, or first, last, least and largest of each of many parts of the time."""
    if times_s.size <= MOST_SAMPLES:
        return np.arange(times_s.size)
    found = {0}
    for values in series:  # each by itself: together they would leave no room for fewer
        found |= set(thinned(times_s, [values], MOST_SAMPLES // 40).tolist())
    return np.array(sorted(found), dtype=np.int64)


def _short(values: Values) -> list[float | None]:
    return [float(f"{v:.{_DIGITS}g}") if np.isfinite(v) else None for v in values.tolist()]


def _features(run: OpenedRun, readings: Readings, names: dict[str, None]) -> dict[str, Any]:
    evidence = Evidence(run.plant, readings)
    drawn = {name: evidence.feature(name, 0.0, readings.last_s, 2000) for name in names}
    return {name: found for name, found in drawn.items() if found is not None}
