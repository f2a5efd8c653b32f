"""Rows about what can go wrong and how it shows; the guide to plants says what they mean."""

from typing import Annotated, Self

from pydantic import model_validator

from homeostat.domain.diagnosis import Direction
from homeostat.knowledge.build.tables import cells
from homeostat.knowledge.store.error import Code


class Fault(cells.TableRow):
    """A fault mode."""

    id: cells.Name
    label: cells.Text
    component: cells.Component
    severity_unit: cells.Text
    nominal: cells.Value
    low: cells.Value
    high: cells.Value
    prior: Annotated[float, cells.number(cells.SMALL, 1.0, "(probability)", "what cannot happen is no fault")]
    disables: cells.OptionalComponent = None
    description: cells.Text | None = None
    mode: cells.Name | None = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        cells.in_order(self.low, self.high, "low and high")
        if not self.low <= self.nominal <= self.high:
            allowed = f"{self.low:g} to {self.high:g} {self.severity_unit}, its low and high"
            message = f"nominal {self.nominal:g} is outside {allowed}; correct one of them"
            raise cells.CellError(Code.SEVERITY_OUTSIDE_RANGE, message)
        return self


class Feature(cells.TableRow):
    """What monitoring computes."""

    id: cells.Name
    accumulation: cells.OptionalTerm = None
    expression: cells.Term
    window_s: cells.Wait
    filter_s: cells.Wait
    unit: cells.Text
    component: cells.Component
    description: cells.Text

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if (self.accumulation is not None) != (self.window_s > 0.0):
            message = (
                f"window_s is {self.window_s:g} s; a balance has an accumulation and a window, others have neither"
            )
            raise cells.CellError(Code.BAD_TABLE, message)
        return self


class Symptom(cells.TableRow):
    """When a feature counts as a symptom."""

    id: cells.Name
    feature: Annotated[str, cells.Refers("feature")]
    direction: Annotated[str, cells.words_of(Direction)]
    sigma: Annotated[float, cells.number(cells.SMALL, 100.0, "standard deviations", "more is never seen")]
    threshold: cells.Size
    on_delay_s: cells.Wait
    description: cells.Text


class SymptomFault(cells.TableRow):
    """A fault that a symptom indicates."""

    symptom: Annotated[str, cells.Refers("symptom")]
    fault: Annotated[str, cells.Refers("fault")]
