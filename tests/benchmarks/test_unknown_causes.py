"""The study of unknown causes: its tables say what is true of the plants that they are about."""

from __future__ import annotations

import tomllib
from functools import cache

import pytest

from benchmarks.unknown.causes import FOLDER, PLANTS, Cause, chosen, harmless_causes, known_faults, unknown_causes
from benchmarks.unknown.jobs import KNOWN_LOOKS_S, LOOKS_S, PARTS, SEEDS, Job, jobs, scenario_of
from homeostat.evaluate.scenario import ScenarioError
from homeostat.plants.plant import Plant, load_plant


@cache
def components(plant: str) -> frozenset[str]:
    return frozenset(component.name for component in load_plant(plant).description.components)


def is_balance(text: str, plant: str) -> bool:
    kind, _, component = text.partition(" ")
    return kind in ("heat", "mass") and component in components(plant)


def balances_stated(plant: str) -> set[str]:
    text = (FOLDER / f"causes_{plant}.toml").read_text(encoding="utf-8")
    return set(tomllib.loads(text)["known_balances"])


@pytest.mark.parametrize("plant", PLANTS)
def test_there_are_enough_causes_and_no_name_comes_twice(plant: str) -> None:
    unknown, harmless = unknown_causes(plant), harmless_causes(plant)
    assert sum(not cause.known for cause in unknown) >= 40
    assert len(harmless) >= 20
    names = [cause.id for cause in (*unknown, *harmless)]
    assert len({cause.id for cause in unknown}) == len(unknown)
    assert len({cause.id for cause in harmless}) == len(harmless)
    assert all(name.replace("-", "").isalnum() for name in names), "names of files"
    kinds = {cause.kind for cause in unknown}
    assert len(kinds) >= 4 and all(sum(c.kind == kind for c in unknown) >= 4 for kind in kinds)


@pytest.mark.parametrize("plant", PLANTS)
def test_every_disturbance_is_one_that_the_plant_can_have(plant: str) -> None:
    loaded = load_plant(plant)
    for part in PARTS:
        for job in jobs(loaded, [part], [], [1], "plant"):
            assert scenario_of(loaded, job).mismatch == "plant"


def test_a_disturbance_that_the_plant_cannot_have_is_refused() -> None:
    wrong = Job("cstr", "unknown", Cause("wrong", "heat", spec="UB * 0.7 from 2000"), 1, "plant")
    with pytest.raises(ScenarioError, match="UB"):
        scenario_of(load_plant("cstr"), wrong)


@pytest.mark.parametrize("plant", PLANTS)
def test_what_is_true_names_components_and_balances_of_the_plant(plant: str) -> None:
    for cause in unknown_causes(plant):
        assert cause.item in components(plant), cause.id
        assert all(is_balance(balance, plant) for balance in cause.balances), cause.id
        for other in cause.alike:
            assert other in components(plant) or is_balance(other, plant), cause.id
        assert cause.item not in cause.alike and not set(cause.balances) & set(cause.alike), cause.id


@pytest.mark.parametrize("plant", PLANTS)
def test_what_the_fault_list_has_is_said_to_be_known(plant: str) -> None:
    """Bias, drift, frozen and noise of any instrument are generated; a sine, a gain or a pulse is not."""
    for cause in unknown_causes(plant):
        words = cause.spec.split()
        pulse = "every" in words or "to" in words
        if not pulse and words[1] in ("frozen", "noise"):
            assert cause.known, cause.id
        elif not pulse and words[1] == "reads":
            assert cause.known == (words[2] in "+-" or cause.item == "FT204"), cause.id
        elif pulse:
            assert not cause.known, cause.id


@pytest.mark.parametrize("plant", PLANTS)
def test_known_faults_are_drawn_within_their_tables_and_again_the_same(plant: str) -> None:
    loaded = load_plant(plant)
    drawn = known_faults(loaded, 401)
    assert drawn == known_faults(loaded, 401) != known_faults(loaded, 402)
    for cause, fault in zip(drawn, loaded.description.faults, strict=True):
        assert fault.severity_range.contains(cause.severity) and cause.item == fault.component
        assert loaded.end_s > cause.onset_s > 0.0
        assert all(is_balance(balance, plant) for balance in cause.balances)
    assert {c.id for c in drawn if c.balances} == balances_stated(plant)


def test_causes_are_chosen_by_name_or_by_class() -> None:
    every = unknown_causes("cstr")
    assert chosen(every, []) == every
    assert {cause.kind for cause in chosen(every, ["heat"])} == {"heat"}
    assert [cause.id for cause in chosen(every, ["V2-slow"])] == ["V2-slow"]
    assert chosen(every, ["V9"]) == ()


@pytest.mark.parametrize("plant", PLANTS)
def test_the_study_is_as_large_as_it_was_asked_to_be(plant: str) -> None:
    loaded: Plant = load_plant(plant)
    assert LOOKS_S[plant][0] == KNOWN_LOOKS_S[plant][0] == 0
    assert len(SEEDS["unknown"]) == 3 and len(SEEDS["known"]) == 20
    assert len(list(jobs(loaded, ["harmless"], [], [], "plant"))) >= 147
    first = next(jobs(loaded, ["unknown"], [], [], "plant"))
    assert first.name == f"{plant}-plant-unknown-{first.cause.id}-601"
    assert min(seed for seeds in SEEDS.values() for seed in seeds) > 420, "what was chosen was chosen on those"
