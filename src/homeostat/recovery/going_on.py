"""Going on: a stop is tried only where a batch can be brought to its end from there, and ends where it began."""

from homeostat.agents.certificates import violated
from homeostat.domain.plant.limits import Limits
from homeostat.domain.recovery import RecoveryPath
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Rollout


def way_on(path: RecoveryPath | None, now: Snapshot) -> RecoveryPath | None:
    """The way that leads from where ``path`` stops back to the state that it leaves; None where it is no such stop."""
    if path is None or not path.awaited or path.target in path.machine.ordinary:
        return None
    return path.way_back(now.values)


def comes_to_its_end(rollout: Rollout, limits: Limits) -> bool:
    """Whether every member that violates no hard limit takes every step in time, and there is one."""
    if not rollout.weights:
        return False
    kept = ~violated(rollout, limits.hard)
    left = [steps for steps, keeps in zip(rollout.steps_left, kept, strict=True) if keeps]
    return bool(left) and max(left) == 0
