"""Valves that are stuck in a line that a clogging may narrow as well: what is alike stays alike."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import Fault, scenario_of
from homeostat.plants.plant import load_plant
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.process.batch import Batch, simulate
from homeostat.twin.twin import Twin

PLANT = load_plant("mixing_module")
MODEL = PLANT.model
EMPTIES_S = 110
"""About when B201 is emptied [s]."""


@functools.cache
def batch(fault: str, severity: float, onset_s: float, end_s: int) -> tuple[Snapshot, ...]:
    """Every snapshot of a batch that nobody looks after."""
    found: list[Snapshot] = []

    def see(snapshot: Snapshot) -> bool:
        found.append(snapshot)
        return snapshot.at_s >= end_s

    truth = scenario_of(PLANT, [Fault(fault, severity, onset_s)], 3, None)
    watch(open_process(PLANT, truth), new_sequencer(PLANT).sample, see)
    return tuple(found)


def followed(fault: str, severity: float, onset_s: float, end_s: int) -> Twin:
    """A twin that has seen it until ``end_s`` [s]."""
    twin = Twin(MODEL, PLANT.description, PLANT.twin, 3)
    for snapshot in batch(fault, severity, onset_s, end_s):
        twin.observe(snapshot)
    return twin


def shares(found: tuple[Hypothesis, ...]) -> dict[str, float]:
    """Name -> its probability."""
    summed: dict[str, float] = {}
    for each in found:
        summed[each.name] = summed.get(each.name, 0.0) + each.probability
    return summed


@pytest.mark.parametrize(
    ("fault", "pipe"),
    [
        pytest.param("stuck_closed_VI204", "clogging_common", marks=pytest.mark.wide),
        ("stuck_closed_VO201", "clogging_B201"),
    ],
)
def test_a_closed_valve_and_a_closed_pipe_stay_alike_once_the_onset_has_left_the_window(fault: str, pipe: str) -> None:
    """A replay that began with the valve open would see it close, and the pipe was always closed."""
    onset_s = EMPTIES_S - 20.0
    twin = followed(fault, 1.0, onset_s, 300)
    known = (FaultState(pipe, 1.0, onset_s),)
    before = Hypothesis(known, 0.5), Hypothesis((FaultState(fault, 1.0, onset_s),), 0.5)
    found = shares(twin.explain([fault, pipe], known, since_s=onset_s, before=before))
    assert min(found[fault], found[pipe]) > 0.1


def test_what_was_as_likely_is_asked_again_although_its_symptom_has_gone() -> None:
    """What no symptom indicates any more was forgotten, and what was called the best became certain."""
    onset_s, end_s = EMPTIES_S + 4.0, EMPTIES_S + 12
    twin = followed("stuck_open_VI204", 0.4, onset_s, end_s)
    known = (FaultState("clogging_common", 0.7, onset_s),)
    before = Hypothesis(known, 0.6), Hypothesis((FaultState("stuck_open_VI204", 0.4, onset_s),), 0.4)
    found = shares(twin.explain(["clogging_common"], known, since_s=onset_s, before=before))
    assert found["stuck_open_VI204"] > 0.1


@pytest.mark.parametrize(("fault", "severity"), [("pump_failure", 0.93), ("stuck_closed_VI204", 0.91)])
def test_a_size_that_changes_nothing_is_its_whole_range(fault: str, severity: float) -> None:
    twin = followed(fault, severity, EMPTIES_S + 3.0, EMPTIES_S + 20)
    found = twin.explain([fault], (), since_s=EMPTIES_S + 8.0)
    (between,) = {h.between for h in found if h.name == fault}
    assert between == (0.9, 1.0)


def test_a_size_that_the_readings_tell_is_bounded_by_them() -> None:
    twin = followed("pump_degradation", 0.4, EMPTIES_S + 3.0, EMPTIES_S + 20)
    found = twin.explain(["pump_degradation"], (), since_s=EMPTIES_S + 8.0)
    (between,) = {h.between for h in found if h.name == "pump_degradation"}
    assert between is not None and 0.2 < between[0] < 0.4 < between[1] < 0.6


def test_a_stuck_valve_settles_where_the_equations_let_it_come_to_rest() -> None:
    """Seven valves, each stuck in another way or not at all, after a minute of the same commands."""
    members, minute = 4, 60
    inputs = np.zeros((1, minute, len(MODEL.inputs)))
    inputs[0, :, MODEL.inputs.index("cmd_VI4")] = 1.0
    severity = np.zeros((members, len(MODEL.faults)))
    onset_s = np.full_like(severity, np.inf)
    for member, (fault, size) in enumerate(
        [("stuck_closed_VI204", 1.0), ("stuck_open_VI204", 0.3), ("stuck_open_VO202", 0.6)]
    ):
        column = MODEL.faults.index(fault)
        severity[member, column], onset_s[member, column] = size, 5.0
    parameters = np.tile(PLANT.true_parameters(3), (members, 1))
    start = np.tile(MODEL.initial_state(parameters[0]), (members, 1))
    still = np.zeros(members)
    what = Batch(
        start, parameters, severity, onset_s, inputs, np.zeros(members, dtype=np.int64), 0.0, minute, 1, (0,),
        np.zeros(members, dtype=np.int64), still, still,
    )  # fmt: skip
    rested = simulate(MODEL.kernel, what).state
    MODEL.settle(start, inputs[[0] * members, 0], parameters, severity, onset_s, float(minute))
    positions = [k for k, name in enumerate(MODEL.states) if name.endswith("_pos")]
    np.testing.assert_allclose(start[:, positions], rested[:, positions], atol=1e-9)


@pytest.mark.parametrize("shown", [0.0, 0.005, 0.019])
def test_a_pump_that_is_not_to_run_and_shows_noise_stands(shown: float) -> None:
    """A speed of nearly nothing would put the lines under pressure, and tell an open valve from a closed one."""
    read = dict(MODEL.readings(MODEL.initial_state(PLANT.true_parameters(3)), np.zeros(len(MODEL.inputs))))
    stands, runs = MODEL.estimate(read | {"speed_P101": shown}), MODEL.estimate(read | {"speed_P101": 0.3})
    column = MODEL.states.index("N1")
    assert (stands[column], runs[column]) == (0.0, 0.3)
