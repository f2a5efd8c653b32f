"""What is said of instruments and controllers before the twin is asked, and what is not."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import departing, scenario
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.twin.history import History, Window
from homeostat.twin.isolation.prechecks import (
    EQUAL,
    LAW,
    NOISE_RATIO,
    Finding,
    What,
    broken_laws,
    flat_lines,
    noise_ratios,
    prechecks,
    shared,
)

REACTOR, MODULE = "cstr", "mixing_module"
plant = functools.cache(load_plant)
some = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@functools.lru_cache(maxsize=32)
def seen(name: str, end_s: int, disturbance: str = "", mismatch: str = "none", seed: int = 1) -> History:
    """What a plant that nobody touches has shown up to ``end_s``."""
    chosen = plant(name)
    ended = scenario(chosen, "none", seed, end_s=end_s + 1.0)
    happens = departing(chosen, ended, (disturbance,) if disturbance else (), mismatch)
    history = History(chosen.description.variables, chosen.model.inputs)

    def until(snapshot: Snapshot) -> bool:
        history.append(snapshot)
        return snapshot.at_s >= end_s

    watch(open_process(chosen, happens), new_sequencer(chosen).sample, until)
    return history


def found(name: str, window: Window) -> tuple[Finding, ...]:
    return prechecks(window, plant(name).description, plant(name).model)


def named(findings: tuple[Finding, ...]) -> list[tuple[str, str]]:
    return [(f.tag, f.what.value) for f in findings]


def variable(name: str, tag: str) -> str:
    return plant(name).description.variables[tag]


def showing(window: Window, name: str, tag: str, readings: np.ndarray) -> Window:
    return replace(window, readings={**window.readings, variable(name, tag): np.array(readings, dtype=float)})


def part(window: Window, first: int, last: int) -> Window:
    cut = {v: r[first:last] for v, r in window.readings.items()}
    held = {v: f[first:last] for v, f in window.held.items()}
    return replace(window, start_s=window.start_s + first, readings=cut, inputs=window.inputs[first:last], held=held)


def healthy(name: str = REACTOR) -> Window:
    return seen(name, 1500 if name == REACTOR else 200).window(400)


FROZEN = [(REACTOR, "T1"), (REACTOR, "L1"), (REACTOR, "T2"), (REACTOR, "F1"), (MODULE, "B201.level")]


@pytest.mark.parametrize("mismatch", ["none", "plant"])
@pytest.mark.parametrize(("name", "tag"), FROZEN)
def test_an_instrument_that_keeps_its_reading_is_named(name: str, tag: str, mismatch: str) -> None:
    onset = 1500 if name == REACTOR else 80
    findings = found(name, seen(name, onset + 30, f"{tag} frozen from {onset}", mismatch).window(400))
    assert named(findings) == [(tag, "frozen")]
    assert findings[0].value >= 30 > findings[0].limit >= EQUAL
    assert abs(findings[0].since_s - onset) <= 2.0
    assert plant(name).description.tag(tag).unit in findings[0].text and "stuck" in findings[0].text


@pytest.mark.parametrize("mismatch", ["none", "plant"])
@pytest.mark.parametrize(
    ("name", "tag", "times"), [(REACTOR, "T1", 5), (REACTOR, "L1", 5), (REACTOR, "F2", 4), (MODULE, "B204.pressure", 5)]
)
def test_an_instrument_that_got_noisy_is_named_alone(name: str, tag: str, times: float, mismatch: str) -> None:
    """Although a noisy thermometer makes its controller's command and the valve's position scatter, too."""
    onset = 1500 if name == REACTOR else 80
    findings = found(name, seen(name, onset + 90, f"{tag} noise * {times} from {onset}", mismatch).window(400))
    assert named(findings) == [(tag, "noisy")]
    assert findings[0].value > findings[0].limit == NOISE_RATIO
    assert not shared(findings)


@pytest.mark.parametrize("mismatch", ["none", "plant"])
@pytest.mark.parametrize(
    ("gain", "output"),
    [
        ("Ki_flow * 3", "V1.cmd"),
        ("Kp_flow * 0.3", "V1.cmd"),
        ("Kp_level * 3", "P1.cmd"),
        ("Kp_level * 0.3", "P1.cmd"),
        ("Kp_temperature * 3", "V2.cmd"),
        ("Kp_temperature * 0.3", "V2.cmd"),
    ],
)
def test_a_controller_with_another_gain_is_named(gain: str, output: str, mismatch: str) -> None:
    findings = found(REACTOR, seen(REACTOR, 1560, f"{gain} from 1500", mismatch).window(400))
    assert named(findings) == [(output, "law")]
    assert findings[0].value > findings[0].limit >= LAW and findings[0].since_s >= 1500.0
    assert "not tuned as the tables say" in findings[0].text


def test_a_controller_that_swings_between_its_limits_is_named() -> None:
    """Its output is never inside its range for long enough to be judged closely, and it need not be."""
    twin = seen(REACTOR, 1600, "Kp_flow * 3 from 1500", "plant")
    (finding,) = found(REACTOR, twin.window(400))
    assert (finding.tag, finding.what) == ("V1.cmd", What.LAW) and finding.value > 0.5 > finding.limit > LAW


@pytest.mark.parametrize(
    "mismatch", ["plant", *(pytest.param(name, marks=pytest.mark.wide) for name in ("none", "twice"))]
)
@pytest.mark.parametrize("name", [pytest.param(REACTOR, marks=pytest.mark.slow), MODULE])
def test_a_healthy_plant_gives_nothing(name: str, mismatch: str) -> None:
    """From the first second on: start-up, pauses, pumps that start and stop."""
    history = seen(name, 1800 if name == REACTOR else 420, mismatch=mismatch, seed=3)
    whole = history.whole
    for last in range(1, whole.length + 1, 11):
        assert found(name, part(whole, max(0, last - 400), last)) == ()


@pytest.mark.parametrize(
    "disturbance",
    [
        "T1.sp + 2 from 1500 over 100",
        "F1.sp * 0.8 from 1450 every 60",
        "T1 reads + 3 from 1500",
        "V2 stiction 0.06 from 1400",
        "XV1.cmd * 0 from 1500",
        "T_coolant + 3 from 1500",
    ],
)
def test_what_is_no_fault_of_instrument_noise_or_controller_gives_nothing(disturbance: str) -> None:
    whole = seen(REACTOR, 1640, disturbance, "plant").whole
    for last in range(1500, whole.length + 1, 10):
        assert found(REACTOR, part(whole, last - 400, last)) == ()


@some
@given(st.integers(0, 200), st.integers(0, 10_000))
def test_a_run_of_equal_readings_counts_from_where_noise_would_not_give_it(equal: int, seed: int) -> None:
    read = np.random.default_rng(seed).normal(310.0, 0.5, 300)
    read[300 - equal - 1 :] = read[300 - equal - 1]
    findings = flat_lines(showing(part(healthy(), 0, 300), REACTOR, "T1", read), plant(REACTOR).description)
    if equal + 1 <= EQUAL:
        assert findings == ()
    if equal >= 10:
        assert named(findings) == [("T1", "frozen")] and findings[0].value == equal + 1


@some
@given(st.floats(1.5, 20.0), st.integers(0, 10_000), st.floats(0.0, 1.0))
def test_an_instrument_too_coarse_for_its_noise_is_never_stuck(coarse: float, seed: int, place: float) -> None:
    step = coarse * 0.5
    read = step * np.round(np.random.default_rng(seed).normal(310.0 + place * step, 0.5, 400) / step)
    assert flat_lines(showing(healthy(), REACTOR, "T1", read), plant(REACTOR).description) == ()


def test_a_coarse_instrument_repeats_itself_for_longer_before_it_is_stuck() -> None:
    noise = np.random.default_rng(1).normal(310.0, 0.5, 400)
    read, limits = 0.25 * np.round(noise / 0.25), []
    for equal in (7, 60):
        stuck = np.concatenate([read[:-equal], np.full(equal, 309.25)])
        limits.append(flat_lines(showing(healthy(), REACTOR, "T1", stuck), plant(REACTOR).description))
    assert limits[0] == () and named(limits[1]) == [("T1", "frozen")] and 7 < limits[1][0].limit < 60


@pytest.mark.parametrize(
    ("name", "tag", "rest"),
    [
        (REACTOR, "F1", 0.0),
        (REACTOR, "F3", 0.001),
        (REACTOR, "L1", 14.0),
        (MODULE, "P101.speed", 0.0),
        (MODULE, "B201.low", 1.0),
    ],
)
def test_what_rests_or_stands_at_the_end_of_its_range_is_not_stuck(name: str, tag: str, rest: float) -> None:
    window = part(healthy(name), 0, 200)
    read = np.array(window.readings[variable(name, tag)])
    read[-60:] = rest
    assert flat_lines(showing(window, name, tag, read), plant(name).description) == ()


def test_a_reading_that_is_unknown_is_not_stuck() -> None:
    """The last known one stands for it: that it repeats itself is history's doing."""
    window, v = healthy(), variable(REACTOR, "T1")
    read, held = np.array(window.readings[v]), np.zeros(400, dtype=bool)
    read[-50:], held[-49:] = read[-50], True
    lost = replace(showing(window, REACTOR, "T1", read), held={v: held})
    assert found(REACTOR, lost) == ()
    held[-3:] = False
    assert found(REACTOR, lost) == (), "four known readings are no flat line"


