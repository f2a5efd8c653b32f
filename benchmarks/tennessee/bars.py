"""What was asked for and does not follow from the runs that are in; what none is in for is not measured."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

from benchmarks.tennessee.alone import HIDDEN
from benchmarks.tennessee.operated import Looked

SEEDS: Final = 3
DECISION_S: Final = 20.0
"""What a decision may take by the clock [s]."""
RATES: Final = 0.0012
"""How far our rates are from those of the published code at worst, as a share of what is held per hour [1]: what
``tests/plants/tennessee_eastman/test_oracle.py`` finds where tep-studio 0.2.0 is installed (decision 0055)."""
RATES_BAR: Final = 0.002
"""How far they may be [1]."""
LATER: Final = range(8, 29)
"""Numbers of the published disturbances that are no faults of the tables, or random."""
NOT_MEASURED: Final = "not measured"


def missed(runs: Sequence[Looked], asked: int) -> Iterator[str]:
    """One line for each bar that is not met, or not known to be; ``asked``: how many ``runs`` there are in all."""
    if RATES > RATES_BAR:
        yield f"rates within {RATES_BAR:g} of what is held per hour: {RATES:g} at worst of 300 states"
    if len(runs) < asked:
        yield f"every disturbance and stuck valve in three seeds: {len(runs)} of {asked} runs are in"
    later = [run for run in runs if run.name in {f"IDV {number}" for number in LATER}]
    yield from _there(f"IDV {LATER[0]} to {LATER[-1]} looked after", len(later), SEEDS * len(LATER))
    yield from _in_time(runs)
    yield from _kept(runs)
    yield from _unknown([run for run in runs if run.hidden])
    yield from _deadlines([run for run in runs if math.isfinite(run.trip.hours)])


def _there(what: str, count: int, wanted: int) -> Iterator[str]:
    if count < wanted:
        yield f"{what}: {f'{count} of {wanted} runs are in' if count else NOT_MEASURED}"


def _in_time(runs: Sequence[Looked]) -> Iterator[str]:
    took = [run.decision_s for run in runs if run.decision_s is not None]
    slow = [each for each in took if each > DECISION_S]
    if slow:
        yield f"a decision within {DECISION_S:g} s: {len(slow)} of {len(took)} took longer, up to {max(slow):.0f} s"
    elif not took:
        yield f"a decision within {DECISION_S:g} s: {NOT_MEASURED}"


def _kept(runs: Sequence[Looked]) -> Iterator[str]:
    lost = [run for run in runs if run.outside_s > 0.0 and run.kept_by]
    if lost or not runs:
        found = f"not in {_named(lost)}" if lost else NOT_MEASURED
        yield f"inside the trip limits wherever a constant answer keeps them: {found}"


def _unknown(hidden: Sequence[Looked]) -> Iterator[str]:
    what = f"IDV {', '.join(map(str, HIDDEN))}, which stand in no table, called unknown"
    yield from _there(what, len(hidden), SEEDS * len(HIDDEN))
    if called := [run for run in hidden if run.called and not run.unknown]:
        yield f"{what}: another name in {_named(called)}"


def _deadlines(tripping: Sequence[Looked]) -> Iterator[str]:
    """The time to act by was said, and was before the trip, wherever the plant trips with nobody."""
    what = "a time to act by before the true trip"
    if not tripping:
        yield f"{what}: {NOT_MEASURED}"
    if none := [run for run in tripping if run.foreseen_s is None]:
        yield f"{what}: none was said in {_named(none)}"
    if late := [run for run in tripping if run.foreseen_s is not None and run.foreseen_s > 3600.0 * run.trip.hours]:
        yield f"{what}: it was after it in {_named(late)}"


def _named(runs: Sequence[Looked]) -> str:
    return ", ".join(f"{run.name} seed {run.seed}" for run in runs)
