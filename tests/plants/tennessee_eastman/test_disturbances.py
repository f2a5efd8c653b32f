"""The published disturbances in our words: all are there, sized and timed as published, and act on what they should."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.tennessee.alone import Upset, upsets
from homeostat.domain.disturbance import Disturbance, Effect, Shape
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.plants.tennessee_eastman.process import TENNESSEE_EASTMAN
from homeostat.process.blocks.term import Leaf, Term
from tests.plants.tennessee_eastman.eastman import eastman, measured, rates
from tests.plants.tennessee_eastman.test_base_case import start

HOUR = 3600.0
RANDOM = {
    "A_in_4": (0.5, 0.2, 0.03), "B_in_4": (1.0, 0.7, 0.003),
    "T_feed_2": (0.5, 0.25, 10.0), "T_feed_4": (1.0, 0.7, 10.0),
    "T_water_R": (0.25, 0.15, 10.0), "T_water_S": (0.25, 0.15, 10.0), "k1": (2.0, 1.0, 0.25), "k2": (2.0, 1.0, 0.25),
    "warming_C": (0.5, 0.4, 0.25), "UA_R": (2.0, 1.5, -0.35), "UA_S": (3.0, 2.0, -0.25), "vapour_7": (2.0, 1.5, -0.25),
    "T_feed_1": (0.25, 0.15, 10.0), "T_feed_3": (0.5, 0.25, 10.0), "most_1": (0.25, 0.15, 5.0 / 100.0),
    "most_2": (0.5, 0.25, 20.0 / 400.0), "most_3": (0.5, 0.25, 20.0 / 400.0), "most_4": (1.0, 0.7, 75.0 / 1500.0),
    "water_R": (0.2, 0.1, 50.0 / 1000.0), "water_S": (0.2, 0.1, 60.0 / 1200.0),
}  # fmt: skip
"""Of each parameter the mean and the half range of the published intervals [h], and the published size."""
UNKNOWN = (16, 17, 18, 20)


def told() -> list[tuple[Upset, Disturbance]]:
    return [(upset, Disturbance.parse(text)) for upset in upsets().values() for text in upset.disturbances]


def test_every_published_disturbance_is_a_fault_or_happens_to_the_true_plant() -> None:
    assert list(upsets()) == list(range(1, 29))
    names = {fault.name for fault in eastman().description.faults}
    for upset in upsets().values():
        assert bool(upset.fault) != bool(upset.disturbances) and upset.published and upset.source, upset.idv
        assert not upset.fault or upset.fault in names
        case = upset.scenario(eastman(), 1, HOUR, 24.0 * HOUR)
        assert case.onset_s == HOUR and len(case.disturbances) == len(upset.disturbances)


def test_what_is_unknown_there_stands_in_no_table_of_faults_here() -> None:
    hidden = {happens.name for upset, happens in told() if upset.idv in UNKNOWN}
    assert hidden == {"warming_C", "UA_R", "UA_S", "vapour_7"}
    for fault in eastman().description.faults:
        assert fault.effect is None or fault.effect.quantity not in hidden, fault.name
        assert not any(f"IDV {number}" in fault.label for number in UNKNOWN)


def test_sizes_and_times_are_the_published_ones() -> None:
    random = {happens.name: happens for _, happens in told() if happens.shape is not Shape.STATED}
    assert set(random) == set(RANDOM)
    for name, (mean_h, half_h, size) in RANDOM.items():
        happens = random[name]
        assert happens.every_s == pytest.approx((mean_h - half_h) * HOUR), name
        assert happens.longest_s == pytest.approx((mean_h + half_h) * HOUR), name
        assert happens.size == pytest.approx(size + (happens.effect is Effect.TIMES)), name
        assert happens.back_s == (0.1 * HOUR if happens.shape is Shape.BURSTING else 0.0), name
        assert (happens.shape is Shape.BURSTING) == (size < 0.0), name
    sticking: dict[int, list[str]] = {}
    for upset, happens in told():
        if happens.effect is Effect.STICTION:
            sticking.setdefault(upset.idv, []).append(happens.name)
            assert happens.size == 0.02
    assert sticking == {14: ["V10"], 15: ["V11"], 19: ["V5", "V7", "V8", "V9"]}


def changed(name: str, factor: float) -> dict[Term, object]:
    values = start()
    values[Term(Leaf.PARAMETER, value=name)] = factor
    return values


def test_the_parameters_that_they_need_act_by_hand() -> None:
    """Inert B stays behind where a quarter less leaves: 42339 m3/h / 22.39 m3/kmol * 8.893 % * 0.25 = 42 kmol/h.

    Of open valves: 0.4111 * 1000 * 500.53 / 7060 = 29.1 and 0.1811 * 1200 * 500.53 / 11138 = 9.77 times per hour.
    """
    steady = rates(start())
    for parameter, factor, state, rate in (
        ("vapour_7", 0.75, "R_B", 42.0),
        ("vapour_7", 0.75, "S_B", -42.0),
        ("water_R", 1.05, "R_water", 0.05 * 29.14 * (35.0 - 94.6)),
        ("water_S", 1.05, "S_water", 0.05 * 9.768 * (40.0 - 77.3)),
    ):
        found = rates(changed(parameter, factor))[state] - steady[state]
        assert float(np.ravel(found)[0]) == pytest.approx(rate, rel=0.01), parameter
    steam, more = (float(np.ravel(measured(values)["FS"])[0]) for values in (start(), changed("warming_C", 1.25)))
    assert more == pytest.approx(1.25 * steam)


def test_each_of_them_changes_what_comes_in() -> None:
    """A mean of the model's own disturbances is a parameter like any other."""
    symbols = eastman().model.parameters
    assert {happens.name for _, happens in told() if happens.shape is not Shape.STATED} <= set(symbols)
    assert {name for name in RANDOM if name.startswith(("A_", "B_", "T_"))} == set(TENNESSEE_EASTMAN.disturbances)


@pytest.mark.wide
@pytest.mark.parametrize(("idv", "least"), [(13, 5.0), (20, 5.0)])
def test_the_plant_is_stirred_and_lives(idv: int, least: float) -> None:
    """Reactor pressure over eight hours of what the published code lives through, beyond the trip limits nowhere."""
    process = open_process(eastman(), upsets()[idv].scenario(eastman(), 1, 0.0, 8.0 * HOUR))
    readings = [process.advance() for _ in range(8 * 60)]
    shown = {tag: np.array([each[tag] for each in readings]) for tag in ("PR", "LS", "LC")}
    assert np.ptp(shown["PR"]) > least and shown["PR"].max() < 3000.0
    assert shown["LS"].min() > 2.7 and shown["LC"].min() > -27.4
