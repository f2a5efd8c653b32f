"""Seconds without flow: what the drives count by the flow meter, and what counts as dry or dead head in truth."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plants.mixing_module.module import NOMINAL, Run, batch, inputs, parameters, run, start, timed

GRACE = 15.0
P = parameters(grace=GRACE, flow_least=0.01, tau_pump=1.0, travel=1.5)
SUCTION = {"VO1": 1.0, "VI4": 1.0}


def counted(
    u: dict[str, float], steps: int = 60, faults: dict[str, tuple[float, float]] | None = None, **levels
) -> Run:
    """Commands from rest on."""
    return run(batch(steps, p=P, x=start(P, **levels), u=inputs(**u), faults=faults))


def test_a_pump_that_delivers_counts_nothing() -> None:
    """Its speed passes 0.1 and its flow 0.01 L/s within the first seconds."""
    for pump, idle in (("P1", "idle1"), ("P2", "idle2")):
        result = counted(SUCTION | {pump: 0.9}, steps=20, B201=0.2)
        assert result.of(idle).max() <= 2.0 and result.of(idle)[5:].max() == 0.0
        assert result.of("dry_s")[-1] == result.of("dead_head_s")[-1] == 0.0


def test_a_pump_at_an_empty_tank_runs_dry() -> None:
    """Counted from the first second in which it runs without flow; what goes beyond 15 s is damage."""
    result = counted(SUCTION | {"P1": 0.9}, B201=0.0)
    t = np.arange(1, 61)
    assert np.array_equal(result.of("idle1"), t) and np.array_equal(result.of("no_flow1"), t)
    assert np.array_equal(result.of("dry_s"), np.maximum(t - GRACE, 0.0))
    assert result.of("dead_head_s")[-1] == 0.0 and result.of("idle2").max() == 0.0


def test_a_tank_that_runs_empty_is_run_dry_after_it() -> None:
    result = counted(SUCTION | {"P1": 0.9}, B201=0.1)
    began = 5 + int(np.argmax(result.of("q_main")[5:] < 0.01))
    assert 5 < began < 30 and result.of("L1")[began] < NOMINAL["dry_level"]
    assert int(np.argmax(result.of("dry_s") > 0.0)) == began + int(GRACE)
    assert result.of("dead_head_s")[-1] == 0.0


def test_a_pump_with_every_outlet_closed_runs_dry_too() -> None:
    result = counted({"VI4": 1.0, "P2": 0.9}, B201=0.2)
    assert result.of("dry_s")[-1] == 60.0 - GRACE and result.of("dead_head_s")[-1] == 0.0


@pytest.mark.parametrize("level", [0.02, 0.2])
@pytest.mark.parametrize(("pump", "idle"), [("P1", "idle1"), ("P2", "idle2")])
def test_a_pump_against_a_closed_valve_is_dead_headed(pump: str, idle: str, level: float) -> None:
    """Also where the tank is nearly empty: as long as it stands above the outlet, the pump is wet."""
    result = counted({"VO1": 1.0, pump: 0.9}, B201=level)
    t = np.arange(1, 61)
    assert np.array_equal(result.of(idle), t)
    assert np.array_equal(result.of("dead_head_s"), np.maximum(t - GRACE, 0.0))
    assert result.of("dry_s")[-1] == 0.0


def test_a_stuck_valve_and_a_plugged_line_dead_head_too() -> None:
    for fault in ("stuck_closed_VI204", "clogging_common", "clogging_main"):
        result = counted(SUCTION | {"P1": 0.9}, B201=0.2, faults={fault: (1.0, 0.0)})
        assert result.of("dead_head_s")[-1] > 40.0 and result.of("dry_s")[-1] == 0.0, fault


def test_a_weak_pump_beside_a_strong_one_is_dead_headed_and_its_drive_knows() -> None:
    """A drive looks at the load of its own motor, not at what the other pump gives."""
    result = counted(SUCTION | {"VO2": 1.0, "VO3": 1.0, "P1": 1.0, "P2": 0.3}, steps=30, B201=0.2, B202=0.2, B203=0.2)
    assert result.of("q_bypass")[-1] < 0.01 < result.of("q_main")[-1]
    assert result.of("no_flow2")[-1] > GRACE and result.of("idle2")[-1] == result.of("no_flow2")[-1]
    assert result.of("dead_head_s")[-1] == result.of("no_flow2")[-1] - GRACE and result.of("dry_s")[-1] == 0.0


def test_two_pumps_that_run_dry_count_twice() -> None:
    """Pump seconds, not seconds."""
    result = counted(SUCTION | {"P1": 0.9, "P2": 0.9}, B201=0.0)
    assert result.of("dry_s")[-1] == 2.0 * (60.0 - GRACE)


def test_a_stop_and_a_start_begin_the_grace_period_anew() -> None:
    """Twice 12 s without flow, with a stop of 6 s in which the speed falls below 0.1: no damage."""
    on = {"VO1": 1.0, "P1": 0.9}
    u = timed(40, (0, on), (12, {"VO1": 1.0}), (18, on), (30, {"VO1": 1.0}))
    result = run(batch(40, p=P, x=start(P, B201=0.2), u=u))
    assert 12.0 <= result.of("idle1").max() <= GRACE and result.of("idle1")[-1] == 0.0
    assert result.of("dead_head_s")[-1] == 0.0


def test_a_pump_that_is_barely_turning_is_not_running() -> None:
    assert counted({"VO1": 1.0, "P1": 0.09}, B201=0.2).of("no_flow1").max() == 0.0


def test_what_the_drive_counts_is_true_whatever_the_flow_meter_shows() -> None:
    """A meter stuck at a flow hides no dead head; one stuck at nothing stops no pump that delivers."""
    u = timed(60, (0, SUCTION | {"P1": 0.9}), (10, {"VO1": 1.0, "P1": 0.9}))
    hidden = run(batch(60, p=P, x=start(P, B201=0.2), u=u, faults={"sensor_stuck_flow": (1.0, 8.0)}))
    assert hidden.of("idle1")[-1] > 45.0 and hidden.of("dead_head_s")[-1] > 25.0
    x = start(P, B201=0.2, B202=0.2, B203=0.2)
    u = inputs(VO1=1.0, VO2=1.0, VO3=1.0, VI4=1.0, P1=0.9)
    calm = run(batch(30, p=P, x=x, u=u, faults={"sensor_stuck_flow": (1.0, 0.0)}))
    assert calm.of("idle1")[5:].max() == calm.of("no_flow1")[5:].max() == 0.0


def test_a_pump_that_feeds_a_leak_is_not_idle() -> None:
    """VI204 closed: what P101 gives goes to the tray; P101 itself has flow."""
    u = {"VO1": 1.0, "VO2": 1.0, "VO3": 1.0, "P1": 0.9}
    result = counted(u, steps=40, B201=0.2, B202=0.2, B203=0.2, faults={"leakage_main": (1.0, 0.0)})
    assert result.of("q_leak")[-1] > 0.05 and result.of("idle1")[5:].max() == 0.0
    assert result.of("no_flow1")[5:].max() == 0.0
