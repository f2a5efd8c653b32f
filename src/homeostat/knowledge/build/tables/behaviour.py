"""Rows about how the plant is run and what must hold; the guide to plants says what they mean."""

from typing import Annotated, Self

from pydantic import model_validator

from homeostat.domain.plant.limits import LimitKind, Owner
from homeostat.domain.plant.prices import PriceKind
from homeostat.knowledge.build.tables import cells
from homeostat.knowledge.store.error import Code
from homeostat.stl.formula import parse


class OperatingState(cells.TableRow):
    """A state of the sequence."""

    id: cells.Name
    label: cells.Text
    initial: cells.YesNo
    recovery_target: cells.YesNo
    risk: Annotated[int, cells.whole(0, 1000, "a rank, 0 for the least risk")]
    start_up: cells.YesNo
    start_up_s: Annotated[float | None, cells.seconds("start_up_s", "a start-up takes a sample and at most a day")] = (
        None
    )
    settled_when: cells.Condition
    description: cells.Text | None = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if (self.start_up == "yes") != (self.start_up_s is not None):
            needed = (
                "must be stated: limits of start-up cannot hold for ever" if self.start_up == "yes" else "must be empty"
            )
            raise cells.CellError(Code.MISSING_VALUE, f"start_up is {self.start_up}, so start_up_s {needed}")
        return self


class StateRequirement(cells.TableRow):
    """What must work in a state."""

    state: cells.StateName
    component: cells.Component
    description: cells.Text | None = None


class Setpoint(cells.TableRow):
    """What a state admits of a commanded tag."""

    state: cells.StateName
    tag: cells.Tag
    low: cells.Value
    high: cells.Value
    design: cells.OptionalValue = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        cells.in_order(self.low, self.high, "low and high", equal=True)
        if self.design is not None and not self.low <= self.design <= self.high:
            message = f"design {self.design:g} is outside {self.low:g} to {self.high:g}, what the state admits"
            raise cells.CellError(Code.SETPOINT_OUTSIDE_RANGE, f"{message}; correct one of them")
        return self


class Transition(cells.TableRow):
    """A way from a state to another."""

    id: cells.Name
    source: cells.StateName
    target: cells.StateName
    event: cells.Name
    guard: cells.Condition
    decision: cells.YesNo
    description: cells.Text | None = None


class Limit(cells.TableRow):
    """What must hold at every moment."""

    id: cells.Name
    kind: Annotated[str, cells.words_of(LimitKind)]
    hard: cells.YesNo
    formula: cells.Condition
    source: cells.Text
    description: cells.Text | None = None


class Criterion(cells.TableRow):
    """What a proposal must keep on the twin."""

    id: cells.Name
    owner: Annotated[str, cells.words_of(Owner)]
    hard: cells.YesNo
    formula: cells.Condition
    asks_after_s: Annotated[
        float | None,
        cells.seconds("asks_after_s", "what is shorter is a transient, and what is longer asks nobody in time"),
    ] = None
    source: cells.Text
    description: cells.Text | None = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.asks_after_s is None:
            return self
        if self.hard == "yes":
            message = "asks_after_s is given, but hard is yes: only what has a price can be bettered; empty the cell"
            raise cells.CellError(Code.BAD_WORD, message)
        if parse(self.formula).horizon_s > 0.0:
            message = f"asks_after_s is given, but '{self.formula}' looks ahead: no reading says it; empty the cell"
            raise cells.CellError(Code.LIMIT_LOOKS_AHEAD, message)
        return self


class Price(cells.TableRow):
    """What something costs, in the plant's currency."""

    kind: Annotated[str, cells.words_of(PriceKind)]
    item: cells.Name
    price: cells.Size
    description: cells.Text


class FallbackStep(cells.TableRow):
    """A command of a way to the safe state."""

    strategy: cells.Name
    target: cells.StateName
    step: Annotated[int, cells.whole(1, 1000, "its place in the order")]
    tag: cells.Tag
    value: cells.OptionalValue = None
    rate: cells.OptionalRate = None
    out_of_service: cells.YesNo
    description: cells.Text | None = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.rate is not None and self.value is None:
            message = f"rate {self.rate:g} is given, but value is empty: nothing ramps to automatic; empty the cell"
            raise cells.CellError(Code.BAD_NUMBER, message)
        return self


class Waiver(cells.TableRow):
    """A permissive that a fallback sets aside."""

    strategy: Annotated[str, cells.Refers("strategy")]
    permissive: Annotated[str, cells.Refers("limit")]
    reason: cells.Text


class FallbackLimit(cells.TableRow):
    """What a fallback does about a hard limit."""

    strategy: Annotated[str, cells.Refers("strategy")]
    limit: cells.LimitName
    acts_within_s: Annotated[
        float,
        cells.seconds(
            "acts_within_s", "it takes three readings to see whether it helps, and what helps later does not help"
        ),
    ]
    rest: cells.Size
    description: cells.Text
