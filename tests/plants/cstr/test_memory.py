"""What the loops remember: a controller that was at its limit for long is resumed with the memory that it has."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from homeostat.process.types import Vec
from homeostat.twin.history import History
from tests.plants.cstr import reactor
from tests.plants.cstr.reactor import S
from tests.twin.followed import reactor as plant
from tests.twin.followed import readings

HELD_S = 900
"""Longer than any stretch that is replayed before a forecast."""


@functools.cache
def held() -> tuple[reactor.Run, Vec]:
    """900 s of holding after settling, with noise: no feed, and the withdrawal pump at its stop; and the inputs."""
    settled = reactor.run(reactor.batch(1500)).state[0]
    feeding, holding = reactor.inputs(), reactor.inputs(F1_sp=0.0, XV1_cmd=0.0)
    schedule = np.concatenate([np.tile(feeding, (300, 1)), np.tile(holding, (HELD_S, 1))])
    return reactor.run(reactor.batch(len(schedule), u=schedule, x=settled, start_s=1500.0, sensor=1.0)), schedule


def resumed(seconds: int) -> Vec:
    """The state that a model resumes control in if it remembers the last ``seconds``."""
    run, schedule = held()
    rows = [reactor.MODEL.readings(x, u) for x, u in zip(run.record[0, -seconds:], schedule[-seconds:], strict=True)]
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    states = np.array(run.state)
    states[:, [S.level_integral, S.temperature_integral]] = np.nan
    reactor.MODEL.resume(states, columns, np.atleast_2d(reactor.parameters()))
    return states[0]


def test_the_pump_is_at_its_stop_for_longer_than_a_forecast_looks_back() -> None:
    run, _ = held()
    assert run.of("P1_cmd")[-plant().twin.synchronise_s :].max() == 0.0


def test_the_level_loop_resumes_with_the_integral_that_it_has() -> None:
    """Taken from what a forecast replays it would be off, and so would be the level once the feed comes back."""
    run, _ = held()
    true = float(run.state[0, S.level_integral])
    assert resumed(HELD_S + 200)[S.level_integral] == pytest.approx(true, abs=1e-6)
    assert abs(resumed(plant().twin.synchronise_s)[S.level_integral] - true) > 1e-3


def test_the_temperature_loop_resumes_with_the_integral_that_it_has() -> None:
    run, _ = held()
    true = float(run.state[0, S.temperature_integral])
    assert resumed(HELD_S + 200)[S.temperature_integral] == pytest.approx(true, abs=1e-6)


def test_a_twin_remembers_for_longer_than_it_replays() -> None:
    history = History(plant().description.variables, plant().model.inputs)
    for snapshot in readings(2, 1470):
        history.append(snapshot)
        assert history.whole.end_s == snapshot.at_s
    assert history.length == len(history.whole.readings["T1"]) == 1470 > plant().twin.synchronise_s
