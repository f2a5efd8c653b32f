"""When faults of a run begin, and when monitoring knows the plant that they begin in."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from homeostat.evaluate.lint.finding import Finding, Place, Severity
from homeostat.plants.files.folder import SETTINGS
from homeostat.plants.settings.settings import Settings

HEALTHY: Final = 0.8
"""Share of the stretch that has to be healthy: the means then have less than a fifth of a fault in them [1]."""


def before_known(settings: Settings) -> Iterator[Finding]:
    """A fault that begins before most of what the plant's own means are learned from; ``settings`` are completed.

    A stretch that is longer than a run is meant never to be full. So it is where an amount is made: a fault has to
    begin within the batch.
    """
    run, monitoring = settings.run, settings.monitoring.settings
    known_s = monitoring.settle_s + monitoring.centre_s
    healthy_s = monitoring.settle_s + HEALTHY * monitoring.centre_s
    if run.onset_s >= healthy_s or monitoring.centre_s >= run.end_s or settings.objective.priced == "throughput":
        return
    what = (
        f"a fault of a run begins at {run.onset_s:g} s where nobody says otherwise, and monitoring knows the plant's "
        f"own means after {known_s:g} s at the earliest (settle_s = {monitoring.settle_s:g}, centre_s = "
        f"{monitoring.centre_s:g}): it learns them of a plant that is faulty already"
    )
    shorter = "a shorter settle_s or centre_s in [monitoring]"
    later = f"let it begin after {known_s:g} s and the time that the plant takes to start, or state {shorter}"
    remedy = later if known_s < run.end_s else f"state {shorter}, or let a run last longer (end_s)"
    yield Finding(Severity.WARNING, "settings", Place(SETTINGS, None, "run, onset_s"), what, remedy)
