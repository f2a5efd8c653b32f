"""The physics of a site: one module as the case alone, headers, and what neighbours do to each other."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.scale.coupling import draw, heat, impose
from benchmarks.scale.headers import DESIGN_DUTY, DESIGN_T, SINK_T, flow_factor, supply_temperature
from benchmarks.scale.plant_graph import KINDS, kind_of
from benchmarks.scale.site import BLOCK_S, Site
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import Scenario, scenario
from homeostat.plants.mixing_module.layout import P as MIXER
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import new_sequencer
from tests.plants.cstr.reactor import P, S


@pytest.fixture(scope="module")
def cases() -> dict[str, Plant]:
    return {kind: load_plant(kind) for kind in KINDS}


def alone(plant: Plant, chosen: Scenario, site: Site | None = None) -> Trajectory:
    """True values of a scenario in which nobody acts, within ``site`` where one is given."""
    around = plant if site is None else replace(plant, model=site.join(plant.model))
    return watch(open_process(around, chosen), new_sequencer(plant).sample).truth()


@pytest.mark.parametrize(("kind", "end_s", "column", "variable"), [
    ("cstr", 800, S.T, "T1"), ("cstr", 800, S.V, "L1"), ("mixing_module", 225, 4, "L_B201"),
])  # fmt: skip
def test_an_uncoupled_site_of_one_module_is_the_case(
    cases: dict[str, Plant], kind: str, end_s: int, column: int, variable: str
) -> None:
    plant = cases[kind]
    truth = alone(plant, scenario(plant, "none", 7, end_s=float(end_s)))
    signal = truth.signals[variable] if variable in truth.signals else truth.signals[_tag(plant, variable)]
    site, found = Site(cases, [kind], [7], coupled=False), []
    for _ in range(end_s // BLOCK_S):
        site.run(BLOCK_S)
        found.append(site.fleets[0].state[0, column])
    np.testing.assert_array_equal(found, signal[0, BLOCK_S - 1 :: BLOCK_S])


def _tag(plant: Plant, variable: str) -> str:
    return next(tag for tag, name in plant.description.variables.items() if name == variable)


@pytest.mark.parametrize("coupled", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_the_live_module_is_simulated_as_its_neighbours_are(cases: dict[str, Plant], kind: str, coupled: bool) -> None:
    """A module under its own plant goes the way that it goes as a member of the batch."""
    kinds, seeds, end_s = list(KINDS), (1, 2), 200
    number = kinds.index(kind) + 1
    plant, site = cases[kind], Site(cases, kinds, seeds, number, coupled)
    truth = alone(plant, scenario(plant, "none", seeds[number - 1], end_s=float(end_s)), site)
    whole = Site(cases, kinds, seeds, coupled=coupled)
    whole.run(end_s)
    fleet = next(f for f in whole.fleets if f.case.name == kind)
    column, variable = (S.T, "T1") if kind == "cstr" else (4, "L_B201")
    assert site.now_s == end_s - BLOCK_S
    assert truth.signals[_tag(plant, variable)][0, -1] == pytest.approx(fleet.state[0, column], abs=1e-9)


def test_a_circuit_follows_its_heat() -> None:
    reactors = np.array([5.0, 5.0, 5.0, 0.0])
    load = np.array([5 * DESIGN_DUTY, 4 * DESIGN_DUTY, 6 * DESIGN_DUTY, 0.0])
    after = supply_temperature(np.full(4, DESIGN_T), load, reactors, 1e6)
    np.testing.assert_allclose(after, [290.0, 290.0 - 0.5573, 290.0 + 0.5573, 290.0], atol=1e-9)
    assert pytest.approx(290.0 - 2.7865) == SINK_T


def test_a_circuit_approaches_with_its_time_constant() -> None:
    five_minutes = supply_temperature(np.array([290.0]), np.zeros(1), np.ones(1), 627_000.0 / 2000.0)
    assert five_minutes[0] == pytest.approx(SINK_T + (290.0 - SINK_T) / math.e)


def test_a_main_gives_less_the_more_is_drawn() -> None:
    factor = flow_factor(np.array([0.0, 0.5, 1.0, 9.0]), np.ones(4))
    np.testing.assert_allclose(factor, np.sqrt([1.0, 0.99, 0.96, 0.84]))


def test_more_heat_on_a_header_warms_the_neighbours_supply(cases: dict[str, Plant]) -> None:
    """A reactor with a hotter feed heats the water of its neighbours, and of no reactor elsewhere."""
    kinds = [kind_of(k) for k in range(1, 13)]
    calm, busy = (Site(cases, kinds, range(1, 13)) for _ in range(2))
    reactors = next(f for f in busy.fleets if f.case.name == "cstr")
    reactors.own[0, P.T_feed] += 30.0
    reactors.parameters[0, P.T_feed] += 30.0
    for site in (calm, busy):
        site.run(600)
    assert busy.supply_t[0] > calm.supply_t[0] + 0.1
    assert busy.supply_t[1] == calm.supply_t[1]
    before, after = (
        next(f for f in s.fleets if f.case.name == "cstr").parameters[:, P.T_coolant] for s in (calm, busy)
    )
    warmer = after - before
    assert (warmer[:5] > 0.1).all() and warmer[5] == 0.0


def test_what_others_draw_slows_a_filling_down(cases: dict[str, Plant]) -> None:
    one, many = Site(cases, KINDS[:1], [1]), Site(cases, [KINDS[0]] * 10, [1] * 10)
    for site in (one, many):
        site.run(20)
    assert many.factor[0] > one.factor[0], "batches begin one after the other: one in ten draws a tenth of the design"
    parameters, own = np.ones((1, len(MIXER))), np.ones((1, len(MIXER)))
    impose("mixing_module", parameters, own, np.zeros(1), np.array([0.98]))
    assert parameters[0, MIXER.fill_rate] == 0.98 and np.delete(parameters[0], MIXER.fill_rate).all() == 1.0


def test_loads_are_those_of_the_states(cases: dict[str, Plant]) -> None:
    model = cases["cstr"].model
    states, parameters = np.zeros((1, len(S))), np.zeros((1, len(model.parameters)))
    states[0, [S.UA, S.V2_position, S.T, S.F1_true]] = 500.0, 0.5, 310.0, 1 / 30
    parameters[0, P.T_coolant] = 290.0
    assert heat("cstr", states, parameters) == [5000.0] and draw("cstr", states) == [1 / 30]
    assert heat("mixing_module", states, parameters) == [0.0]


def test_a_site_runs_the_same_way_twice(cases: dict[str, Plant]) -> None:
    kinds = [kind_of(k) for k in range(1, 6)]
    first, second = (Site(cases, kinds, range(1, 6)) for _ in range(2))
    for site in (first, second):
        site.run(100)
    for one, other in zip(first.fleets, second.fleets, strict=True):
        np.testing.assert_array_equal(one.state, other.state)


def test_batches_follow_each_other(cases: dict[str, Plant]) -> None:
    site = Site(cases, KINDS[:1], [1])
    site.run(600)
    delivered = cases["mixing_module"].model.states.index("delivered")
    assert site.fleets[0].state[0, delivered] > 1.5 * 7.0, "two batches of about 8 L each"
