"""Going on: a stop is tried only where a batch can be brought to its end from there, and ends where it began."""

from homeostat.agents.certificates import violated
from homeostat.agents.checks import Tags
from homeostat.agents.search.candidates import design_commands
from homeostat.domain.plant.limits import Limits
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Rollout


def way_on(path: RecoveryPath | None, now: Snapshot) -> RecoveryPath | None:
    """The way that leads from where ``path`` stops back to the state that it leaves; None where it is no such stop."""
    if path is None or not path.awaited or path.target in path.machine.ordinary:
        return None
    ways = path.machine.paths(path.target, now.values, path.decisions[0].event, blocked=())
    back = [way for way in ways if way[0].target == path.states[0]]
    return RecoveryPath(path.machine, back[0]) if back else None


def by_design(way: RecoveryPath, tags: Tags) -> ActionSet:
    """What is commanded along ``way``."""
    return ActionSet.along(way, lambda state: design_commands(state, tags))


def comes_to_its_end(rollout: Rollout, limits: Limits) -> bool:
    """Whether every member that violates no hard limit takes every step in time, and there is one."""
    if not rollout.weights:
        return False
    kept = ~violated(rollout, limits.hard)
    left = [steps for steps, keeps in zip(rollout.steps_left, kept, strict=True) if keeps]
    return bool(left) and max(left) == 0
