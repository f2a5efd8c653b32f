"""Jumped: a reading that moved as the process cannot speaks for its instrument, where no model predicts it."""

from collections.abc import Sequence

import numpy as np
import pytest

from homeostat.process.types import Vec
from homeostat.twin.history import Window
from homeostat.twin.isolation.jumped import jumped
from tests.twin.followed import disturbed, follow, reactor

FASTEST = 1.0
"""Of the feed temperature, by the reactor's tables [K/s]."""
LENGTH = 100
ONSET_S = 1450
TABLES = tuple(fault.name for fault in reactor().description.faults)


def course(seed: int = 1) -> Vec:
    """Readings of a feed at rest [K], shape (LENGTH,)."""
    return 330.0 + 0.2 * np.random.default_rng(seed).standard_normal(LENGTH)


def found(readings: Vec, held: Sequence[int] = (), tag: str = "T2", tick_s: float = 1.0) -> frozenset[str]:
    """Instruments that jumped where only the one of ``tag`` was read, its readings ``held`` in some rows."""
    flags = np.isin(np.arange(LENGTH), held)
    window = Window(0.0, {tag: readings}, np.zeros((LENGTH, 1)), held={tag: flags}, tick_s=tick_s)
    return jumped(window, reactor().description, ("T1",))


def test_a_step_that_is_too_fast_and_lasts_is_a_jump() -> None:
    step = np.where(np.arange(LENGTH) >= 60, 8.0, 0.0)
    assert found(course()) == frozenset()
    assert found(course() + step) == found(course() - step) == {"TT2"}


def test_what_the_process_can_do_is_none() -> None:
    ramp = np.clip(np.arange(LENGTH) - 60.0, 0.0, 10.0) * 0.9 * FASTEST
    assert found(course() + ramp) == frozenset()
    assert found(course() + np.where(np.arange(LENGTH) >= 60, 8.0, 0.0), tick_s=20.0) == frozenset(), "in 20 s it can"


@pytest.mark.parametrize("wild", [1, 3])
def test_wild_readings_are_none(wild: int) -> None:
    readings = course()
    readings[60 : 60 + wild] += 15.0
    assert found(readings) == frozenset()


@pytest.mark.parametrize("wild", [1, 4, 9])
def test_what_is_wild_at_an_end_of_the_window_is_none_either(wild: int) -> None:
    """At a look nobody knows yet whether the last readings last."""
    last, first = course(), course()
    last[-wild:] += 15.0
    first[:wild] += 15.0
    assert found(last) == found(first) == frozenset()


def test_readings_that_were_not_there_are_not_judged() -> None:
    rows = range(60, 66)
    readings = course() + np.where(np.arange(LENGTH) >= 66, 10.0, 0.0)
    readings[60:66] = readings[59]
    assert found(readings, rows) == {"TT2"}, "10 K in 7 s"
    slower = course() + np.where(np.arange(LENGTH) >= 66, 5.0, 0.0)
    slower[60:66] = slower[59]
    assert found(slower, rows) == frozenset(), "5 K in 7 s"
    readings[:] = np.nan
    assert found(readings) == frozenset()


def test_what_a_model_predicts_needs_no_such_evidence() -> None:
    readings = course() + np.where(np.arange(LENGTH) >= 60, 8.0, 0.0)
    assert found(readings, tag="T1") == frozenset()


def accused(*disturbances: str, lag_s: int = 90) -> dict[str, float]:
    """Item -> its probability, so long after all of ``disturbances`` began."""
    twin = follow(disturbed(3, ONSET_S + lag_s, *(f"{each} from {ONSET_S}" for each in disturbances)), 3)
    items = dict[str, float]()
    for h in twin.explain(TABLES, (), since_s=ONSET_S + lag_s - 10.0):
        item = "+".join(sorted({reactor().description.fault_mode(f.fault).component for f in h.faults}))
        items[item] = items.get(item, 0.0) + h.probability
    return items


def test_a_feed_thermometer_that_jumped_is_accused_at_the_first_look() -> None:
    """The heat balance alone cannot say so soon whether the reactor's own thermometer drifts instead."""
    assert accused("T2 reads * 1.04")["TT2"] >= 0.9


def test_a_feed_that_truly_jumped_accuses_nobody() -> None:
    """The tables say that it cannot; the heat that it brings says that it did."""
    assert accused("T_feed + 12", "K_P1 * 0.8")["P1"] >= 0.9
