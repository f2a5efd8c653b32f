"""Rows about what the plant is made of, its signals, loops and parameters; the guide to plants says what they mean."""

from typing import Annotated, Final, Self

from pydantic import model_validator

from homeostat.domain.plant.description import ComponentKind, Relation
from homeostat.domain.plant.tag import Role
from homeostat.knowledge.build.tables import cells
from homeostat.knowledge.store.error import Code

MOST_ABSOLUTE: Final = 10.0
"""Multiples of a value, which is not 0, that its absolute standard deviation may be [1]: what lies around 0 has no size
of its own, and a number that is wrong by some digits is found."""


class Equipment(cells.TableRow):
    """A part of the plant."""

    id: cells.Name
    kind: Annotated[str, cells.words_of(ComponentKind)]
    part_of: cells.OptionalComponent = None
    label: cells.Text


class Signal(cells.TableRow):
    """A tag."""

    tag: cells.TagName
    role: Annotated[str, cells.words_of(Role)]
    unit: cells.Text
    low: cells.Value
    high: cells.Value
    scale: cells.Positive
    rate_limit: cells.OptionalPositive = None
    increment: cells.OptionalPositive = None
    component: cells.Component
    relation: Annotated[str, cells.words_of(Relation)]
    variable: cells.Name
    description: cells.Text

    @model_validator(mode="after")
    def _fits(self) -> Self:
        cells.in_order(self.low, self.high, "low and high")
        span = self.high - self.low
        for name, value in (("scale", self.scale), ("increment", self.increment)):
            if value is not None and not span * 1e-6 <= value <= span:
                message = f"{name} {value:g} is outside {span * 1e-6:g} to {span:g} {self.unit}, the width of the range"
                raise cells.CellError(Code.BAD_NUMBER, f"{message}; correct the cell")
        return self


class Sensor(cells.TableRow):
    """How wrong a sensor may be."""

    component: cells.Component
    parameter_bias: cells.Name
    parameter_noise: cells.Name
    bias_sd: cells.Size
    noise_sd: cells.Size
    noise_unit: cells.Text
    description: cells.Text | None = None


class Loop(cells.TableRow):
    """A loop of the basic control system."""

    id: cells.Name
    controller: cells.Component
    operator: cells.Operator
    pv: cells.Tag
    sp: cells.Tag
    mv: cells.Tag
    gain: cells.Parameter
    reset: cells.Parameter
    label: cells.Text


class ModelParameter(cells.TableRow):
    """A constant of the process model."""

    symbol: cells.Name
    value: cells.Value
    unit: cells.Text
    sd: cells.Size
    spread: Annotated[str, cells.one_of("absolute", "relative")]
    component: cells.Component
    description: cells.Text

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.spread == "relative" and self.sd > 1.0:
            message = f"sd {self.sd:g} is more than the value itself; a relative one is a fraction from 0 to 1"
            raise cells.CellError(Code.BAD_NUMBER, message)
        if self.spread == "absolute" and self.value != 0.0 and self.sd > MOST_ABSOLUTE * abs(self.value):
            message = (
                f"sd {self.sd:g} {self.unit} is more than {MOST_ABSOLUTE:g} times the value, {self.value:g} {self.unit}"
                "; lower it, or state the value as 0 if it lies around that"
            )
            raise cells.CellError(Code.BAD_NUMBER, message)
        return self


class ProcessOperator(cells.TableRow):
    """What the plant does in one place."""

    id: cells.Name
    resource: cells.Component
    successor: cells.OptionalOperator = None
    label: cells.Text


class Flow(cells.TableRow):
    """What goes into a process operator or comes out of it."""

    operator: cells.Operator
    direction: Annotated[str, cells.one_of("input", "output")]
    flow: cells.Name
    kind: Annotated[str, cells.one_of("Product", "Energy", "Information")]
    tag: cells.OptionalTag = None
    label: cells.Text


class OperatorEquation(cells.TableRow):
    """How a process operator behaves."""

    id: cells.Name
    operator: cells.Operator
    result: cells.Name
    expression: cells.Equation
    label: cells.Text
