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
    noise: cells.Size
    bias: cells.Size
    description: cells.Text
    scale: cells.OptionalPositive = None
    noise_unit: cells.Text | None = None
    fastest: cells.OptionalPositive = None
    variable: cells.Name | None = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        cells.in_order(self.low, self.high, "low and high")
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
