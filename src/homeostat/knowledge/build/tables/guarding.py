"""Rows about readings, trips, writing and start-up; the guide to plants says what they mean."""

from typing import Annotated, Self

from pydantic import model_validator

from homeostat.domain.mode import Side
from homeostat.knowledge.build.tables import cells
from homeostat.knowledge.store.error import Code


class Quality(cells.TableRow):
    """When a reading is good, uncertain or bad."""

    tag: cells.Tag
    every_s: Annotated[
        float | None, cells.seconds("every_s", "an instrument shows something new each tick or later")
    ] = None
    stale_s: Annotated[
        float, cells.seconds("stale_s", "readings come once per second, and an older one is never the present one")
    ]
    noise: cells.OptionalPositive = None
    frozen_s: Annotated[float | None, cells.seconds("frozen_s", "noise may repeat a reading, but not for longer")] = (
        None
    )
    fastest: cells.OptionalPositive = None
    grace_s: Annotated[float, cells.seconds("grace_s", "nobody may be blind for longer")]
    description: cells.Text

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.frozen_s is not None and self.noise is None:
            message = "frozen_s is given, but noise is empty: without noise a constant reading may be true; state it"
            raise cells.CellError(Code.FROZEN_WITHOUT_NOISE, message)
        return self


class Trip(cells.TableRow):
    """How a hard limit is watched."""

    limit: cells.LimitName
    cusum: cells.Size
    grace_s: Annotated[float, cells.seconds("grace_s", "nobody may be blind for longer")]
    carrier: cells.OptionalCondition = None
    lift: cells.Size
    lift_s: Annotated[float, cells.seconds("lift_s", "no trip is lifted for longer")]
    lead: cells.OptionalSize = None
    fastest: cells.OptionalTerm = None
    fallen: cells.OptionalCondition = None
    description: cells.Text

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if (self.lift > 0.0) != (self.lift_s > 0.0):
            message = f"lift {self.lift:g} for lift_s {self.lift_s:g} s lifts nothing; give both a value > 0, or both 0"
            raise cells.CellError(Code.LIFT_WITHOUT_CARRIER, message)
        if self.lift > 0.0 and self.carrier is None:
            message = f"lift {self.lift:g} needs a carrier: nothing carries the limit meanwhile; state one, or lift 0"
            raise cells.CellError(Code.LIFT_WITHOUT_CARRIER, message)
        if self.fastest is not None and self.carrier is None:
            message = "fastest needs a carrier: nothing carries the limit while its reading is not believed; state one"
            raise cells.CellError(Code.LIFT_WITHOUT_CARRIER, message)
        if self.fallen is not None and self.fastest is None:
            message = "fallen needs fastest: nobody says when a reading came faster than the process can; state it"
            raise cells.CellError(Code.LIFT_WITHOUT_CARRIER, message)
        return self


class StartUpLimit(cells.TableRow):
    """What holds instead of a hard limit while the plant starts."""

    limit: cells.LimitName
    formula: cells.Condition
    source: cells.Text
    description: cells.Text


class Writable(cells.TableRow):
    """How a tag is commanded and read back."""

    tag: cells.Tag
    tolerance: cells.Size
    confirm_s: Annotated[
        float, cells.seconds("confirm_s", "it is read back a tick later, and a plant that obeys later does not obey")
    ]
    fastest: cells.OptionalRate = None
    ramped_by: Annotated[str, cells.words_of(Side)]
    automatic: cells.YesNo
    description: cells.Text
