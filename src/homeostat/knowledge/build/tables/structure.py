"""Rows about what the plant is made of, its signals, loops and parameters; the guide to plants says what they mean."""

from __future__ import annotations

from typing import Annotated

from pydantic import model_validator

from homeostat.domain.plant.description import ComponentKind, Relation
from homeostat.domain.plant.tag import Role
from homeostat.knowledge.build.tables.cells import (
    CellError,
    Component,
    Equation,
    Name,
    Operator,
    OptionalComponent,
    OptionalOperator,
    OptionalPositive,
    OptionalTag,
    Parameter,
    Positive,
    Row,
    Size,
    Tag,
    TagName,
    Text,
    Value,
    in_order,
    one_of,
    words_of,
)
from homeostat.knowledge.store.error import Code


class Equipment(Row):
    """A part of the plant."""

    id: Name
    kind: Annotated[str, words_of(ComponentKind)]
    part_of: OptionalComponent = None
    label: Text


class Signal(Row):
    """A tag."""

    tag: TagName
    role: Annotated[str, words_of(Role)]
    unit: Text
    low: Value
    high: Value
    scale: Positive
    rate_limit: OptionalPositive = None
    increment: OptionalPositive = None
    component: Component
    relation: Annotated[str, words_of(Relation)]
    variable: Name
    description: Text

    @model_validator(mode="after")
    def _fits(self) -> Signal:
        in_order(self.low, self.high, "low and high")
        span = self.high - self.low
        for name, value in (("scale", self.scale), ("increment", self.increment)):
            if value is not None and not span * 1e-6 <= value <= span:
                message = f"{name} {value:g} is outside {span * 1e-6:g} to {span:g} {self.unit}, the width of the range"
                raise CellError(Code.BAD_NUMBER, f"{message}; correct the cell")
        return self


class Sensor(Row):
    """How wrong a sensor may be."""

    component: Component
    parameter_bias: Name
    parameter_noise: Name
    bias_sd: Size
    noise_sd: Size
    noise_unit: Text
    description: Text | None = None


class Loop(Row):
    """A loop of the basic control system."""

    id: Name
    controller: Component
    operator: Operator
    pv: Tag
    sp: Tag
    mv: Tag
    gain: Parameter
    reset: Parameter
    label: Text


class ModelParameter(Row):
    """A constant of the process model."""

    symbol: Name
    value: Value
    unit: Text
    sd: Size
    spread: Annotated[str, one_of("absolute", "relative")]
    component: Component
    description: Text

    @model_validator(mode="after")
    def _fits(self) -> ModelParameter:
        if self.spread == "relative" and self.sd > 1.0:
            message = f"sd {self.sd:g} is more than the value itself; a relative one is a fraction from 0 to 1"
            raise CellError(Code.BAD_NUMBER, message)
        if self.spread == "absolute" and self.sd > abs(self.value):
            message = f"sd {self.sd:g} {self.unit} is more than the value itself, {self.value:g} {self.unit}; lower it"
            raise CellError(Code.BAD_NUMBER, message)
        return self


class ProcessOperator(Row):
    """What the plant does in one place."""

    id: Name
    resource: Component
    successor: OptionalOperator = None
    label: Text


class Flow(Row):
    """What goes into a process operator or comes out of it."""

    operator: Operator
    direction: Annotated[str, one_of("input", "output")]
    flow: Name
    kind: Annotated[str, one_of("Product", "Energy", "Information")]
    tag: OptionalTag = None
    label: Text


class OperatorEquation(Row):
    """How a process operator behaves."""

    id: Name
    operator: Operator
    result: Name
    expression: Equation
    label: Text
