"""Rows from which rows of several other tables follow; the guide to plants says what they mean."""

from typing import Annotated, Self

from pydantic import model_validator

from homeostat.knowledge.build.tables import cells
from homeostat.knowledge.store.error import Code


class Instrument(cells.TableRow):
    """A transmitter, with the tag that it measures."""

    id: cells.Name
    tag: cells.TagName
    unit: cells.Text
    low: cells.Value
    high: cells.Value
    at: cells.Component
    noise: cells.OptionalSize = None
    bias: cells.OptionalSize = None
    description: cells.Text
    label: cells.Text | None = None
    role: Annotated[str | None, cells.one_of("PV", "STATUS")] = None
    parameter_bias: cells.Name | None = None
    parameter_noise: cells.Name | None = None
    scale: cells.OptionalPositive = None
    noise_unit: cells.Text | None = None
    fastest: cells.OptionalPositive = None
    variable: cells.Name | None = None
    every_s: Annotated[
        float | None, cells.seconds("every_s", "an instrument shows something new each tick or later")
    ] = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        cells.in_order(self.low, self.high, "low and high")
        if (self.noise is None) != (self.bias is None):
            lacking = "bias" if self.bias is None else "noise"
            message = f"{lacking} is empty; state noise and bias, or neither for what is never wrong, as a switch"
            raise cells.CellError(Code.MISSING_VALUE, message)
        return self


class Stream(cells.TableRow):
    """What flows from one part of the plant to another, or across its boundary."""

    stream: cells.Name
    kind: Annotated[str, cells.one_of("Product", "Energy", "Information")] = "Product"
    source: cells.OptionalComponent = None
    target: cells.OptionalComponent = None
    tag: cells.OptionalTag = None
    label: cells.Text | None = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.source is None and self.target is None:
            message = "source and target are empty; name the part that it leaves or the one that it enters"
            raise cells.CellError(Code.MISSING_VALUE, message)
        return self


class NamedGuard(cells.TableRow):
    """A condition with a name."""

    name: cells.Name
    formula: cells.Condition
    description: cells.Text | None = None


class Omitted(cells.TableRow):
    """Rows that would follow, and are not wanted."""

    table: cells.Name
    row: cells.Text
    reason: cells.Text | None = None