@pytest.mark.parametrize("tag", ["T1", "L1", "T2", "V2.pos"])
def test_outliers_steps_and_ramps_are_no_noise(tag: str) -> None:
    window, description, model = healthy(), plant(REACTOR).description, plant(REACTOR).model
    sd = description.qualities[tag].noise or 0.0
    base = window.readings[variable(REACTOR, tag)]
    for change in (
        np.where(np.isin(np.arange(400), [350, 371]), 20.0 * sd, 0.0),
        np.where(np.arange(400) > 370, 30.0 * sd, 0.0),
        2.0 * sd * np.maximum(np.arange(400) - 350, 0),
    ):
        assert noise_ratios(showing(window, REACTOR, tag, base + change), description, model) == ()


def test_two_noisy_instruments_have_one_cause_outside_of_them() -> None:
    window = healthy()
    for tag in ("T1", "L1"):
        read = np.array(window.readings[variable(REACTOR, tag)])
        middle = read.mean()
        read[-60:] = middle + 6.0 * (read[-60:] - middle)
        window = showing(window, REACTOR, tag, read)
    findings = noise_ratios(window, plant(REACTOR).description, plant(REACTOR).model)
    assert {f.tag for f in findings} == {"T1", "L1"} and all(f.what is What.NOISY for f in findings)
    assert shared(findings) and not shared(findings[:1])


