"""The engine: the same bits however the work is divided, and errors that say who, when and what."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.process.batch import Batch, BatchRun, ProcessError, simulate
from tests.plants.cstr.reactor import ALL, FAULTS, MODEL, SEVERITY, P, S, U, batch, inputs, parameters, run

MEMBERS, STEPS, START_S = 60, 400, 2000.0
PER_MEMBER = ("state", "parameters", "severity", "onset_s", "input_of", "seeds", "process_noise", "sensor_noise")
SOME = settings(max_examples=15)


def crowd() -> Batch:
    """Sixty different members: parameters, states, faults, schedules, seeds and noise; enough work for threads."""
    r = np.random.default_rng(4)
    steady = run(batch(1500)).state[0]
    u = np.stack([np.tile(inputs(T1_sp=t, F1_sp=f), (STEPS, 1)) for t, f in ((310.0, 0.0333), (306.0, 0.02))])
    u[1, 100:200, U.V2_man] = 0.8
    severity = np.zeros((MEMBERS, len(FAULTS)))
    onset = np.full_like(severity, np.inf)
    for m in range(MEMBERS):
        for f in r.choice(len(FAULTS), size=m % 3, replace=False):
            severity[m, f], onset[m, f] = SEVERITY[FAULTS[f]] * r.uniform(0.2, 1.0), START_S + r.uniform(-50, 300)
    values = np.tile(parameters(), (MEMBERS, 1))
    values[:, P.UA] *= r.uniform(0.9, 1.1, MEMBERS)
    values[:, P.bias_T1] = r.normal(0.0, 0.1, MEMBERS)
    states = np.tile(steady, (MEMBERS, 1))
    states[:, S.T] += r.normal(0.0, 1.0, MEMBERS)
    states[:, S.V] = r.uniform(0.2, 11.5, MEMBERS)
    return Batch(
        state=states, parameters=values, severity=severity, onset_s=onset, inputs=u,
        input_of=r.integers(0, 2, MEMBERS), start_s=START_S, steps=STEPS, stride=1, record=ALL,
        seeds=r.integers(-(2**62), 2**62, MEMBERS), process_noise=r.integers(0, 2, MEMBERS).astype(float),
        sensor_noise=r.uniform(0.0, 2.0, MEMBERS),
    )  # fmt: skip


CROWD = crowd()
TOGETHER = run(CROWD)


def some(members: np.ndarray) -> Batch:
    """The crowd's ``members``, in that order."""
    return replace(CROWD, **{name: getattr(CROWD, name)[members] for name in PER_MEMBER})


def same(a: np.ndarray, b: np.ndarray) -> bool:
    """Bit for bit, NaN included."""
    return a.shape == b.shape and a.tobytes() == b.tobytes()


def test_the_crowd_is_worth_the_name() -> None:
    """It is large enough for threads, every member is different, and every fault occurs."""
    assert MEMBERS * STEPS >= 20_000
    assert len({TOGETHER.record[m].tobytes() for m in range(MEMBERS)}) == MEMBERS
    assert (CROWD.severity.max(axis=0) > 0.0).all()


def test_one_member_alone_has_the_bits_it_has_in_a_crowd_on_many_threads() -> None:
    for m in range(MEMBERS):
        alone = run(some(np.array([m])))
        assert same(alone.record[0], TOGETHER.record[m]) and same(alone.state[0], TOGETHER.state[m])


@SOME
@given(st.permutations(range(MEMBERS)), st.integers(1, MEMBERS))
def test_any_order_and_any_selection(order: list[int], count: int) -> None:
    members = np.array(order[:count])
    result = run(some(members))
    assert same(result.record, TOGETHER.record[members]) and same(result.state, TOGETHER.state[members])


@SOME
@given(st.lists(st.integers(1, STEPS), max_size=6))
def test_piece_by_piece_is_as_in_one(stops: list[int]) -> None:
    run = BatchRun(MODEL.kernel, CROWD)
    for until in sorted({*stops, STEPS}):
        run.advance(until)
    assert same(run.record, TOGETHER.record) and same(run.state, TOGETHER.state)


