"""The times of a plant's settings, those that are stated and those that follow from how fast it is."""

from collections.abc import Iterator
from dataclasses import dataclass

from homeostat.domain.plant.timing import Timing
from homeostat.plants.settings.settings import Settings, Timed, with_times


@dataclass(frozen=True, slots=True)
class Time:
    """One time."""

    table: str
    """Table of the settings."""
    key: str
    """Its key there."""
    seconds: float
    """How long it is [s]; infinite for never."""
    stated: bool
    """Whether the file states it."""


def times(settings: Settings, timing: Timing) -> Iterator[Time]:
    """Every time of ``settings`` as the plant of this ``timing`` has it."""
    stated = settings.time.given()
    yield Time("time", "tick_s", timing.tick_s, "tick_s" in stated)
    yield Time("time", "response_s", timing.response_s, stated.get("response_s") is not None)
    yield from _of("twin", settings.twin, timing)
    yield from _of("monitoring", settings.monitoring, timing)
    yield from _of("intervention", settings.intervention, timing)


def _of(name: str, table: Timed, timing: Timing) -> Iterator[Time]:
    filled = with_times(table, timing).settings
    for key in type(table).model_fields:
        if key.endswith("_s") or key == "stride":
            yield Time(name, key, float(getattr(filled, key)), key in table.given())
