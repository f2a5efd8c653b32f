"""The sequencer: what is due, what keeps it back, what is left of it, and what follows by itself."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.sequence.sequencer import Sequencer, nominal_route, under_way, what_follows
from tests.guard.vessel import BEGIN, LIMITS, MACHINE, POUR, STATES, awaited, decided, state

pytestmark = pytest.mark.quick


def sequencer(*nominal: Step) -> Sequencer:
    return Sequencer(MACHINE, LIMITS, nominal)


def plant(at_s: float = 1.0, **values: float) -> Snapshot:
    """A sample of a vessel that is ready to begin."""
    told = {"L": 8.0, "F.sp": 0.0, "X.cmd": 1.0} | {tag.replace("_", "."): v for tag, v in values.items()}
    return Snapshot(at_s, told)


SHUT_OFF = plant(X_cmd=0.0)
"""PRM-OPEN forbids a feed."""


def test_where_nothing_waits_nothing_is_due() -> None:
    s = sequencer()
    assert s.due(plant()) is None and s.way() is None and s.waiting == ()
    assert s.sample(plant()) == () and s.rest() == ActionSet((), "waiting")
    with pytest.raises(ValueError, match="step 'start' is not the one that waits"):
        s.take(BEGIN, 1.0)


def test_the_first_step_is_due_when_its_guard_holds_and_only_it_can_be_taken() -> None:
    s = sequencer(BEGIN, POUR)
    assert s.due(plant(L=4.9)) is None and s.refused is None
    assert s.due(plant(L=9.5)) == BEGIN and s.waiting == (BEGIN, POUR)
    with pytest.raises(ValueError, match="'empty' is not the one that waits"):
        s.take(POUR, 1.0)
    s.take(BEGIN, 1.5)
    assert s.state == "running" and s.waiting == (POUR,) and s.rest() == ActionSet(BEGIN.commands, "running", (POUR,))
    assert s.drain() == (("running", 1.5),) and s.drain() == ()


def test_a_permissive_keeps_a_step_back_until_it_holds_and_says_so_no_longer_than_that() -> None:
    s = sequencer(BEGIN)
    assert s.due(SHUT_OFF) is None
    assert s.refused is not None and "PRM-OPEN" in s.refused
    assert s.due(plant(L=4.0, X_cmd=0.0)) is None and s.refused is None  # its guard does not hold any more
    s.due(SHUT_OFF)
    assert s.due(plant()) == BEGIN and s.refused is None
    s.due(SHUT_OFF)
    s.stop()
    assert s.refused is None and s.due(SHUT_OFF) is None and s.refused is None


@pytest.mark.parametrize(("aborting", "due"), [({}, False), ({"aborting": False}, False), ({"aborting": True}, True)])
def test_no_permissive_forbids_a_step_of_a_fallback(aborting: dict[str, bool], due: bool) -> None:
    s = sequencer()
    s.load(ActionSet((), "waiting", (BEGIN,)), 1.0, **aborting)
    assert (s.due(SHUT_OFF) == BEGIN) is due is (s.refused is None)
    s = sequencer()
    s.restore("waiting", (BEGIN,), aborting=bool(aborting.get("aborting")))
    assert (s.due(SHUT_OFF) == BEGIN) is due
    s.load(ActionSet((), "waiting", (BEGIN,)), 2.0)  # what is released after a fallback is no fallback
    assert s.due(SHUT_OFF) is None


def test_what_is_loaded_is_entered_once() -> None:
    s = sequencer(BEGIN)
    s.load(ActionSet(POUR.commands, "running", (POUR,)), 3.0)
    s.load(ActionSet(POUR.commands, "running", ()), 4.0)
    assert s.state == "running" and s.waiting == () and s.drain() == (("running", 3.0),)


def test_a_recipe_inside_a_plant_is_commanded_and_entered_at_once() -> None:
    s = sequencer(BEGIN, POUR)
    assert s.sample(plant(1.0, L=4.0)) == () and s.state == "waiting"
    assert s.sample(plant(2.0)) == BEGIN.commands
    assert s.sample(plant(3.0, L=9.5)) == POUR.commands
    assert s.drain() == (("running", 2.0), ("emptying", 3.0)) and s.waiting == ()


def test_a_journal_that_names_an_unknown_state_is_not_followed() -> None:
    s = sequencer(BEGIN)
    with pytest.raises(ValueError, match="no state 'nowhere'"):
        s.restore("nowhere", (), aborting=False)
    assert s.state == "waiting" and s.waiting == (BEGIN,)


def test_the_way_is_the_path_that_is_left_where_a_proposer_could_take_it() -> None:
    s = sequencer(BEGIN, POUR)
    way = s.way()
    assert way is not None and way.states == ("waiting", "running", "emptying")
    assert sequencer(POUR, BEGIN).way() is None  # as the steps of a fallback may stand


@pytest.mark.parametrize(
    ("command", "before", "now", "goes_on"),
    [
        (Command("T", 300.0, 0.5), 310.0, 309.0, True),
        (Command("T", 300.0, 0.5), 290.0, 291.0, True),
        (Command("T", 300.0, 0.5), 290.0, 300.25, True),
        (Command("T", 300.0, 0.5), 310.0, 310.0, False),
        (Command("T", 300.0, 0.5), 309.0, 310.0, False),
        (Command("T", 300.0, 0.5), 300.5, 300.0, False),
        (Command("T", 300.0, 0.5), 310.0, None, False),
        (Command("T", 300.0, 0.5), None, 309.0, False),
        (Command("T", 300.0, 0.5), 310.0, float("nan"), False),
        (Command("T", 300.0, None), 310.0, 309.0, False),
        (Command("T", None, None), 310.0, 309.0, False),
        (Command("T", None, 0.5), 310.0, 309.0, False),
    ],
)
def test_a_ramp_is_under_way_while_the_reading_comes_nearer(
    command: Command, before: float | None, now: float | None, goes_on: bool
) -> None:
    first, second = (Snapshot(1.0, {} if v is None else {"T": v}) for v in (before, now))
    assert under_way((command,), second, first) == ((command,) if goes_on else ())
    assert under_way((command,), second, None) == ()


def test_what_is_left_to_do_names_the_ramps_that_go_on() -> None:
    s = sequencer(BEGIN)
    s.due(plant(1.0))
    s.take(BEGIN, 1.0)
    for at_s, flow, left in ((2.0, 0.01, BEGIN.commands), (3.0, 0.02, BEGIN.commands), (4.0, 0.03, ())):
        s.due(plant(at_s, F_sp=flow))
        assert s.rest().commands == left


BY_STATE = {s.name: (Command("F.sp", 0.01 * k, 0.005),) for k, s in enumerate(STATES)}


def names(steps: tuple[Step, ...]) -> list[str]:
    return [step.transition.name for step in steps]


def test_what_follows_by_itself_is_decided_by_nobody() -> None:
    steps = nominal_route(MACHINE, BY_STATE)
    assert names(steps) == ["start", "empty", "end"]
    assert [step.commands for step in steps] == [BY_STATE["running"], BY_STATE["emptying"], BY_STATE["rest"]]
    assert names(what_follows(MACHINE, "emptying", BY_STATE)) == ["end"]
    assert what_follows(MACHINE, "shut", BY_STATE) == ()


def test_of_several_ways_the_least_risky_one_is_followed_and_none_twice() -> None:
    states = tuple(
        replace(state(name, initial=name == "a"), risk=risk) for name, risk in (("a", 0), ("b", 2), ("c", 1))
    )
    machine = StateMachine(
        "loop", states,
        (
            awaited("a-b", "a", "b", "true"), awaited("a-c", "a", "c", "true"), decided("c-b", "c", "b"),
            awaited("c-a", "c", "a", "true"), awaited("c-c", "c", "c", "true"),
        ),
    )  # fmt: skip
    by_state: dict[str, tuple[Command, ...]] = {"a": (), "b": (), "c": ()}
    assert names(nominal_route(machine, by_state)) == ["a-c"]
    assert names(what_follows(machine, "c", by_state)) == ["c-a", "a-b"]


def test_of_the_states_that_were_entered_the_last_one_counts() -> None:
    own = Sequencer(MACHINE, LIMITS)
    assert own.entered is None
    own.load(ActionSet((), "running"), 1.0)
    own.load(ActionSet((), "shut"), 1.0)
    assert own.entered == "shut" and own.drain() == (("running", 1.0), ("shut", 1.0)) and own.entered is None
