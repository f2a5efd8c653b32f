"""Unknown causes: what no table names is found where it is, of its size, and gets no wrong name."""

from __future__ import annotations

import functools

import pytest

from homeostat.domain.diagnosis import FaultMode, FaultState, Hypothesis
from tests.twin.followed import disturbed, follow, reactor

ONSET_S = 1450
TABLES = tuple(fault.name for fault in reactor().description.faults)


@functools.cache
def explained(disturbance: str, lag_s: int = 60, seed: int = 3, mismatch: str = "none") -> tuple[Hypothesis, ...]:
    twin = follow(disturbed(seed, ONSET_S + lag_s, f"{disturbance} from {ONSET_S}", mismatch=mismatch), seed)
    return twin.explain(TABLES, (), since_s=ONSET_S + 10.0)


def mode(hypothesis: Hypothesis) -> FaultMode:
    return reactor().description.fault_mode(hypothesis.faults[0].fault)


def accused(found: tuple[Hypothesis, ...]) -> dict[str, float]:
    """Item -> its probability; of nothing it stands under an empty name."""
    items: dict[str, float] = {}
    for h in found:
        item = "+".join(sorted({reactor().description.fault_mode(f.fault).component for f in h.faults}))
        items[item] = items.get(item, 0.0) + h.probability
    return items


TRANSMITTERS = [
    pytest.param("T1 reads - 5", "T1_reads_low", 5.0, marks=pytest.mark.wide),
    ("T1 reads + 4", "temp_bias", 4.0),
    ("L1 reads + 0.7", "L1_reads_high", 0.7),
    pytest.param("L1 reads - 0.7", "level_bias", 0.7, marks=pytest.mark.wide),
    pytest.param("F2 reads * 0.8", "F2_reads_low", 0.2, marks=pytest.mark.wide),
    ("V1.pos reads + 0.1", "V1.pos_reads_high", 0.1),
]


@pytest.mark.parametrize(("disturbance", "name", "size"), TRANSMITTERS)
def test_a_transmitter_that_lies_is_named_in_both_directions(disturbance: str, name: str, size: float) -> None:
    """A fault of the tables keeps its name; the others are generated, and their name contains the tag."""
    found = explained(disturbance)
    assert sum(h.probability for h in found if h.name == name) >= 0.9
    assert found[0].faults[0].severity == pytest.approx(size, rel=0.1)
    assert found[0].faults[0].onset_s == pytest.approx(ONSET_S, abs=4.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("disturbance", "item"),
    [
        *(("UA * 0.6", "R1"), ("K_P1 * 1.3", "P1")),
        pytest.param("F3_max * 0.5", "V2", marks=pytest.mark.wide),
        pytest.param("Cv_V1 * 0.7", "V1", marks=pytest.mark.wide),
        pytest.param("UA_ambient * 6", "R1", marks=pytest.mark.wide),
    ],
)
def test_the_item_of_an_unknown_change_is_among_what_is_accused(disturbance: str, item: str) -> None:
    items = accused(explained(disturbance, 240))
    assert items.get(item, 0.0) >= 0.05, items
    assert max((p for name, p in items.items() if name not in (item, "")), default=0.0) < 0.9, "no wrong name"


@pytest.mark.slow
@pytest.mark.parametrize(("actuator", "slower_s"), [("V1", 25.0), ("V1", 40.0), ("P1", 20.0)])
def test_an_actuator_that_takes_many_times_as_long_is_named_with_its_time(actuator: str, slower_s: float) -> None:
    """Its usual time is 3 s: what a linear pass says of ten times as much is far from it."""
    found = explained(f"{actuator} slow {slower_s:g}", 240)
    name = f"unknown_{actuator}_tau_{actuator}"
    assert sum(h.probability for h in found if h.name == name) >= 0.9, found[0]
    assert found[0].faults[0].severity == pytest.approx(slower_s, rel=0.4)
    assert found[0].faults[0].onset_s == pytest.approx(ONSET_S, abs=8.0)


def test_the_size_of_an_unknown_loss_of_heat_is_in_its_interval() -> None:
    """Six times the loss to the ambient, 5 x 50 W/K x 10 K, are 2.5 kW; less as the reactor cools."""
    sizes = [h.faults[0].severity for h in explained("UA_ambient * 6", 60) if h.name == "unknown_heat_R1"]
    assert sizes and min(sizes) <= -2.2 and max(sizes) >= -2.6


