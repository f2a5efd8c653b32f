"""What a plant does to products, energy and information (VDI 3682): process operators, and what flows between them."""

from dataclasses import dataclass
from enum import StrEnum


class FlowKind(StrEnum):
    """What flows (VDI 3682)."""

    PRODUCT = "Product"
    ENERGY = "Energy"
    INFORMATION = "Information"


@dataclass(frozen=True, slots=True)
class Flow:
    """A product, energy or information that operators turn into another."""

    name: str
    """Identifier."""
    label: str
    """In the engineer's words; empty where there are none."""
    kind: FlowKind
    """What it is."""
    tag: str | None
    """Tag on which it can be read; None where it is not measured."""


@dataclass(frozen=True, slots=True)
class ProcessOperator:
    """One step of the process."""

    name: str
    """Identifier."""
    label: str
    """In the engineer's words; empty where there are none."""
    resource: str
    """Component that carries it out."""
    inputs: tuple[str, ...]
    """Names of the flows that it takes, sorted."""
    outputs: tuple[str, ...]
    """Names of the flows that it gives, sorted."""


@dataclass(frozen=True, slots=True)
class Flowsheet:
    """The process as operators and flows, each sorted by name."""

    operators: tuple[ProcessOperator, ...]
    """The operators."""
    flows: tuple[Flow, ...]
    """What flows; every name in an operator's inputs and outputs is among them."""
