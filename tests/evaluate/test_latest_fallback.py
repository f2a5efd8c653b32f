"""How late a fallback could have acted, on batches of which that is known."""

from __future__ import annotations

import pytest

from benchmarks.latest_fallback import latest_fallback
from homeostat.evaluate.scenario import scenario
from homeostat.plants.plant import load_plant


@pytest.mark.parametrize(("severity", "least_s", "most_s"), [(1.0, 1, 8), (0.2, 8, 60)])
def test_an_inlet_that_does_not_close_leaves_as_long_as_its_flow_needs_to_fill_the_tank(
    severity: float, least_s: int, most_s: int
) -> None:
    """A full tank stands 15 mm below its brim: 0.2 L, at 0.07 L/s and more time for a smaller flow."""
    plant = load_plant("mixing_module")
    found = latest_fallback(plant, scenario(plant, "stuck_open_VI201", 3, 45.0, severity, 250.0))
    assert found is not None and least_s <= found <= most_s


def test_a_fault_that_harms_nothing_leaves_all_the_time_that_is_looked_at() -> None:
    plant = load_plant("mixing_module")
    assert latest_fallback(plant, scenario(plant, "sensor_bias_flow", 3, 60.0, -0.15, 250.0), longest_s=3) == 3
