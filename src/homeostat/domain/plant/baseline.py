"""Reference values of features, learned from fault-free operation (DIN ISO 17359)."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Baseline:
    """What one feature looks like while plants of this design are healthy."""

    feature: str
    """Name of the feature."""
    mean: float
    """Mean over all runs, in the feature's unit."""
    within_sd: float
    """Standard deviation within a run around that run's own mean."""
    between_sd: float
    """Standard deviation of the runs' means: plants of one design differ."""
    p01: float
    """First percentile of all samples."""
    p05: float
    """Fifth percentile."""
    p50: float
    """Median."""
    p95: float
    """Ninety-fifth percentile."""
    p99: float
    """Ninety-ninth percentile."""
