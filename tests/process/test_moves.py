"""Moves: what is done to members beside their equations is what was asked for, and nothing else changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from homeostat.process.batch import Batch, BatchResult, ProcessError, simulate
from homeostat.process.moves import Move, MoveKind, Moves, move_all_parameters, moved_inputs
from homeostat.process.moving import move_parameters
from tests.plants.cstr import reactor
from tests.plants.cstr.reactor import P, S

START_S, STEPS = 1500.0, 60


def settled(members: int = 3, **changes: object) -> Batch:
    state = reactor.run(reactor.batch(int(START_S))).state[0]
    b = reactor.batch(STEPS, members=members, x=state, start_s=START_S)
    return replace(b, record=tuple(range(len(S))), **changes)


def moved(b: Batch, *moves: tuple[Move, ...]) -> BatchResult:
    return simulate(reactor.MODEL.kernel, replace(b, moves=Moves.of(moves)))


def test_members_that_nothing_moves_are_simulated_to_the_bit() -> None:
    b = settled()
    plain = simulate(reactor.MODEL.kernel, b)
    again = moved(b, (), (), ())
    beside = moved(b, (), (Move(MoveKind.STATE, S.T, START_S + 10.0, 0.1),), ())
    assert np.array_equal(plain.record, again.record)
    assert np.array_equal(plain.record[[0, 2]], beside.record[[0, 2]])


@pytest.mark.parametrize("own", [(), (Move(MoveKind.STATE, S.T, START_S + 10.0, 0.1),)])
def test_members_alone_keep_their_own_moves(own: tuple[Move, ...]) -> None:
    b = replace(settled(), moves=Moves.of([(), own, ()]))
    alone = simulate(reactor.MODEL.kernel, b.members(np.array([1])))
    assert np.array_equal(alone.record[0], simulate(reactor.MODEL.kernel, b).record[1])


def test_a_state_gains_what_it_is_given_each_second() -> None:
    """The product counter has no equation of its own loss: it stands higher by the size times the seconds."""
    b = settled(1)
    plain = moved(b, ())
    given = moved(b, (Move(MoveKind.STATE, S.product, START_S + 20.0, 0.5),))
    extra = given.state[0, S.product] - plain.state[0, S.product]
    assert extra == pytest.approx(0.5 * (STEPS - 20 + 1))
    assert np.array_equal(given.record[0, :19], plain.record[0, :19]), "nothing before the onset"


def test_what_swings_is_a_sine_of_its_size_and_period() -> None:
    """A quarter of a turn after the onset it is off by its size, half a turn later by as much on the other side."""
    b = settled(1)
    plain, swung = moved(b, ()), moved(b, (Move(MoveKind.READING, S.F2, START_S + 10.0, 0.001, period_s=40.0),))
    difference = swung.record[0, :, S.F2] - plain.record[0, :, S.F2]
    assert difference[:9] == pytest.approx(0.0) and difference[19] == pytest.approx(0.001)
    assert difference[29] == pytest.approx(0.0, abs=1e-9) and difference[39] == pytest.approx(-0.001)


def test_a_parameter_that_swings_below_its_least_comes_back_to_what_it_was() -> None:
    p = np.array([1.0, 5.0])
    rows = Moves.of([(Move(MoveKind.PARAMETER, 1, 0.0, -8.0, least=0.5, period_s=40.0),)])
    course = []
    for at_s in range(41):
        move_parameters(p, rows.what, rows.how, 0, 1, float(at_s))
        course.append(float(p[1]))
    assert min(course) == 0.5 and course[10] == 0.5 and course[30] == pytest.approx(13.0)
    assert course[20] == pytest.approx(5.0) and course[40] == pytest.approx(5.0) and p[0] == 1.0


def test_an_input_that_swings_arrives_within_its_ends() -> None:
    rows = Moves.of([(Move(MoveKind.INPUT, 0, 100.0, 0.4, least=0.0, most=0.7, period_s=80.0),)])
    inputs = np.array([[0.5, 2.0]])
    arrived = {at_s: rows.arriving(inputs, at_s)[0].tolist() for at_s in (99.0, 100.0, 120.0, 160.0)}
    assert arrived == {99.0: [0.5, 2.0], 100.0: [0.5, 2.0], 120.0: [0.7, 2.0], 160.0: [pytest.approx(0.1), 2.0]}


def test_what_grows_is_the_size_times_the_seconds_since_the_onset() -> None:
    b = settled(1)
    plain, grown = moved(b, ()), moved(b, (Move(MoveKind.READING, S.F2, START_S + 10.0, 0.001, grows=True),))
    difference = grown.record[0, :, S.F2] - plain.record[0, :, S.F2]
    assert difference[9] == pytest.approx(0.0) and difference[-1] == pytest.approx(0.001 * (STEPS - 10))


def test_what_grows_stays_as_it_is_once_it_has_grown_for_long_enough() -> None:
    b = settled(1)
    drift = Move(MoveKind.READING, S.F2, START_S + 10.0, 0.001, grows=True, grown_s=20.0)
    difference = moved(b, (drift,)).record[0, :, S.F2] - moved(b, ()).record[0, :, S.F2]
    assert difference[19] == pytest.approx(0.01) and difference[30:] == pytest.approx(0.02)
    assert drift.change([-1.0, 0.0, 5.0, 20.0, 99.0]) == pytest.approx([0.0, 0.0, 0.005, 0.02, 0.02])
    slow = Move(MoveKind.PARAMETER, P.K_P1, START_S, -0.0005, grows=True, grown_s=20.0)
    lasting = replace(slow, size=-0.01, grows=False)
    ends = [moved(b, (each,)).record[0, -1, S.L1] for each in (slow, lasting)]
    assert ends[0] == pytest.approx(ends[1], abs=0.15), "at the end it is as if it had always been so large"


def test_an_input_goes_on_as_it_is_as_well() -> None:
    off = Move(MoveKind.INPUT, 0, START_S, 0.01, grows=True, grown_s=5.0)
    schedules, follows = moved_inputs(np.zeros((10, 1)), [(off,)], START_S, 1.0)
    assert schedules[follows[0], :, 0].tolist() == pytest.approx([0.0, 0.01, 0.02, 0.03, 0.04, *[0.05] * 5])
    made = Moves.of([(off,)])
    assert [made.arriving(np.zeros((1, 1)), START_S + s)[0, 0] for s in (2.0, 9.0)] == pytest.approx([0.02, 0.05])


def test_a_parameter_is_as_if_it_had_always_been_so() -> None:
    b = settled(1)
    low = moved(b, (Move(MoveKind.PARAMETER, P.K_P1, 0.0, -0.01),))
    parameters = b.parameters.copy()
    parameters[:, P.K_P1] -= 0.01
    assert np.array_equal(low.record, simulate(reactor.MODEL.kernel, replace(b, parameters=parameters)).record)
    assert b.parameters[0, P.K_P1] == reactor.parameters()[P.K_P1], "what was given stays as it was"


def test_a_parameter_that_was_moved_before_is_not_moved_twice() -> None:
    b = settled(1)
    move = Move(MoveKind.PARAMETER, P.K_P1, 0.0, -0.01)
    parameters = b.parameters.copy()
    (on,) = move_all_parameters(parameters, [(move,)], START_S)
    assert parameters[0, P.K_P1] == pytest.approx(b.parameters[0, P.K_P1] - 0.01) and on[0].done == -0.01
    assert np.array_equal(moved(replace(b, parameters=parameters), on).record, moved(b, (move,)).record)


def test_what_is_gone_on_with_at_its_least_comes_back_as_if_it_had_never_been_stopped() -> None:
    p, swing = np.array([[1.0, 5.0]]), Move(MoveKind.PARAMETER, 1, 0.0, -8.0, least=0.5, period_s=40.0)
    (on,) = move_all_parameters(p, [(swing, Move(MoveKind.PARAMETER, 1, 0.0, 1.0))], 10.0)
    assert p[0, 1] == 0.5 and sum(move.done for move in on) == pytest.approx(-4.5)
    rows = Moves.of([on])
    for at_s in range(10, 51):
        move_parameters(p[0], rows.what, rows.how, 0, 2, float(at_s))
        if at_s in (20, 30, 40):
            assert p[0, 1] == pytest.approx({20: 6.0, 30: 14.0, 40: 6.0}[at_s])


def test_a_positive_parameter_does_not_fall_below_its_least() -> None:
    b = settled(1)
    going = moved(b, (Move(MoveKind.PARAMETER, P.K_P1, START_S, -1.0, grows=True, least=0.001),))
    assert np.isfinite(going.record).all() and going.record[0, -1, S.F2_true] < 0.001


def test_a_controller_acts_on_the_reading_that_was_moved() -> None:
    b = settled(2)
    result = moved(b, (Move(MoveKind.READING, S.L1, START_S + 5.0, 0.5),), ())
    assert (result.record[0, 8:, S.P1_cmd] > result.record[1, 8:, S.P1_cmd] + 0.05).all()
    assert result.state[0, S.V] < result.state[1, S.V]


@pytest.mark.parametrize("onset_s", [START_S - 100.0, START_S, START_S + 7.0])
def test_a_stuck_reading_shows_what_it_showed_at_the_onset(onset_s: float) -> None:
    b = settled(1, sensor_noise=np.ones(1))
    result = moved(b, (Move(MoveKind.FROZEN, S.T1, onset_s, 0.0),))
    late = result.record[0, max(int(onset_s - START_S), 0) :, S.T1]
    assert len(set(late[1:].tolist())) == 1
    if onset_s <= START_S:
        assert late[-1] == b.state[0, S.T1]


@pytest.mark.parametrize("stride", [1, 5, 7])
def test_a_sparse_record_shows_the_same(stride: int) -> None:
    moves = (Move(MoveKind.READING, S.F1, START_S + 3.0, 0.002), Move(MoveKind.STATE, S.T, START_S + 9.0, 0.05))
    b = settled(1)
    sparse = moved(replace(b, stride=stride), moves).record
    assert np.array_equal(sparse, moved(b, moves).record[:, stride - 1 :: stride][:, : sparse.shape[1]])


def test_a_vessel_gives_no_more_than_it_holds() -> None:
    b = settled(1)
    empty = moved(b, (Move(MoveKind.STATE, S.V, START_S, -2.0, least=0.0),))
    assert np.isfinite(empty.record).all() and 0.0 <= empty.state[0, S.V] < 0.1


@pytest.mark.parametrize(
    ("kind", "column", "said"),
    [
        (MoveKind.STATE, 10_000, "a move of kind STATE has column 10000; must be within 0 and"),
        (MoveKind.READING, -1, "a move of kind READING has column -1; must be within 0 and"),
        (MoveKind.PARAMETER, 500, "a move of kind PARAMETER has column 500; must be within 0 and"),
        (MoveKind.INPUT, 90, "a move of kind INPUT has column 90; must be within 0 and"),
        (7, 0, "there is no move of kind 7"),
    ],
)
def test_a_move_of_what_no_member_has_is_refused(kind: MoveKind, column: int, said: str) -> None:
    with pytest.raises(ProcessError, match=said):
        moved(settled(1), (Move(kind, column, START_S, 1.0),))


@pytest.mark.parametrize("begin", [[0, 5], [1, 1], [0, 0]])
def test_rows_of_moves_that_are_not_there_are_refused(begin: list[int]) -> None:
    made = Moves.of([(Move(MoveKind.STATE, S.T, START_S, 1.0),)])
    with pytest.raises(ProcessError, match="must rise from 0 to 1"):
        simulate(reactor.MODEL.kernel, replace(settled(1), moves=replace(made, begin=np.array(begin, dtype=np.int64))))