@pytest.mark.parametrize(
    "disturbance",
    ["T_feed - 8", "T1_sp - 2", *(pytest.param(d, marks=pytest.mark.wide) for d in ("T_coolant + 5", "T_feed + 8"))],
)
@pytest.mark.parametrize("lag_s", [60, pytest.param(240, marks=pytest.mark.wide)])
def test_what_is_measured_is_no_fault(disturbance: str, lag_s: int) -> None:
    found = explained(disturbance.replace("T1_sp", "T1.sp"), lag_s)
    assert found[0].name == "none" and found[0].probability >= 0.7


@pytest.mark.parametrize("mismatch", ["none", "plant"])
def test_no_fault_means_no_name(mismatch: str) -> None:
    twin = follow(disturbed(5, ONSET_S + 300, mismatch=mismatch), 5)
    found = twin.explain(TABLES, ())
    assert max((h.probability for h in found if h.faults), default=0.0) < 0.5


@pytest.mark.slow
def test_an_explanation_beside_one_that_is_known_keeps_it() -> None:
    """A thermometer that lies is known; then the pump weakens in a way that no table names."""
    snapshots = disturbed(3, ONSET_S + 200, f"T1 reads - 5 from {ONSET_S}", f"F2 reads * 0.8 from {ONSET_S + 120}")
    twin = follow(snapshots, 3)
    known = explained("T1 reads - 5")[0].faults
    found = twin.explain(TABLES, known, since_s=float(ONSET_S))
    assert {f.fault for f in found[0].faults} == {"T1_reads_low", "F2_reads_low"}
    assert found[0].probability >= 0.5


@pytest.mark.parametrize(
    ("disturbance", "name"),
    [("T1 frozen", "T1_frozen"), ("L1 noise * 5", "L1_noisy"), ("Kp_level * 0.3", "LIC1_wrong_law")],
)
def test_what_readings_show_by_themselves_is_said_by_name(disturbance: str, name: str) -> None:
    found = explained(disturbance, 70)
    assert found[0].name == name and found[0].probability >= 0.9


@pytest.mark.parametrize("seconds", [2, 3, 5, 9, 12])
def test_a_few_readings_are_no_reason_to_break(seconds: int) -> None:
    twin = follow(disturbed(3, 1450)[-seconds:], 3, learn=False)
    found = twin.explain(TABLES, ())
    assert 0.9 <= sum(h.probability for h in found) <= 1.0 + 1e-9


def test_what_was_certain_and_holds_is_said_again() -> None:
    snapshots = disturbed(3, ONSET_S + 400, f"T1 reads - 5 from {ONSET_S}")
    first = follow(snapshots[: ONSET_S + 60], 3).explain(TABLES, (), since_s=ONSET_S + 5.0)
    twin = follow(snapshots, 3)
    assert twin.explain(TABLES, first[0].faults, since_s=float(ONSET_S), before=first) == first


@pytest.mark.slow
def test_what_grew_since_is_estimated_again() -> None:
    snapshots = disturbed(3, ONSET_S + 400, f"T1 reads - 3 from {ONSET_S}", f"T1 reads - 2 from {ONSET_S + 100}")
    first = follow(snapshots[: ONSET_S + 60], 3).explain(TABLES, (), since_s=ONSET_S + 5.0)
    again = follow(snapshots, 3).explain(TABLES, first[0].faults, since_s=float(ONSET_S), before=first)
    assert first[0].faults[0].severity == pytest.approx(3.0, abs=0.3)
    assert again[0].name == "T1_reads_low" and again[0].faults[0].severity == pytest.approx(5.0, abs=0.5)


def test_what_was_said_and_is_no_state_of_the_model_any_more_is_isolated_again() -> None:
    """A belief with which a replay leaves the physical world is given up, not followed."""
    absurd = (Hypothesis((FaultState("unknown_R1_k0_A", 1e300, ONSET_S - 100.0),), 1.0),)
    twin = follow(disturbed(3, ONSET_S + 60, f"T1 reads - 5 from {ONSET_S}"), 3)
    found = twin.explain(TABLES, (), since_s=float(ONSET_S), before=absurd)
    assert found != absurd and found[0].name == "T1_reads_low"