@SOME
@given(st.lists(st.integers(0, STEPS), min_size=MEMBERS, max_size=MEMBERS))
def test_members_may_begin_later_than_others(begin: list[int]) -> None:
    states = np.array([TOGETHER.record[m, k - 1] if k else CROWD.state[m] for m, k in enumerate(begin)])
    late = run(replace(CROWD, state=states, begin=np.array(begin)))
    assert same(late.state, TOGETHER.state)
    for m, k in enumerate(begin):
        assert same(late.record[m, k:], TOGETHER.record[m, k:])


def test_a_member_cannot_begin_after_the_end() -> None:
    with pytest.raises(ProcessError, match=r"begin .* must be within 0 and 50"):
        run(replace(batch(50), begin=np.array([51])))


@SOME
@given(st.lists(st.integers(0, MEMBERS), max_size=9), st.integers(1, 7))
def test_any_division_among_threads(cuts: list[int], workers: int) -> None:
    edges = sorted({0, MEMBERS, *cuts})
    state, out = CROWD.state.copy(), np.empty((MEMBERS, STEPS, len(S)))
    broken, begin = np.full(MEMBERS, np.nan), np.zeros(MEMBERS, dtype=np.int64)

    def work(first: int, last: int) -> None:
        MODEL.kernel(
            first, last, state, CROWD.parameters, CROWD.severity, CROWD.onset_s, CROWD.inputs, CROWD.input_of,
            START_S, begin, STEPS, 1, CROWD.seeds, CROWD.process_noise, CROWD.sensor_noise, np.array(ALL), out, broken,
        )  # fmt: skip

    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(work, edges[:-1], edges[1:]))
    assert same(state, TOGETHER.state) and same(out, TOGETHER.record) and np.isnan(broken).all()


@SOME
@given(st.integers(1, STEPS - 1))
def test_a_run_that_is_split_anywhere_goes_on_with_the_same_bits(second: int) -> None:
    """The state is all there is to know: no generator, no hidden memory."""
    first = run(replace(CROWD, steps=second))
    assert same(first.record, TOGETHER.record[:, :second])
    assert same(first.state, TOGETHER.record[:, second - 1])
    rest = replace(
        CROWD,
        state=first.state,
        inputs=CROWD.inputs[:, second:],
        start_s=START_S + second,
        steps=STEPS - second,
    )
    result = run(rest)
    assert same(result.record, TOGETHER.record[:, second:]) and same(result.state, TOGETHER.state)


@SOME
@given(st.integers(1, STEPS + 10), st.lists(st.integers(0, len(S) - 1), max_size=5))
def test_stride_and_columns_choose_what_is_recorded(stride: int, columns: list[int]) -> None:
    result = simulate(MODEL.kernel, replace(some(np.arange(3)), stride=stride, record=tuple(columns)))
    assert result.record.shape == (3, STEPS // stride, len(columns))
    assert same(result.record, TOGETHER.record[:3, stride - 1 :: stride][:, :, columns])
    assert same(result.state, TOGETHER.state[:3])


def test_nothing_that_was_handed_in_is_changed() -> None:
    before = {f.name: np.array(getattr(CROWD, f.name)).tobytes() for f in fields(CROWD)}
    run(CROWD)
    assert before == {f.name: np.array(getattr(CROWD, f.name)).tobytes() for f in fields(CROWD)}


def test_memory_layout_and_number_types_do_not_matter() -> None:
    odd = replace(
        some(np.arange(5)),
        state=np.asfortranarray(CROWD.state[:5]),
        parameters=np.repeat(CROWD.parameters, 2, axis=0)[:10:2],
        seeds=CROWD.seeds[:5][::-1][::-1],
        input_of=CROWD.input_of[:5].astype(np.int32),
        inputs=np.broadcast_to(CROWD.inputs[:, None], (2, 1, STEPS, len(U)))[:, 0],
    )
    odd.severity.flags.writeable = False
    assert same(run(odd).record, TOGETHER.record[:5])


# Common random numbers.


def test_two_schedules_with_one_seed_see_the_same_disturbances_and_sensor_noise() -> None:
    a = run(batch(300, process=1.0, sensor=1.0))
    b = run(batch(300, process=1.0, sensor=1.0, u=inputs(T1_sp=300.0, F1_sp=0.02)))
    assert not same(a.of("T"), b.of("T"))
    for name in ("CA_feed_noise", "CD_feed_noise", "T_feed_noise", "T2_true"):
        assert same(a.of(name), b.of(name)), name
    noise = [r.of("T1") - r.of("T1_ideal") for r in (a, b)]
    assert noise[0].std() > 0.4 and noise[0] == pytest.approx(noise[1], abs=1e-12)


def test_two_seeds_see_different_ones() -> None:
    result = run(batch(300, members=2, process=1.0, sensor=1.0))
    for name in ("CA_feed_noise", "CD_feed_noise", "T_feed_noise", "T1", "T2", "T3", "V1_zt"):
        assert not same(result.of(name, 0), result.of(name, 1)), name


def test_time_counts_for_the_noise_and_not_the_step() -> None:
    """The noise of second 2000 is the noise of second 2000, whenever the run began."""
    long = run(batch(50, sensor=1.0, start_s=1980.0))
    short = run(batch(30, sensor=1.0, start_s=2000.0))
    assert (long.of("T3")[20:] == short.of("T3")).all()


def test_without_noise_the_seed_does_not_matter() -> None:
    a, b = run(batch(100, first_seed=1)), run(batch(100, first_seed=99))
    assert same(a.record, b.record)


# What is refused.


def broken(**changes: object) -> str:
    """The message with which a small batch of three members is refused."""
    with pytest.raises(ProcessError) as refused:
        run(replace(batch(50, members=3, start_s=120.0), **changes))
    message = str(refused.value)
    assert "\n" not in message
    return message


def poisoned(table: np.ndarray, member: int, column: int, value: float) -> np.ndarray:
    table = table.copy()
    table[member, column] = value
    return table


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    ("field", "column", "named"),
    [("state", S.T, "T is"), ("state", S.level_integral, "level_integral is"), ("parameters", P.UA, "parameter 0 is"),
     ("severity", 8, "severity 8 is")],
)  # fmt: skip
def test_a_value_that_is_not_finite_is_named(field: str, column: int, named: str, value: float) -> None:
    table = getattr(batch(50, members=3), field)
    message = broken(**{field: poisoned(table, 1, column, value)})
    assert message.startswith(f"member 1: {named} {value!r} at t = 120 s"), message


