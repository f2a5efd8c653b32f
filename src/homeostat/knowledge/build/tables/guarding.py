"""Rows about readings, trips, writing and start-up; the guide to plants says what they mean."""

from __future__ import annotations

from typing import Annotated

from pydantic import model_validator

from homeostat.domain.mode import Side
from homeostat.knowledge.build.tables.cells import (
    CellError,
    Condition,
    LimitName,
    OptionalCondition,
    OptionalPositive,
    Row,
    Size,
    Tag,
    Text,
    YesNo,
    number,
    words_of,
)
from homeostat.knowledge.description.guarding import TIMES_S
from homeostat.knowledge.store.error import Code


class Quality(Row):
    """When a reading may be believed."""

    tag: Tag
    stale_s: Annotated[
        float,
        number(*TIMES_S["stale_s"], "s", "readings come once per second, and an older one is never the present one"),
    ]
    noise: OptionalPositive = None
    frozen_s: Annotated[
        float | None, number(*TIMES_S["frozen_s"], "s", "noise may repeat a reading, but not for longer")
    ] = None
    fastest: OptionalPositive = None
    grace_s: Annotated[float, number(*TIMES_S["grace_s"], "s", "nobody may be blind for longer")]
    description: Text

    @model_validator(mode="after")
    def _fits(self) -> Quality:
        if self.frozen_s is not None and self.noise is None:
            message = "frozen_s is given, but noise is empty: without noise a constant reading may be true; state it"
            raise CellError(Code.FROZEN_WITHOUT_NOISE, message)
        return self


class Trip(Row):
    """How a hard limit is watched."""

    limit: LimitName
    cusum: Size
    grace_s: Annotated[float, number(*TIMES_S["grace_s"], "s", "nobody may be blind for longer")]
    carrier: OptionalCondition = None
    lift: Size
    lift_s: Annotated[float, number(*TIMES_S["lift_s"], "s", "no trip is lifted for longer")]
    description: Text

    @model_validator(mode="after")
    def _fits(self) -> Trip:
        if (self.lift > 0.0) != (self.lift_s > 0.0):
            message = f"lift {self.lift:g} for lift_s {self.lift_s:g} s lifts nothing; give both a value > 0, or both 0"
            raise CellError(Code.LIFT_WITHOUT_CARRIER, message)
        if self.lift > 0.0 and self.carrier is None:
            message = f"lift {self.lift:g} needs a carrier: nothing carries the limit meanwhile; state one, or lift 0"
            raise CellError(Code.LIFT_WITHOUT_CARRIER, message)
        return self


class StartUpLimit(Row):
    """What holds instead of a hard limit while the plant starts."""

    limit: LimitName
    formula: Condition
    source: Text
    description: Text


class Writable(Row):
    """How a tag is commanded and read back."""

    tag: Tag
    tolerance: Size
    confirm_s: Annotated[
        float,
        number(*TIMES_S["confirm_s"], "s", "it is read back a tick later, and a plant that obeys later does not obey"),
    ]
    ramped_by: Annotated[str, words_of(Side)]
    automatic: YesNo
    description: Text
