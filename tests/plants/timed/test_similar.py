"""A plant that is slower, and sampled as much more seldom, is the same plant: tick by tick, whatever a second is."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from homeostat.evaluate.scenario import scenario
from homeostat.evaluate.trial import Trial, try_out
from homeostat.plants.plant import Plant, load_plant
from tests.plants.timed.stretched import Stretched

EXACT = (64.0, 0.125)
"""Powers of two: a number times one of them is not rounded."""


@pytest.fixture(scope="module")
def plants(tmp_path_factory: pytest.TempPathFactory) -> Mapping[float, Plant]:
    """Stretch -> the two tanks, before anything is learned."""
    made = {s: Stretched.of(s, tmp_path_factory.mktemp("tanks")) for s in (1.0, *EXACT)}
    return {s: load_plant(str(each.folder), learned=False) for s, each in made.items()}


@pytest.fixture(scope="module")
def trials(plants: Mapping[float, Plant]) -> Mapping[float, Trial]:
    """The same run of each with a fault that nobody answers."""
    return {s: try_out(plant, scenario(plant, "P2_weak", 3)) for s, plant in plants.items()}


@pytest.mark.slow
@pytest.mark.parametrize("stretch", EXACT)
def test_every_tick_is_the_same_to_the_bit(trials: Mapping[float, Trial], stretch: float) -> None:
    usual, own = trials[1.0].truth, trials[stretch].truth
    assert own.dt_s == stretch
    assert own.times_s.tolist() == (usual.times_s * stretch).tolist()
    for tag in ("L1", "L2", "T1", "T2", "H1.pos", "P2.pos"):
        assert np.array_equal(own.signals[tag], usual.signals[tag]), tag
    for tag in ("F1", "F2", "F3"):
        assert np.array_equal(own.signals[tag] * stretch, usual.signals[tag]), tag


@pytest.mark.parametrize("stretch", EXACT)
def test_states_are_entered_at_the_same_tick(trials: Mapping[float, Trial], stretch: float) -> None:
    usual = [(state, at_s * stretch) for state, at_s in trials[1.0].record.states]
    assert trials[stretch].record.states == usual and usual


@pytest.mark.parametrize("stretch", EXACT)
def test_what_nobody_states_is_as_much_longer(plants: Mapping[float, Plant], stretch: float) -> None:
    usual, own = plants[1.0], plants[stretch]
    for name in ("lead_s", "replay_s", "recent_s", "synchronise_s", "horizon_s", "stride"):
        assert getattr(own.twin, name) == getattr(usual.twin, name) * stretch, name
    for name in ("settle_s", "centre_s", "evidence_s", "transient_s", "review_s", "repeat_s", "again_s"):
        assert getattr(own.monitoring, name) == getattr(usual.monitoring, name) * stretch, name
    for name in ("calm_s", "stray_s", "repeat_s", "back_s", "probe_s", "answer_s", "slack_s"):
        assert getattr(own.intervention, name) == getattr(usual.intervention, name) * stretch, name
    for tag, rule in usual.description.qualities.items():
        mine = own.description.qualities[tag]
        assert (mine.stale_s, mine.grace_s) == (rule.stale_s * stretch, rule.grace_s * stretch), tag
    for limit, trip in usual.description.trips.items():
        mine_trip = own.description.trips[limit]
        assert (mine_trip.cusum, mine_trip.grace_s) == (trip.cusum * stretch, trip.grace_s * stretch), limit


@pytest.mark.parametrize("stretch", EXACT)
def test_features_are_filtered_alike(plants: Mapping[float, Plant], stretch: float) -> None:
    usual, own = (plants[s].description for s in (1.0, stretch))
    assert [f.filter_s * stretch for f in usual.features] == [f.filter_s for f in own.features]
    assert [r.on_delay_s * stretch for r in usual.symptom_rules] == [r.on_delay_s for r in own.symptom_rules]