@pytest.mark.parametrize("field", ["process_noise", "sensor_noise"])
def test_noise_scales_must_be_finite(field: str) -> None:
    assert "member 2" in broken(**{field: np.array([0.0, 1.0, math.nan])})


def test_an_onset_must_be_a_time_and_may_be_never() -> None:
    onset = batch(50, members=3).onset_s
    assert np.isinf(onset).all()
    assert "member 0: onset 3 is nan" in broken(onset_s=poisoned(onset, 0, 3, math.nan))


def test_an_infinite_input_is_refused() -> None:
    u = np.tile(inputs(T1_sp=math.inf), (1, 50, 1))
    assert "infinite" in broken(inputs=u)


def test_the_start_must_be_a_time() -> None:
    assert "start_s is nan" in broken(start_s=math.nan)


@pytest.mark.parametrize("volume", [-1.0, -0.01, -1e-9, 1e13])
def test_a_volume_that_cannot_be_is_found_at_the_start(volume: float) -> None:
    message = broken(state=poisoned(batch(1, members=3).state, 2, S.V, volume))
    assert message.startswith("member 2 left the physical world at t = 120 s (volume < 0 or not finite)"), message
    assert f"V = {volume:.6g}" in message


@pytest.mark.parametrize("temperature", [0.0, -5.0, 1e13])
def test_a_temperature_that_cannot_be_is_found_at_the_start(temperature: float) -> None:
    message = broken(state=poisoned(batch(1, members=3).state, 0, S.T, temperature))
    assert message.startswith("member 0 left the physical world at t = 120 s"), message


@pytest.mark.parametrize("setpoint", ["F1_sp", "T1_sp"])
def test_a_setpoint_without_a_value_is_found_in_the_first_second(setpoint: str) -> None:
    """NaN means automatic in a manual output; in a setpoint it must not pass unseen."""
    assert "member 0 left the physical world at t = 121 s" in broken(
        inputs=np.tile(inputs(**{setpoint: math.nan}), (1, 50, 1))
    )


