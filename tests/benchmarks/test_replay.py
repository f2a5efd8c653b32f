"""The plant on which recorded setpoints are tried again is the same one each time, and is left alone until then."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.replay_ours import ENDS_S, Course, execute, idle, opened
from homeostat.domain.recovery import ActionSet, Command
from homeostat.evaluate.scenario import scenario
from homeostat.plants.plant import Plant, load_plant

ASKED_S = 400


@pytest.fixture(scope="module")
def plant() -> Plant:
    return load_plant("cstr")


def tried(plant: Plant, actions: ActionSet, start_s: int) -> Course:
    setting = scenario(plant, "fouling", 3, onset_s=300.0, end_s=float(ENDS_S))
    return execute(*opened(plant, setting), actions, start_s)


def test_what_is_done_shows_from_the_recorded_second_on_and_nothing_before(plant: Plant) -> None:
    early, alone = tried(plant, idle(), 1), tried(plant, idle(), ASKED_S)
    assert len(early.temperature) == ENDS_S and np.array_equal(early.temperature[ASKED_S - 1 :], alone.temperature)
    colder = tried(plant, ActionSet((Command("T1.sp", 306.0, 0.02),), "reduced_load"), ASKED_S)
    assert colder.temperature[0] == alone.temperature[0]
    assert colder.temperature[600] < alone.temperature[600] - 2.0
