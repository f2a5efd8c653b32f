"""What a picture is drawn from: a run, its plant and its ground truth, whoever has them."""

from collections.abc import Sequence
from typing import Protocol

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.disturbance import Disturbance
from homeostat.domain.outcome import Outcome
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.snapshot import Trajectory
from homeostat.record.figure.panel import Panel
from homeostat.record.run_record import RunRecord


class ShownPlant(Protocol):
    """A plant, as far as its picture asks for it."""

    @property
    def name(self) -> str:
        """Its name."""
        ...

    @property
    def description(self) -> PlantDescription:
        """What its graph says."""
        ...

    @property
    def panels(self) -> Sequence[Panel]:
        """The panels of its picture, from the top."""
        ...


class GroundTruth(Protocol):
    """What was truly wrong."""

    @property
    def faults(self) -> Sequence[FaultState]:
        """The faults; none where nothing was wrong."""
        ...

    @property
    def disturbances(self) -> Sequence[Disturbance]:
        """What else happened to the true plant."""
        ...

    @property
    def onset_s(self) -> float | None:
        """When the first one began [s]; None where there was none."""
        ...

    @property
    def end_s(self) -> float:
        """When the run ended [s]."""
        ...

    @property
    def seed(self) -> int:
        """Seed of the run."""
        ...


class ShownRun(Protocol):
    """A run that has ended, as far as its picture asks for it."""

    @property
    def plant(self) -> ShownPlant:
        """The plant."""
        ...

    @property
    def scenario(self) -> GroundTruth:
        """What was truly wrong."""
        ...

    @property
    def record(self) -> RunRecord:
        """Everything that happened."""
        ...

    @property
    def truth(self) -> Trajectory:
        """True values."""
        ...

    @property
    def measured(self) -> Trajectory:
        """What the instruments said, at the same times."""
        ...

    @property
    def outcome(self) -> Outcome:
        """How it ended."""
        ...

    @property
    def state(self) -> str:
        """The state at its end."""
        ...

    @property
    def detected_s(self) -> float | None:
        """When something was first reported [s]."""
        ...

    @property
    def complete_s(self) -> float | None:
        """When the batch was complete [s]."""
        ...

    @property
    def nominal_s(self) -> float | None:
        """The same without the fault [s]."""
        ...
