"""Rows about what can go wrong and how it shows; the guide to plants says what they mean."""

from __future__ import annotations

from typing import Annotated

from pydantic import model_validator

from homeostat.domain.diagnosis import Direction
from homeostat.knowledge.build.tables.cells import (
    SMALL,
    CellError,
    Component,
    Name,
    OptionalComponent,
    OptionalTerm,
    Refers,
    Row,
    Size,
    Term,
    Text,
    Value,
    Wait,
    in_order,
    number,
    words_of,
)
from homeostat.knowledge.store.error import Code


class Fault(Row):
    """A fault mode."""

    id: Name
    label: Text
    component: Component
    severity_unit: Text
    nominal: Value
    low: Value
    high: Value
    prior: Annotated[float, number(SMALL, 1.0, "(probability)", "what cannot happen is no fault")]
    disables: OptionalComponent = None
    description: Text | None = None

    @model_validator(mode="after")
    def _fits(self) -> Fault:
        in_order(self.low, self.high, "low and high")
        if not self.low <= self.nominal <= self.high:
            allowed = f"{self.low:g} to {self.high:g} {self.severity_unit}, its low and high"
            message = f"nominal {self.nominal:g} is outside {allowed}; correct one of them"
            raise CellError(Code.SEVERITY_OUTSIDE_RANGE, message)
        return self


class Feature(Row):
    """What monitoring computes."""

    id: Name
    accumulation: OptionalTerm = None
    expression: Term
    window_s: Wait
    filter_s: Wait
    unit: Text
    component: Component
    description: Text

    @model_validator(mode="after")
    def _fits(self) -> Feature:
        if (self.accumulation is not None) != (self.window_s > 0.0):
            message = (
                f"window_s is {self.window_s:g} s; a balance has an accumulation and a window, others have neither"
            )
            raise CellError(Code.BAD_TABLE, message)
        return self


class Symptom(Row):
    """When a feature counts as a symptom."""

    id: Name
    feature: Annotated[str, Refers("feature")]
    direction: Annotated[str, words_of(Direction)]
    sigma: Annotated[float, number(SMALL, 100.0, "standard deviations", "more is never seen")]
    deadband: Size
    on_delay_s: Wait
    description: Text


class SymptomFault(Row):
    """A fault that a symptom indicates."""

    symptom: Annotated[str, Refers("symptom")]
    fault: Annotated[str, Refers("fault")]
