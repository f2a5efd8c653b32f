"""Readings that are no state of the model: an instrument shows nonsense, and recovery goes on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest

from homeostat.agents.monitoring.monitoring import TwinMonitoring
from homeostat.agents.simulation import TwinSimulation
from homeostat.domain.diagnosis import SOMETHING_ELSE, Diagnosis, FaultState, Hypothesis
from homeostat.domain.snapshot import Snapshot
from homeostat.process.batch import ProcessError
from homeostat.twin.history import History
from homeostat.twin.twin import Twin
from tests.agents.scripted import NoGraph
from tests.agents.test_monitoring import SETTINGS, SURE, Scene
from tests.twin.followed import follow, reactor, readings

STUCK = FaultState("cool_stuck_closed", 0.7, 1450.0)


class Indicating(NoGraph):
    """A graph in which every symptom indicates a stuck valve."""

    def candidate_faults(self, symptoms: Sequence[str]) -> tuple[str, ...]:
        return (STUCK.fault,)


def shown(snapshots: Sequence[Snapshot], tag: str, value: float, first_s: float, last_s: float) -> list[Snapshot]:
    """``snapshots`` in which an instrument shows ``value`` for a while."""
    return [replace(s, values={**s.values, tag: value}) if first_s <= s.at_s <= last_s else s for s in snapshots]


@pytest.mark.slow
def test_what_a_thermometer_shows_that_has_nothing_to_show_is_a_diagnosis_and_no_breakdown() -> None:
    """The cooling water reads -9999 K for 5 s: the model boils over, whatever is supposed to be wrong."""
    plant = reactor()
    twin = Twin(plant.model, plant.description, plant.twin, 0)
    monitoring = TwinMonitoring(
        twin,
        Indicating(),
        plant.description,
        plant.baselines,
        plant.started,
        plant.monitoring,  # type: ignore[arg-type]
    )
    found: list[Diagnosis] = []
    for snapshot in shown(readings(2, 1500), "T3", -9999.0, 1440.0, 1444.0):
        if monitoring.notices(snapshot):
            found.append(monitoring.diagnose())
    assert [[h.name for h in d.hypotheses] for d in found] == [[SOMETHING_ELSE]] * 2
    assert all(d.doubts and d.symptoms and not d.faulty for d in found), "people are told, and no cause is acted on"
    assert found[1].at_s - found[0].at_s >= plant.monitoring.repeat_s


def test_instruments_are_taken_as_they_are_where_the_twin_cannot_say_what_they_show() -> None:
    plant = reactor()
    twin = follow(tuple(shown(readings(2, 1470, (STUCK,)), "T3", -9999.0, 1466.0, 1470.0)))
    diagnosis = Diagnosis(1470.0, (), (Hypothesis((STUCK,), 0.9), Hypothesis((), 0.1)))
    with pytest.raises(ProcessError):
        twin.instrument_errors(diagnosis.hypotheses)
    simulation = TwinSimulation(twin, plant.description.tags_by_name, plant.description.limits)
    assert simulation.instrument_errors(diagnosis) == ()


@pytest.mark.slow
def test_controllers_are_not_judged_by_readings_that_are_no_state_of_the_model() -> None:
    twin = follow(tuple(shown(readings(2, 1470, (STUCK,)), "T1", -50.0, 1466.0, 1470.0)))
    assert twin.explain([STUCK.fault], ())


class Broken(Scene):
    """A plant whose readings are no state of its model for a while."""

    def __init__(self) -> None:
        super().__init__(self._answer)
        self.broken = False

    def _answer(self, at_s: float) -> tuple[Hypothesis, ...]:
        if self.broken:
            raise ProcessError("member 0 left the physical world")
        return SURE


def test_what_was_said_stands_while_the_readings_are_no_state_of_the_model() -> None:
    scene = Broken()
    assert scene.watch(30) == [] and scene.until_attention(10, x=2.0) is not None
    assert scene.monitoring.diagnose().hypotheses == SURE
    scene.broken = True
    assert scene.until_attention(10, x=2.0, y=2.0) is not None
    again = scene.monitoring.diagnose()
    assert again.hypotheses == SURE and again.faulty and not again.news
    asked_s = scene.at_s
    assert scene.until_attention(100, x=2.0, y=2.0) == asked_s + SETTINGS.repeat_s, "and they are looked at again"
    scene.broken = False
    assert scene.monitoring.diagnose().news


def test_parameters_are_learned_from_a_later_stretch_where_some_readings_are_no_state_of_the_model() -> None:
    scene = Scene()
    learn, ends_s = scene.twin.calibrate, 30.0

    def breaks(seconds: int) -> None:
        if scene.at_s < ends_s:
            raise ProcessError("member 0 left the physical world")
        learn(seconds)

    scene.twin.calibrate = breaks  # type: ignore[method-assign]
    assert scene.watch(100) == []
    assert [seconds for _, seconds in scene.twin.learned] == [SETTINGS.centre_s]


@pytest.mark.parametrize("wild", [3.4e38, -1e12, float("inf")])
def test_a_reading_that_no_plant_has_is_unknown_to_the_twin(wild: float) -> None:
    history = History({"hot": "hot", "by_hand": "by_hand"}, ("by_hand",), settle_rows=1)
    for at_s, hot, by_hand in ((1.0, 300.0, 0.5), (2.0, wild, 0.5), (3.0, 301.0, wild)):
        history.append(Snapshot(at_s, {"hot": hot, "by_hand": by_hand}))
    window = history.window(3)
    assert window.readings["hot"].tolist() == [300.0, 300.0, 301.0]
    assert window.readings["by_hand"].tolist() == [0.5, 0.5, 0.5]
    assert window.held["hot"].tolist() == [False, True, False]
