"""What is to be done after a look at the plant: every reason to leave it alone, to improve it, to act."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.cost import PRODUCT, Cost, CostItem
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.deviations import Missed
from homeostat.domain.mode import Mode
from homeostat.recovery.agenda import Agenda, RecoveryMemory, Stance
from homeostat.recovery.bounds import InterventionBounds
from homeostat.recovery.look.news import Look
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import diagnosis
from tests.recovery.line import COOLING

CALM_S = 20.0
AGENDA = Agenda(COOLING, Bounds(intervention=InterventionBounds(calm_s=CALM_S)))
COST = Cost((CostItem(PRODUCT, 5.0),), 10.0)
FINE = {"fine": True, "harmless": True}
HARMLESS = {"fine": False, "harmless": True}
HARMFUL = {"fine": False, "harmless": False}
RECOVERED = {"released_s": 0.0}


def look(state: str = "reduced", at_s: float = 100.0, faulty: bool = True, **found: bool) -> Look:
    explained = diagnosis(at_s) if faulty else Diagnosis(at_s, (), ())
    return Look(at_s, state, Mode.CLOSED_LOOP, explained, {"LIM-HOT": 0.5}, COST, **found)


def stance(
    found: dict[str, Any], due: bool = False, deviates: bool = False, worthwhile: bool = True, **remembered: Any
) -> Stance:
    return AGENDA.stance(RecoveryMemory(**remembered), look(**found), due, deviates, worthwhile)


@pytest.mark.parametrize("remembered", [{}, RECOVERED], ids=["never touched", "recovered"])
def test_a_faulty_plant_that_is_fine_is_improved_where_there_is_something_to_win(remembered: dict[str, Any]) -> None:
    assert stance(FINE, **remembered) is Stance.IMPROVE
    assert stance(FINE, worthwhile=False, **remembered) is Stance.LEAVE


@pytest.mark.parametrize("remembered", [{}, RECOVERED], ids=["never touched", "recovered"])
def test_a_plant_without_a_fault_is_not_improved_even_where_it_deviates(remembered: dict[str, Any]) -> None:
    for deviates in (False, True):
        assert stance({**FINE, "faulty": False}, deviates=deviates, **remembered) is Stance.LEAVE


def test_a_plant_without_a_fault_is_left_where_somebody_moved_it_as_long_as_it_is_protected() -> None:
    elsewhere = {**HARMLESS, "faulty": False}
    for worthwhile in (False, True):
        assert stance(elsewhere, worthwhile=worthwhile) is Stance.LEAVE
    assert stance(elsewhere, deviates=True) is Stance.ACT, "a batch that does not do what was predicted needs somebody"
    assert stance({**HARMFUL, "faulty": False}) is Stance.ACT


@pytest.mark.parametrize(("ago_s", "expected"), [(CALM_S - 0.1, Stance.LEAVE), (CALM_S, Stance.IMPROVE)])
def test_a_release_settles_before_anything_is_improved(ago_s: float, expected: Stance) -> None:
    assert stance(FINE, released_s=100.0 - ago_s) is expected


def test_what_forbids_is_acted_upon_whatever_it_costs_and_however_recent_the_release() -> None:
    for remembered in ({}, {"released_s": 99.0}):
        for worthwhile in (False, True):
            assert stance(HARMFUL, worthwhile=worthwhile, **remembered) is Stance.ACT
    assert stance(HARMLESS) is Stance.ACT, "it was never recovered"


def test_a_recovered_plant_that_is_harmless_may_be_left_alone() -> None:
    for worthwhile in (False, True):
        assert stance(HARMLESS, worthwhile=worthwhile, **RECOVERED) is Stance.IMPROVE


@pytest.mark.parametrize("found", [FINE, {**FINE, "faulty": False}, {**HARMLESS}])
def test_a_step_that_is_due_is_preferred_whatever_leaving_costs(found: dict[str, Any]) -> None:
    for worthwhile in (False, True):
        assert stance(found, due=True, worthwhile=worthwhile, **RECOVERED) is Stance.PREFER
    assert stance(HARMFUL, due=True, **RECOVERED) is Stance.ACT


@pytest.mark.parametrize("found", [FINE, HARMLESS])
def test_nobody_is_asked_again_without_news(found: dict[str, Any]) -> None:
    before = replace(look(**found), at_s=50.0)
    remembered = {**RECOVERED, "in_vain": before}
    assert stance(found, **remembered) is Stance.LEAVE
    assert stance(found, deviates=True, **remembered) is Stance.IMPROVE
    assert stance(found, due=True, **remembered) is Stance.PREFER
    dearer = replace(before, cost=Cost((CostItem(PRODUCT, 4.0),), 10.0))
    assert stance(found, **{**remembered, "in_vain": dearer}) is Stance.IMPROVE


@pytest.mark.parametrize("found", [FINE, HARMLESS])
def test_a_batch_that_is_over_is_accepted_where_it_does_no_harm(found: dict[str, bool]) -> None:
    assert stance({**found, "state": "still"}) is Stance.ACCEPT
    assert stance({**HARMFUL, "state": "still"}, **RECOVERED) is Stance.GIVE_UP


MISSED = {"missed": Missed("ACC-SOFT", -1.0, "K", 20.0)}


@pytest.mark.parametrize("found", [FINE, HARMLESS, HARMFUL])
def test_what_is_missed_for_long_is_improved_where_nothing_is_wrong(found: dict[str, Any]) -> None:
    """Nothing else called: the plant is left as it is where nothing is cheaper, and no fallback acts."""
    well = {**found, "faulty": False}
    assert stance(well, **MISSED) is Stance.IMPROVE
    if found is not HARMFUL:
        assert stance(well, worthwhile=False, **MISSED) is Stance.LEAVE
        assert stance(well, released_s=100.0 - CALM_S + 0.1, **MISSED) is Stance.LEAVE
    assert stance(well, in_vain=replace(look(**well), at_s=50.0), **MISSED) is Stance.LEAVE, "nothing is new"


def test_what_is_missed_beside_a_fault_or_a_deviation_takes_nothing_from_what_must_be_done() -> None:
    assert stance(HARMFUL, **MISSED) is Stance.ACT
    assert stance({**HARMFUL, "faulty": False}, deviates=True, **MISSED) is Stance.ACT


def test_what_each_stance_means() -> None:
    assert {s for s in Stance if s.asks} == {Stance.IMPROVE, Stance.PREFER, Stance.ACT}
    assert {s for s in Stance if not s.may_be_left} == {Stance.ACT, Stance.GIVE_UP}