@pytest.mark.parametrize("name", ["T_feed", "UA", "Cv_V1", "K_P1", "cp", "tau_V2", "bias_T1", "Kp_flow", "dH_A"])
def test_a_parameter_that_is_not_a_number_never_passes_the_kernel(name: str) -> None:
    """Behind the check at the door: the compiled code itself reports a poisoned member, and goes on with the rest."""
    b = batch(50, members=3, x=run(batch(1500)).state[0], start_s=120.0)
    values = poisoned(b.parameters, 1, MODEL.parameters.index(name), math.nan)
    out, at = np.empty((3, 50, len(S))), np.full(3, np.nan)
    MODEL.kernel(
        0, 3, b.state, values, b.severity, b.onset_s, b.inputs, b.input_of, 120.0, np.zeros(3, dtype=np.int64), 50, 1,
        b.seeds, b.process_noise, b.sensor_noise, np.array(ALL), out, at,
    )  # fmt: skip
    assert np.isnan(at[[0, 2]]).all() and 120.0 < at[1] <= 123.0
    assert np.isfinite(out[[0, 2]]).all()


def test_a_vessel_that_leaks_faster_than_it_can_is_empty_and_loses_no_more_than_it_held() -> None:
    held = run(batch(1500)).state[0]
    leaking = run(batch(50, x=held, start_s=120.0, faults={"leak": (1.5, 130.0)}))
    assert 0.0 <= leaking.of("V")[-1] < 0.1
    gone = leaking.of("leak").sum() + leaking.of("F2_true").sum()
    assert gone + leaking.of("V")[-1] == pytest.approx(held[S.V] + leaking.of("F1_true").sum(), abs=1e-9)


def test_the_message_names_the_columns_that_are_not_finite() -> None:
    assert "(volume < 0 or not finite): CA = nan" in broken(
        inputs=np.tile(inputs(T1_sp=math.nan), (1, 50, 1)), record=(S.V,)
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"steps": 51}, "input schedules of shape (1, 50, 9) do not cover 51 ticks"),
        ({"steps": 0}, "steps 0 and stride 1 must be >= 1"),
        ({"stride": 0}, "steps 50 and stride 0 must be >= 1"),
        ({"inputs": np.zeros((50, len(U)))}, "input schedules of shape (50, 9)"),
        ({"parameters": np.zeros((2, len(P)))}, "parameters has 2 rows for 3 members"),
        ({"seeds": np.zeros(4, dtype=np.int64)}, "seeds has 4 rows for 3 members"),
        ({"sensor_noise": np.zeros(1)}, "sensor_noise has 1 rows for 3 members"),
        ({"onset_s": np.zeros((3, 1))}, "onset_s of shape (3, 1) must be like severity, (3, 9)"),
        ({"input_of": np.array([0, 1, 0])}, "input_of [0, 1] must be within 0 and 0"),
        ({"input_of": np.array([0, -1, 0])}, "input_of [-1, 0] must be within 0 and 0"),
        ({"record": (0, len(S))}, f"must be within 0 and {len(S) - 1}"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(changes: dict[str, object], message: str) -> None:
    """Compiled code would read beyond them."""
    assert message in broken(**changes)


@pytest.mark.parametrize("field", ["state", "parameters", "severity", "inputs"])
def test_arrays_with_missing_columns_are_refused_by_the_kernel(field: str) -> None:
    b = batch(50, members=3)
    short = {field: getattr(b, field)[..., :-1]} | ({"onset_s": b.onset_s[..., :-1]} if field == "severity" else {})
    with pytest.raises(ValueError, match="columns of the layout"):
        run(replace(b, record=(0,), **short))


def test_a_member_that_leaves_the_physical_world_leaves_the_others_as_they_are() -> None:
    """Without an error it is NaN from then on, at every stride, however it is cut."""
    healthy = batch(60, members=3)
    values = healthy.parameters.copy()
    values[1, P.k0_A] = 1e60  # nothing reacts like that
    what = replace(healthy, parameters=values, stride=7)
    with pytest.raises(ProcessError, match="member 1 left the physical world"):
        run(what)
    found = simulate(MODEL.kernel, what, refuse=False)
    alone = run(replace(healthy, stride=7))
    assert same(found.record[[0, 2]], alone.record[[0, 2]]) and same(found.state[[0, 2]], alone.state[[0, 2]])
    assert np.isnan(found.record[1, -1]).all() and np.isnan(found.state[1]).all()
    pieces = BatchRun(MODEL.kernel, what, refuse=False)
    for until in (1, 20, 21, 60):
        pieces.advance(until)
    assert same(pieces.record, found.record)