def laws(window: Window) -> tuple[Finding, ...]:
    return broken_laws(window, plant(REACTOR).description, plant(REACTOR).model)


def test_an_output_at_its_limit_in_manual_or_unknown_breaks_no_law() -> None:
    window, v = healthy(), variable(REACTOR, "V2.cmd")
    moved = window.readings[v] + 0.02 * np.sin(np.arange(400.0))
    assert named(laws(showing(window, REACTOR, "V2.cmd", moved))) == [("V2.cmd", "law")]
    assert laws(showing(window, REACTOR, "V2.cmd", np.where(np.arange(400) > 330, 1.0, window.readings[v]))) == ()
    manual = showing(showing(window, REACTOR, "V2.cmd", moved), REACTOR, "V2.man", np.full(400, 0.5))
    assert laws(manual) == ()
    assert laws(replace(showing(window, REACTOR, "V2.cmd", moved), held={v: np.ones(400, dtype=bool)})) == ()
    automatic = np.where(np.arange(400) % 15 < 13, np.nan, 0.5)
    assert laws(showing(window, REACTOR, "V2.man", automatic)) == ()


@some
@given(st.floats(1e-6, 0.05), st.sampled_from(["V1.cmd", "P1.cmd", "V2.cmd"]))
def test_an_output_in_steps_breaks_no_law(step: float, tag: str) -> None:
    window = healthy()
    coarse = step * np.round(window.readings[variable(REACTOR, tag)] / step)
    if np.ptp(coarse[-62:]) > 0.0:
        assert laws(showing(window, REACTOR, tag, coarse)) == ()


def test_a_controller_that_works_every_third_second_breaks_no_law_and_one_that_stopped_does() -> None:
    window = healthy()
    command = window.readings[variable(REACTOR, "V2.cmd")]
    assert laws(showing(window, REACTOR, "V2.cmd", command[np.arange(400) // 3 * 3])) == ()
    assert named(laws(showing(window, REACTOR, "V2.cmd", np.full(400, command[0])))) == [("V2.cmd", "law")]


@some
@given(
    name=st.sampled_from([REACTOR, MODULE]),
    first=st.integers(0, 190),
    length=st.integers(1, 200),
    unknown=st.lists(st.tuples(st.integers(0, 60), st.integers(0, 399)), max_size=6),
)
@example(name=REACTOR, first=0, length=22, unknown=[(1, 0)])  # a setpoint that nobody reads is no inner one
def test_no_window_is_too_short_or_too_full_of_holes(
    name: str, first: int, length: int, unknown: list[tuple[int, int]]
) -> None:
    window = part(healthy(name), first, min(first + length, 200))
    readings, names = {v: r.copy() for v, r in window.readings.items()}, list(window.readings)
    for which, row in unknown:
        readings[names[which % len(names)]][row % window.length :] = np.nan
    assert isinstance(found(name, replace(window, readings=readings)), tuple)


def test_what_was_noisy_when_it_was_noticed_is_no_measure_of_what_is_usual() -> None:
    """Only what was read before anything was noticed says what is usual."""
    chosen: Plant = plant(REACTOR)
    window = seen(REACTOR, 1500, "L1 noise * 5 from 1300").window(400)
    since = noise_ratios(window, chosen.description, chosen.model, healthy_until_s=1300.0)
    assert named(since) == [("L1", "noisy")] and since[0].value > 3.5
