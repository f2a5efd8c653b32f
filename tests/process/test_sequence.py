"""Sequences: each member at its own pace, exactly as if the sequencer stood beside it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import scenario
from homeostat.plants.plant import load_plant
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.process.batch import Batch, ProcessError
from homeostat.process.moves import Moves
from homeostat.process.seeds import Stream, noise_seed
from homeostat.process.sequence import Guard, InputSequence, SequenceResult, run_sequences
from homeostat.process.types import Cube, Indices, Table, Vec
from homeostat.stl.formula import Formula, parse

NAN = math.nan


class Vessel:
    """What a sequence needs of a process model: a vessel with an inlet and an outlet, and an instrument with an error.

    level += speed (fill - drain) each second; the instrument shows level + error + noise.
    """

    states = ("level", "seen")
    parameters = ("speed", "error")
    inputs = ("fill", "drain")
    faults = ("leak",)
    shown: Mapping[str, int] = {"level": 1}

    def kernel(
        self, first: int, last: int, x: Table, p: Table, sev: Table, onset: Table, u: Cube, u_of: Indices, t0: float,
        begin: Indices, steps: int, stride: int, seeds: Indices, process: Vec, sensor: Vec, picks: Indices, out: Cube,
        broken_at: Vec, moves: Moves | None = None,
    ) -> None:  # fmt: skip
        """Advance the members."""
        for m in range(first, last):
            for k in range(begin[m], steps):
                fill, drain = u[u_of[m], k]
                leak = sev[m, 0] if t0 + k + 1 >= onset[m, 0] else 0.0
                x[m, 0] += p[m, 0] * (fill - drain) - leak
                noise = sensor[m] * math.sin(float(seeds[m]) + 12.9898 * (t0 + k + 1))
                x[m, 1] = x[m, 0] + p[m, 1] + noise
                out[m, k] = x[m, picks]
                if x[m, 0] < 0.0 and math.isnan(broken_at[m]):
                    broken_at[m] = t0 + k + 1


MODEL = Vessel()
START = np.array([1.0, 0.0])
"""The vessel is being filled."""


def batch(
    speeds: list[float], seconds: int, sequence_of: list[int] | None = None, errors: list[float] | None = None,
    noise: float = 0.0, level: float = 0.0, leak_s: float = math.inf,
) -> Batch:  # fmt: skip
    """One member per speed, all at ``level``."""
    count = len(speeds)
    shape = (count, 1)
    return Batch(
        state=np.full((count, 2), level), parameters=np.column_stack([speeds, errors or [0.0] * count]),
        severity=np.full(shape, 0.05), onset_s=np.full(shape, leak_s), inputs=np.empty((count, 0, 2)),
        input_of=np.array(sequence_of or [0] * count), start_s=100.0, steps=seconds, stride=1, record=(0, 1),
        seeds=np.arange(count), process_noise=np.zeros(count), sensor_noise=np.full(count, noise),
    )  # fmt: skip


def guard(text: str) -> Guard:
    """A guard in the rule language over the vessel's variables."""
    formula = parse(text)

    def holds(shown: Mapping[str, Vec]) -> NDArray[np.bool_]:
        return formula.holds_each({tag: shown[tag] for tag in formula.tags})

    return holds


def sequence(*steps: tuple[float, float], guards: tuple[str, ...] = (), rates: float = math.inf) -> InputSequence:
    """Steps of (fill, drain) behind ``guards``."""
    targets = np.array(steps)
    return InputSequence(targets, np.full_like(targets, rates), tuple(guard(g) for g in guards))


def run(what: Batch, *sequences: InputSequence, present: Vec = START) -> SequenceResult:
    return run_sequences(MODEL, what, sequences, present)  # type: ignore[arg-type]


FILL_AND_DRAIN = sequence((1.0, 0.0), (0.0, 1.0), (0.0, 0.0), guards=("level >= 4", "level <= 1"))


