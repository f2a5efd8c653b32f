"""What guard and thinking tell each other arrives as it was sent, and thinking may say no more than it is there for."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.events.deviations import Missed, Strayed
from homeostat.domain.events.people import ModeEntered
from homeostat.domain.events.recovery import Noticed
from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.observation import (
    Arm,
    Correction,
    FallBack,
    Message,
    NoAction,
    Observation,
    Settled,
    StandBack,
    Trouble,
    Withdraw,
)
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath, Step
from homeostat.domain.request import Answer, Request, RequestStatus
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.requests.seal import Sealer, genuine
from homeostat.service.thinking.codec import Hello, Ready, Recorded, from_guard, from_thinking, to_guard, to_thinking
from tests.guard.vessel import MACHINE

TEXT = st.text(max_size=40)
SECONDS = st.floats(0.0, 1e6)
NAMES = st.lists(TEXT, max_size=4).map(tuple)
STEP = next(t for t in MACHINE.transitions)
MESSAGES = st.one_of(
    st.builds(Withdraw, TEXT, TEXT),
    st.builds(Arm, NAMES, st.none() | SECONDS),
    st.just(NoAction()),
    st.builds(Correction, st.lists(st.dictionaries(TEXT, st.floats(allow_nan=False)), max_size=3).map(tuple)),
    st.builds(FallBack, TEXT),
    st.builds(Trouble, TEXT, TEXT),
    st.builds(Settled, TEXT),
)
COMMANDS = st.lists(
    st.builds(Command, TEXT, st.none() | st.floats(-1e9, 1e9), st.none() | st.floats(1e-6, 1e6)),
    max_size=4,
    unique_by=lambda command: command.tag,
).map(tuple)


@given(MESSAGES)
def test_a_message_arrives_as_it_was_sent(message: Message) -> None:
    assert from_thinking(to_guard(message), MACHINE) == message


@given(COMMANDS, COMMANDS, TEXT, SECONDS)
def test_a_request_keeps_its_digest_and_its_seal(
    now: tuple[Command, ...], later: tuple[Command, ...], name: str, at_s: float
) -> None:
    actions = ActionSet(now, STEP.source, (Step(STEP, later),))
    unsealed = Request(name, "search", STEP.source, actions, (STEP.name,), "d", "c", None)  # type: ignore[arg-type]
    sealed = Sealer("release-check", b"k" * 32).seal(unsealed, at_s)
    got = from_thinking(to_guard(sealed), MACHINE)
    assert got == sealed and isinstance(got, Request)
    assert got.actions.digest == actions.digest and genuine(got, b"k" * 32)


def test_transitions_are_the_guards_own() -> None:
    actions = ActionSet((), STEP.source, (Step(STEP, ()),))
    request = Request("r", "p", STEP.source, actions, (), "", "", None)  # type: ignore[arg-type]
    frame = json.loads(to_guard(Sealer("i", b"k").seal(request, 1.0)))
    frame["then"][0][0] = "made up"
    with pytest.raises(LookupError, match="made up"):
        from_thinking(json.dumps(frame).encode(), MACHINE)


def test_an_observation_arrives_with_thinkings_own_machine() -> None:
    readings = Snapshot(3.0, {"T": math.inf, "X": 1.0}, frozenset({"T"}), reasons={"T": "wild"}, accepted={"X": None})
    seen = Observation(
        3.0, readings, STEP.source, ActionSet((), STEP.target, (Step(STEP, ()),)), RecoveryPath(MACHINE, (STEP,)), None,
        ((STEP.source, 2.0),), None, Mode.APPROVE, (Answer("r", RequestStatus.OFFERED, 3.0),), readings, 9.0,
    )  # fmt: skip
    frame = to_thinking(seen)
    got = from_guard(frame, MACHINE)
    assert got == seen and isinstance(got, Observation) and got.way is not None
    assert got.way.machine is MACHINE and got.rest.then[0].transition is STEP
    assert len(frame) < 2000, "machine and guards are not sent each second"


def test_events_of_recovery_are_journalled_and_what_a_guard_is_restored_from_is_not() -> None:
    for event in (Noticed(("SYM-1",)), Missed("ACC-T", -1.5, "K", 60.0), Strayed("LIM-T", 0.5, 1.5, "nearer")):
        recorded = Recorded(event, 12.0)
        assert from_thinking(to_guard(recorded), MACHINE) == recorded
    assert from_thinking(to_guard(Ready(7)), MACHINE) == Ready(7)
    with pytest.raises(LookupError):
        from_thinking(to_guard(Recorded(ModeEntered("closed-loop", "Mallory"), 1.0)), MACHINE)


@pytest.mark.parametrize("said", [PersonCommand("o", "M", Role.ENGINEER, Verb.MODE, "closed-loop"), StandBack("x")])
def test_thinking_speaks_for_no_person(said: Message) -> None:
    with pytest.raises(TypeError):
        to_guard(said)
    frame = json.dumps({"message": type(said).__name__, "fields": {}}).encode()
    with pytest.raises(LookupError):
        from_thinking(frame, MACHINE)


@given(st.binary(max_size=60) | st.recursive(st.none() | TEXT | st.integers(), lambda x: st.dictionaries(
    st.sampled_from(["event", "request", "message", "fields", "at_s", "then", "correction", "ready"]), x | st.lists(x)
)).map(lambda made: json.dumps(made).encode()))  # fmt: skip
def test_whatever_thinking_says_is_taken_or_refused(frame: bytes) -> None:
    try:
        said = from_thinking(frame, MACHINE)
    except (ValueError, TypeError, LookupError, AttributeError):
        return
    assert isinstance(said, Withdraw | Arm | NoAction | Correction | FallBack | Trouble | Settled | Ready | Recorded)


def test_the_first_word_is_the_key_and_the_configuration() -> None:
    assert from_guard(to_thinking(Hello(b"key", "c")), MACHINE) == Hello(b"key", "c")
