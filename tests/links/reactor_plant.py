"""The reactor as a simulated plant."""

from __future__ import annotations

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.ports import Clock
from homeostat.domain.snapshot import Snapshot
from homeostat.links.clock import DeclaredClock
from homeostat.links.simulated import PlantConfiguration, SimulatedPlant
from tests.cases.cstr import reactor
from tests.cases.cstr.reactor import MODEL, VARIABLES
from tests.contracts.link import equal


def plant(
    end_s: float = 600.0, seed: int = 3, clock: Clock | None = None, faults: tuple[FaultState, ...] = (),
    noise: float = 1.0, **changes: float,
) -> SimulatedPlant:  # fmt: skip
    """A reactor at its start."""
    configuration = PlantConfiguration(reactor.parameters(**changes), reactor.inputs(), faults, end_s, seed, noise)
    return SimulatedPlant(MODEL, VARIABLES, configuration, clock or DeclaredClock(0.0))


async def everything(subject: SimulatedPlant) -> list[Snapshot]:
    """Every snapshot until the end of the run."""
    return [s async for s in subject.snapshots()]


def same(a: list[Snapshot], b: list[Snapshot]) -> bool:
    """The same times and values, bit for bit."""
    return len(a) == len(b) and all(
        x.at_s == y.at_s
        and x.values.keys() == y.values.keys()
        and all(equal(v, y.values[n]) for n, v in x.values.items())
        for x, y in zip(a, b, strict=True)
    )
