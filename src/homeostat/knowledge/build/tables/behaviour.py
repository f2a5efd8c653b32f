"""Rows about how the plant is run and what must hold; the guide to plants says what they mean."""

from __future__ import annotations

from typing import Annotated

from pydantic import model_validator

from homeostat.domain.plant.limits import LimitKind, Owner
from homeostat.knowledge.build.tables.cells import (
    CellError,
    Component,
    Condition,
    LimitName,
    Name,
    OptionalValue,
    Refers,
    Row,
    Size,
    State,
    Tag,
    Text,
    Value,
    YesNo,
    in_order,
    number,
    whole,
    words_of,
)
from homeostat.knowledge.description.guarding import TIMES_S
from homeostat.knowledge.store.error import Code


class OperatingState(Row):
    """A state of the sequence."""

    id: Name
    label: Text
    initial: YesNo
    recovery_target: YesNo
    risk: Annotated[int, whole(0, 1000, "a rank, 0 for the least risk")]
    start_up: YesNo
    start_up_s: Annotated[
        float | None, number(*TIMES_S["start_up_s"], "s", "a start-up takes a sample and at most a day")
    ] = None
    settled_when: Condition
    description: Text | None = None

    @model_validator(mode="after")
    def _fits(self) -> OperatingState:
        if (self.start_up == "yes") != (self.start_up_s is not None):
            needed = (
                "must be stated: limits of start-up cannot hold for ever" if self.start_up == "yes" else "must be empty"
            )
            raise CellError(Code.MISSING_VALUE, f"start_up is {self.start_up}, so start_up_s {needed}")
        return self


class StateRequirement(Row):
    """What must work in a state."""

    state: State
    component: Component
    description: Text | None = None


class Setpoint(Row):
    """What a state admits of a commanded tag."""

    state: State
    tag: Tag
    low: Value
    high: Value
    design: OptionalValue = None

    @model_validator(mode="after")
    def _fits(self) -> Setpoint:
        in_order(self.low, self.high, "low and high", equal=True)
        if self.design is not None and not self.low <= self.design <= self.high:
            message = f"design {self.design:g} is outside {self.low:g} to {self.high:g}, what the state admits"
            raise CellError(Code.SETPOINT_OUTSIDE_RANGE, f"{message}; correct one of them")
        return self


class Transition(Row):
    """A way from a state to another."""

    id: Name
    source: State
    target: State
    event: Name
    guard: Condition
    decision: YesNo
    description: Text | None = None


class Limit(Row):
    """What must hold at every moment."""

    id: Name
    kind: Annotated[str, words_of(LimitKind)]
    hard: YesNo
    formula: Condition
    source: Text
    description: Text | None = None


class Criterion(Row):
    """What a proposal must keep on the twin."""

    id: Name
    owner: Annotated[str, words_of(Owner)]
    hard: YesNo
    formula: Condition
    source: Text
    description: Text | None = None


class FallbackStep(Row):
    """A command of a way to the safe state."""

    strategy: Name
    target: State
    step: Annotated[int, whole(1, 1000, "its place in the order")]
    tag: Tag
    value: OptionalValue = None
    out_of_service: YesNo
    description: Text | None = None


class Waiver(Row):
    """A permissive that a fallback sets aside."""

    strategy: Annotated[str, Refers("strategy")]
    permissive: Annotated[str, Refers("limit")]
    reason: Text


class FallbackLimit(Row):
    """What a fallback does about a hard limit."""

    strategy: Annotated[str, Refers("strategy")]
    limit: LimitName
    acts_within_s: Annotated[
        float,
        number(
            *TIMES_S["acts_within_s"],
            "s",
            "it takes three readings to see whether it helps, and what helps later does not help",
        ),
    ]
    rest: Size
    description: Text
