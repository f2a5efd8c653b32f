"""Generated fault modes: every transmitter in both directions, every balance, no name twice."""

from __future__ import annotations

import pytest

from homeostat.domain.diagnosis import EffectKind
from homeostat.domain.plant.description import Relation
from homeostat.plants.plant import Plant, load_plant


@pytest.fixture(scope="module", params=["cstr", "mixing_module"])
def plant(request: pytest.FixtureRequest) -> Plant:
    return load_plant(request.param)


def test_every_compared_or_calibrated_transmitter_can_lie_in_both_directions(plant: Plant) -> None:
    names = {mode.name for mode in plant.description.generated}
    for signal in plant.description.signals:
        if signal.relation is Relation.MEASURES and signal.variable in plant.twin.errors:
            for what in ("reads_high", "reads_low", "drifts_up", "drifts_down", "frozen", "noisy"):
                assert f"{signal.tag.name}_{what}" in names


def test_names_are_unique_and_not_those_of_the_tables(plant: Plant) -> None:
    names = [mode.name for mode in plant.description.fault_modes]
    assert len(set(names)) == len(names)
    assert all(mode.effect is None for mode in plant.description.faults)
    assert all(mode.effect is not None for mode in plant.description.generated)


def test_every_balance_has_an_unknown_disturbance(plant: Plant) -> None:
    assert plant.twin.balances
    for balance in plant.twin.balances:
        mode = plant.description.fault_mode(f"unknown_{balance.quantity}_{balance.component}")
        assert mode.unknown and mode.severity_unit == balance.unit
        assert mode.severity_nominal == pytest.approx(balance.large)


def test_effects_act_on_what_the_model_has(plant: Plant) -> None:
    model, known = plant.model, {c.name for c in plant.description.components}
    where = {EffectKind.PARAMETER: model.parameters, EffectKind.BALANCE: model.states, EffectKind.READING: model.shown}
    for mode in plant.description.generated:
        assert mode.component in known
        if mode.effect is not None and mode.effect.kind in where:
            assert mode.effect.quantity in where[mode.effect.kind]


def test_tables_do_not_know_generated_ones(plant: Plant) -> None:
    """What can be put into a run is what the model has an equation of."""
    with pytest.raises(ValueError, match="has no fault 'unknown_mass"):
        plant.description.fault(next(m.name for m in plant.description.generated if m.name.startswith("unknown_mass")))


def test_what_can_only_be_lost_has_a_size_and_no_sign() -> None:
    plant = load_plant("mixing_module")
    modes = {b.only_lost: plant.description.fault_mode(f"unknown_mass_{b.component}") for b in plant.twin.balances}
    lost, either = modes[True], modes[False]
    assert lost.severity_range.low == 0.0 > either.severity_range.low and "loss of mass" in lost.label
    assert lost.effect is not None and either.effect is not None
    assert (lost.effect.per_unit, either.effect.per_unit) == (-1.0, 1.0)
