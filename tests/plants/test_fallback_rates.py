"""Fallbacks at rates of their own take as long as these say and as the twin predicts; a lead ends the time left."""

from __future__ import annotations

import math

import numpy as np
import pytest

from homeostat.domain.recovery import Command, FallbackStrategy
from homeostat.domain.snapshot import Trajectory
from homeostat.domain.verdict import Rollout, RolloutResult
from homeostat.evaluate.reference.unsupervised import fault_free, open_process
from homeostat.evaluate.scenario import departing, scenario
from homeostat.links.simulated import SimulatedLink
from homeostat.plants.plant import Plant, load_plant
from homeostat.recovery.deadline import first_violated_s
from homeostat.twin.twin import Twin

RUNNING = {
    "cstr": (Command("F1.sp", 0.0333, None), Command("XV1.cmd", 1.0, None), Command("V2.man", 0.3, None)),
    "mixing_module": (Command("P101.cmd", 0.9, None), Command("VI204.cmd", 1.0, None), Command("VO201.cmd", 1.0, None)),
}
"""Plant -> what it is told before the fallback acts."""
SEEN_S = 60
STRATEGIES = [(name, s.name) for name in RUNNING for s in load_plant(name).description.fallback_strategies]


def strategy(plant: Plant, name: str) -> FallbackStrategy:
    return next(s for s in plant.description.fallback_strategies if s.name == name)


def needed_s(process_held: dict[str, float], acts: FallbackStrategy) -> float:
    """How long the rates of a strategy say that its ramps take [s]."""
    ways = [(c.value, process_held[c.tag], c.rate) for c in acts.actions.commands if c.value is not None and c.rate]
    return max((math.ceil(round(abs(to - held) / rate, 9)) for to, held, rate in ways), default=1.0)


@pytest.mark.parametrize(("name", "by"), STRATEGIES)
def test_what_is_carried_out_is_what_the_twin_predicts_and_takes_as_long_as_the_rates_say(name: str, by: str) -> None:
    plant = load_plant(name)
    process, twin = open_process(plant, scenario(plant, "none", 1)), Twin(plant.model, plant.description, plant.twin, 0)
    link, acts = SimulatedLink(process), strategy(plant, by)
    process.command(RUNNING[name])
    for _ in range(SEEN_S):
        twin.observe(link.advance())
    held = {tag: 0.0 if value is None else value for tag, value in process.accepted.items()}
    (predicted,) = twin.schedules([acts.actions], 120)
    process.command(acts.actions.commands)
    for _ in range(120):
        link.advance()
    truth, variables = process.truth().signals, plant.description.variables
    took = 0
    for c in acts.actions.commands:
        column = plant.model.inputs.index(variables[c.tag])
        carried_out = np.asarray(truth[c.tag])[0, SEEN_S:]
        assert np.allclose(carried_out, predicted[:, column], rtol=0.0, atol=1e-12), c.tag
        took = max(
            took, 1 + int(np.flatnonzero(carried_out != c.value)[-1] + 1 if (carried_out != c.value).any() else 0)
        )
    assert took - 1 <= needed_s(held, acts) <= 80


def test_the_reactor_stops_its_feed_within_seconds() -> None:
    plant = load_plant("cstr")
    tags, writables = plant.description.tags_by_name, plant.description.writables
    for acts in plant.description.fallback_strategies:
        for c in acts.actions.commands:
            permitted, ordinary = writables[c.tag].fastest, tags[c.tag].rate_limit
            assert c.rate is not None and ordinary is not None
            assert c.rate == (ordinary if permitted is None else permitted)
            if c.tag in ("F1.sp", "XV1.cmd"):
                assert tags[c.tag].range.span / c.rate <= 1.0


def test_the_time_left_ends_where_the_guard_trips() -> None:
    plant = load_plant("mixing_module")
    limit = next(x for x in plant.description.limits.hard if x.name == "LIM-P101-IDLE")
    values = {tag: np.zeros((1, 40)) for x in plant.description.limits.hard for tag in x.formula.tags}
    idle = Rollout(
        "", Trajectory(0.0, 1.0, values | {"P101.idle": np.arange(40.0)[None]}), (), (1.0,), RolloutResult.COMPLETED
    )
    assert limit.lead == 5.0 and limit.formula.text == "P101.idle <= 20"
    assert first_violated_s(idle, plant.description.limits) == 16.0


@pytest.mark.parametrize("mismatch", ["none", "plant", "twice"])
def test_no_ordinary_batch_comes_near_the_trip_of_an_idle_pump(mismatch: str) -> None:
    plant = load_plant("mixing_module")
    for seed in range(501, 506):
        truth = fault_free(plant, departing(plant, scenario(plant, "none", seed), (), mismatch)).truth.signals
        for limit in plant.description.limits.hard:
            if limit.lead:
                assert limit.watched.margins(truth, 1.0).min() >= 10.0, (limit.name, seed)