def test_each_member_goes_on_at_its_own_pace() -> None:
    """Speeds 1 and 2 per second: full after 4 and 2 seconds, empty 3 and 2 seconds later."""
    result = run(batch([1.0, 2.0], 9), FILL_AND_DRAIN)
    assert result.record[:, :, 0].tolist() == [
        [1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0, 1.0, 1.0],
        [2.0, 4.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    ]
    assert result.step.tolist() == [[0, 0, 0, 0, 1, 1, 1, 2, 2], [0, 0, 1, 1, 2, 2, 2, 2, 2]]
    assert result.inputs[0, :, 0].tolist() == [1.0] * 4 + [0.0] * 5
    assert result.inputs[1, :, 1].tolist() == [0.0, 0.0, 1.0, 1.0] + [0.0] * 5


def test_it_is_the_instrument_that_is_asked() -> None:
    """One instrument shows 2 too much: the vessel is taken for full at 2, and for empty when it is gone below zero."""
    result = run(batch([1.0, 1.0], 4, errors=[0.0, 2.0]), FILL_AND_DRAIN)
    assert result.record[:, -1, 0].tolist() == [4.0, 0.0]
    assert result.step.tolist() == [[0, 0, 0, 0], [0, 0, 1, 1]]


def test_a_guard_may_read_what_is_commanded() -> None:
    steps = sequence((0.0, 0.0), (0.0, 1.0), guards=("fill <= 0.5",), rates=0.25)
    result = run(batch([1.0], 4), steps)
    assert result.inputs[0, :, 0].tolist() == [0.75, 0.5, 0.25, 0.0]
    assert result.step[0].tolist() == [0, 0, 1, 1]


def test_a_guard_that_never_holds_is_waited_for_to_the_end() -> None:
    result = run(batch([1.0], 20), sequence((1.0, 0.0), (0.0, 0.0), guards=("level >= 21",)))
    assert result.step.max() == 0 and result.record[0, -1, 0] == 20.0


def test_one_step_per_second_even_where_the_next_guard_holds_at_once() -> None:
    steps = sequence((1.0, 0.0), (0.0, 0.0), (0.0, 1.0), guards=("true", "true"))
    assert run(batch([1.0], 4, level=5.0), steps).step[0].tolist() == [0, 1, 2, 2]


def test_members_follow_the_sequence_that_is_theirs() -> None:
    stay, drain = sequence((0.0, 0.0)), sequence((0.0, 1.0))
    result = run(batch([1.0, 1.0, 1.0], 3, [1, 0, 1], level=5.0), stay, drain)
    assert result.record[:, -1, 0].tolist() == [2.0, 5.0, 2.0]


def test_what_a_step_does_not_command_stays_as_it_is_and_goes_on_moving() -> None:
    """The drain is on its way to 1 when the next step begins, which commands only the inlet."""
    steps = sequence((NAN, 1.0), (0.0, NAN), guards=("drain >= 0.4",), rates=0.25)
    result = run(batch([0.0], 6), steps)
    assert result.step[0].tolist() == [0, 0, 1, 1, 1, 1]
    assert result.inputs[0, :, 0].tolist() == [1.0, 1.0, 0.75, 0.5, 0.25, 0.0], "not commanded before: as it was"
    assert result.inputs[0, :, 1].tolist() == [0.25, 0.5, 0.75, 1.0, 1.0, 1.0]


def test_a_step_may_change_the_rate_of_what_it_commands() -> None:
    targets = np.array([[0.0, 1.0], [0.0, 0.0]])
    rates = np.array([[math.inf, 0.25], [math.inf, 0.5]])
    result = run(batch([0.0], 5), InputSequence(targets, rates, (guard("drain >= 0.7"),)))
    assert result.inputs[0, :, 1].tolist() == [0.25, 0.5, 0.75, 0.25, 0.0]


def test_the_first_row_is_a_second_after_the_start_and_time_goes_on() -> None:
    """The leak begins at 103 s; the start is at 100 s."""
    result = run(batch([0.0], 4, level=1.0, leak_s=103.0), sequence((0.0, 0.0)))
    assert result.record[0, :, 0].tolist() == [1.0, 1.0, 0.95, pytest.approx(0.9)]


def test_the_batch_stays_what_it_was() -> None:
    what, present = batch([1.0, 2.0], 5), START.copy()
    run(what, FILL_AND_DRAIN, present=present)
    assert (what.state == 0.0).all() and present.tolist() == START.tolist()


def test_a_member_that_leaves_the_physical_world_is_named_with_its_time() -> None:
    with pytest.raises(ProcessError, match=r"member 1 left the physical world at t = 103 s .*level = -1"):
        run(batch([0.0, 1.0], 5, level=2.0), sequence((0.0, 1.0)))


def test_without_refusing_all_others_go_on() -> None:
    steps = sequence((0.0, 1.0), (0.0, 0.0), guards=("level <= 0.5",))
    result = run_sequences(MODEL, batch([0.25, 1.5], 8, level=2.25), [steps], START, refuse=False)  # type: ignore[arg-type]
    assert result.record[0, :, 0].tolist() == [2.0, 1.75, 1.5, 1.25, 1.0, 0.75, 0.5, 0.5]
    assert result.step[1].tolist() == [0, 0, 0, 0, 0, 0, 0, 0], "what is lost takes no step"
    assert np.isnan(result.record[1, 2:]).all()


# --- against an sequencer that stands beside each member --------------------------------------------------------

GUARDS = (
    "level >= 4",
    "level <= 1",
    "level >= 2 and fill <= 0.5",
    "true",
    "not (level <= 3)",
    "drain >= 0.3 or level >= 5",
)
SPEEDS = st.lists(st.sampled_from([0.25, 0.5, 1.0, 1.5]), min_size=1, max_size=5)
VALUES = st.sampled_from([0.0, 0.5, 1.0, NAN])
RATES = st.sampled_from([0.125, 0.25, math.inf])


@st.composite
def sequences(draw: st.DrawFn) -> tuple[InputSequence, tuple[Formula, ...]]:
    count = draw(st.integers(1, 4))
    texts = draw(st.lists(st.sampled_from(GUARDS), min_size=count - 1, max_size=count - 1))
    targets = np.array([[draw(VALUES), draw(VALUES)] for _ in range(count)])
    rates = np.array([[draw(RATES), draw(RATES)] for _ in range(count)])
    return InputSequence(targets, rates, tuple(guard(t) for t in texts)), tuple(parse(t) for t in texts)


def alone(
    what: Batch, member: int, steps: InputSequence, formulas: tuple[Formula, ...]
) -> tuple[Table, Table, list[int]]:
    """One member second by second: the kernel, and the guards as the plant's sequencer judges them."""
    x, now = what.state[member : member + 1].copy(), START.copy()
    target, rate, at = now.copy(), np.full(2, np.inf), 0
    states, inputs, steps_of = [], [], []

    def enter(step: int) -> None:
        for i in range(2):
            if not math.isnan(steps.targets[step, i]):
                target[i], rate[i] = steps.targets[step, i], steps.rates[step, i]

    enter(0)
    for k in range(what.steps):
        steps_of.append(at)
        for i in range(2):
            now[i] += min(max(target[i] - now[i], -rate[i]), rate[i])
        MODEL.kernel(
            0, 1, x, what.parameters[member : member + 1], what.severity[member : member + 1],
            what.onset_s[member : member + 1], now[None, None], np.array([0]), what.start_s + k, np.array([0]), 1, 1,
            what.seeds[member : member + 1], what.process_noise, what.sensor_noise[member : member + 1],
            np.empty(0, dtype=np.int64), np.empty((1, 1, 0)), np.full(1, NAN),
        )  # fmt: skip
        states.append(x[0].copy())
        inputs.append(now.copy())
        shown = {"level": float(x[0, 1]), "fill": float(now[0]), "drain": float(now[1])}
        if at < len(formulas) and formulas[at].holds(shown):
            at += 1
            enter(at)
    return np.array(states), np.array(inputs), steps_of


@settings(max_examples=150)
@given(SPEEDS, st.data(), sequences(), sequences(), st.sampled_from([0.0, 0.3]))
def test_every_member_does_what_an_executive_beside_it_would_do(
    speeds: list[float],
    data: st.DataObject,
    first: tuple[InputSequence, tuple[Formula, ...]],
    second: tuple[InputSequence, tuple[Formula, ...]],
    noise: float,
) -> None:
    both = (first, second)
    which = data.draw(st.lists(st.integers(0, 1), min_size=len(speeds), max_size=len(speeds)))
    # Far above empty, so that no member leaves the physical world; the instruments show 2 at the start.
    what = batch(speeds, 25, which, [-38.0] * len(speeds), noise, level=40.0)
    result = run(what, first[0], second[0])
    for member in range(len(speeds)):
        states, inputs, steps = alone(what, member, *both[which[member]])
        assert result.record[member].tobytes() == states.tobytes()
        assert result.inputs[member].tobytes() == inputs.tobytes()
        assert result.step[member].tolist() == steps


# --- against the plant ------------------------------------------------------------------------------------------


def test_a_member_that_is_the_plant_runs_the_batch_as_the_plant_does() -> None:
    """The same parameters and the same noise: second by second what the simulated plant does with its sequencer."""
    plant, seconds, seed = load_plant("mixing_module"), 400, 5
    sequencer = new_sequencer(plant)
    setting = scenario(plant, "none", seed, end_s=float(seconds))
    route, model, variables = sequencer.rest().then, plant.model, plant.description.variables
    entered: list[str] = []
    process = watch(open_process(plant, setting), sequencer.sample, lambda snapshot: entered.append(sequencer.state))
    assert len(set(entered)) >= 4, "the batch went on for a few steps"

    targets = np.full((len(route) + 1, len(model.inputs)), NAN)
    rates = np.full_like(targets, math.inf)
    for k, step in enumerate(route, start=1):
        for c in step.commands:
            i = model.inputs.index(variables[c.tag])
            targets[k, i], rates[k, i] = c.value, math.inf if c.rate is None else c.rate

    def judged(formula: Formula) -> Callable[[Mapping[str, Vec]], NDArray[np.bool_]]:
        return lambda shown: formula.holds_each({tag: shown[variables[tag]] for tag in formula.tags})

    parameters, one = plant.true_parameters(seed), np.ones(1)
    width = (1, len(model.faults))
    what = Batch(
        state=model.initial_state(parameters)[None], parameters=parameters[None], severity=np.zeros(width),
        onset_s=np.full(width, math.inf), inputs=np.empty((1, 0, len(model.inputs))), input_of=np.array([0]),
        start_s=0.0, steps=seconds, stride=1, record=(), seeds=np.array([noise_seed(seed, Stream.TRUTH_NOISE)]),
        process_noise=one, sensor_noise=one,
    )  # fmt: skip
    steps = InputSequence(targets, rates, tuple(judged(s.transition.guard) for s in route))
    result = run_sequences(model, what, [steps], plant.start)
    names = ["idle", *(s.target for s in route)]
    after = [*result.step[0].tolist()[1:]]
    assert [names[k] for k in after] == entered[:-1], "each state is entered in the same second"
    truth = process.truth().signals
    mine = model.truth(result.record, result.inputs)
    for tag, variable in variables.items():
        np.testing.assert_allclose(mine[variable], truth[tag], rtol=1e-9, atol=1e-12, err_msg=tag)


def test_when_steps_are_taken_is_told_for_each_member() -> None:
    step = np.array([[0, 0, 1, 1, 2], [0, 0, 0, 0, 0], [0, 1, 1, 1, 1]])
    result = SequenceResult(np.empty((3, 5, 0)), np.empty((3, 5, 0)), step, np.array([2, 1, 1]))
    assert result.taken(1).tolist() == [2.0, 5.0, 1.0], "the second member took it at the very end"
    assert result.taken(2).tolist() == [4.0, math.inf, math.inf]
