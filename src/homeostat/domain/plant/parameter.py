"""Physical parameters with their uncertainty, as the engineering tables state them."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ModelParameter:
    """One parameter of the process model."""

    symbol: str
    """Name in the process model."""
    value: float
    """Best estimate in ``unit``."""
    unit: str
    """Unit."""
    sd: float
    """Standard deviation of the true value around ``value``, in ``unit`` (relative spreads are already converted)."""
    component: str
    """Component it belongs to."""
    description: str
    """What it is."""
