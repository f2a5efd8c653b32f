"""Going on after a stop: only from where the plant may, back to what it left, and to its end where limits are kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from homeostat.agents.search.candidates import along_by_design
from homeostat.domain.recovery import RecoveryPath
from homeostat.domain.snapshot import Snapshot
from homeostat.plants.plant import load_plant
from homeostat.recovery.going_on import comes_to_its_end, way_on
from tests.recovery.desk import ticks
from tests.recovery.line import LIMITS, LineTwin, feed

MODULE = load_plant("mixing_module").description


def seen(hot: float) -> Snapshot:
    (tick,) = ticks(1, 1, hot)
    assert tick.sample is not None
    return tick.sample


def now(**values: float) -> Snapshot:
    given = {name.replace("_", ".", 1): value for name, value in values.items()}
    return Snapshot(60.0, {tag: 0.0 for tag in MODULE.tags_by_name} | given)


def path(state: str, target: str, at: Snapshot) -> RecoveryPath:
    ways = MODULE.machine.paths(state, at.values, MODULE.machine.recovery_event, blocked=())
    return next(found for way in ways if (found := RecoveryPath(MODULE.machine, way)).target == target)


def test_a_stop_leads_back_to_the_state_that_it_leaves() -> None:
    at = now(B201_level=0.2)
    back = way_on(path("filling_B202", "held", at), at)
    assert back is not None and back.states[:2] == ("held", "filling_B202") and back.target == "complete"
    actions = along_by_design(back, MODULE.tags_by_name)
    assert {c.tag: c.value for c in actions.commands}["VI202.cmd"] == 1.0 and actions.end == "complete"


def test_there_is_no_way_back_where_its_guard_does_not_hold_or_nothing_was_stopped() -> None:
    full, empty = now(B201_level=0.2), now()
    assert way_on(path("filling_B202", "held", empty), empty) is None
    assert way_on(path("filling_B202", "complete", full), full) is None and way_on(None, full) is None


@pytest.mark.parametrize(
    ("hot", "steps", "ends"),
    [(300.0, (0, 0), True), (300.0, (0, 1), False), (320.0, (0, 0), False), (312.9, (3, 0), False)],
)
def test_it_comes_to_its_end_where_every_member_that_keeps_the_limits_does(
    hot: float, steps: tuple[int, int], ends: bool
) -> None:
    twin = LineTwin(heating=0.0)
    twin.observe(seen(hot))
    rollout = replace(twin.roll_out(feed(0.02, "reduced"), ()), steps_left=steps)
    assert comes_to_its_end(rollout, LIMITS) is ends


def test_what_violates_a_limit_need_not_come_to_any_end() -> None:
    twin = LineTwin(heating=0.0)
    twin.observe(seen(312.0))
    rollout = twin.roll_out(feed(0.02, "reduced"), ())
    signals = dict(rollout.trajectory.signals)
    signals["T"] = np.stack([signals["T"][0], np.full_like(signals["T"][1], 330.0)])
    hotter = replace(rollout, trajectory=replace(rollout.trajectory, signals=signals))
    assert comes_to_its_end(replace(hotter, steps_left=(0, 4)), LIMITS)
    assert not comes_to_its_end(replace(hotter, steps_left=(1, 0)), LIMITS)
