"""Fitted growth, and a decision on a small site."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.scale.decisions import decide
from benchmarks.scale.growth import growth
from benchmarks.scale.plant_graph import KINDS, load_site
from benchmarks.scale.study import chosen
from homeostat.plants.plant import load_plant

pytestmark = pytest.mark.filterwarnings("ignore:open_binary is deprecated:DeprecationWarning")  # on counting tokens


def test_a_power_law_is_found_and_a_constant_is_flat() -> None:
    sizes = (1, 10, 100, 1000)
    assert growth(sizes, [3.0 * n**0.5 for n in sizes], [""] * 4).exponent == pytest.approx(0.5)
    flat = growth(sizes, [7.0] * 4, [""] * 4)
    assert abs(flat.exponent) < 1e-12 and flat.half_width < 1e-12


def test_what_sets_series_apart_is_no_growth() -> None:
    sizes = (1, 10, 100, 10, 100, 1000)
    values = (1.0, 1.0, 1.0, 50.0, 50.0, 50.0)
    assert abs(growth(sizes, values, "aaabbb").exponent) < 1e-12


def test_the_interval_is_that_of_a_regression() -> None:
    generator = np.random.default_rng(1)
    sizes = np.repeat([1, 10, 100, 1000], 10)
    values = np.exp(0.3 * np.log(sizes) + generator.normal(0.0, 0.2, sizes.size))
    found = growth(sizes.tolist(), values.tolist(), [""] * sizes.size)
    assert abs(found.exponent - 0.3) < found.half_width < 0.05


def test_one_size_tells_no_slope() -> None:
    with pytest.raises(ValueError, match="measure more sizes"):
        growth((3, 3), (1.0, 2.0), "aa")


def test_modules_are_drawn_from_those_of_the_case() -> None:
    assert chosen(1, "cstr", "mixing_module", 3) == ()
    assert chosen(1, "cstr", "cstr", 3) == (1, 1, 1)
    drawn = chosen(100, "cstr", "mixing_module", 3)
    assert len(set(drawn)) == 3 and all(k % 2 == 0 for k in drawn) and drawn == chosen(100, "cstr", "mixing_module", 3)


def test_a_fault_on_a_site_is_recovered_by_the_module_s_own_supervisor() -> None:
    cases = {kind: load_plant(kind) for kind in KINDS}
    found = decide(cases, load_site(2), 2, 1, "pump_failure", 1, end_s=150.0)
    assert found.good and found.actor == "search" and found.kind == "mixing_module"
    assert found.planning_tokens > 500 and found.action_tokens > 500
    assert found.question_worst_ms > 0.0 and math.isfinite(found.latency_s)
