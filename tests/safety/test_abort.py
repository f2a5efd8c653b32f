"""Attacks on the fallback with later steps: it is begun once, in its order, and nothing keeps it from its end."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest

from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy, Step
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Approve
from homeostat.guard.gate import Gate, Overtaken
from homeostat.guard.sequencer import Sequencer
from tests.safety.world import BATCH, DRAIN, END, LIMITS, MACHINE, POUR, START, Bench, Says, reading, sequencer

EMPTYING = FallbackStrategy(
    "empty", ActionSet(POUR.commands, "emptying", (replace(END, commands=DRAIN.actions.commands),))
)
"""Pours the vessel out, and stops when it is empty."""
LOW = 0.5


class CatchingUp(Bench):
    """A plant in which seconds pass while commands are written, as the simulated one's do after thinking."""

    def __init__(self, *passing: Snapshot, reachable: bool = True) -> None:
        super().__init__(reading(), reachable=reachable)
        self._passing = passing
        self.sequencer: Sequencer = sequencer(LIMITS)

    async def write(self, commands: tuple[Command, ...]) -> None:
        for snapshot in self._passing:
            taken = self.sequencer.sample(snapshot)
            if taken:
                self.written.append(taken)
        await super().write(commands)


def gate_over(plant: CatchingUp, armed: FallbackStrategy = EMPTYING) -> Gate:
    gate = Gate(plant, LIMITS, DRAIN, Says(), plant.sequencer)
    gate.arm(armed)
    return gate


def test_a_later_step_never_overtakes_the_first_one() -> None:
    """The vessel is empty already: the step that stops everything is due the moment that it waits."""
    plant = CatchingUp(reading(101.0, L=LOW), reading(102.0, L=LOW))
    gate = gate_over(plant)
    asyncio.run(gate.fall_back("hot"))
    assert plant.written == [POUR.commands]
    assert plant.sequencer.sample(reading(103.0, L=LOW)) == DRAIN.actions.commands, "and is taken after it"
    assert plant.sequencer.state == "still"


def test_no_old_step_is_taken_while_a_release_is_written() -> None:
    plant = CatchingUp(reading(101.0, L=9.5))
    plant.sequencer.load(replace(BATCH, commands=()), 0.0)
    gate = gate_over(plant)
    asyncio.run(gate.release(BATCH, Approve(BATCH.digest, ()), 0.0, "running"))
    assert plant.written == [BATCH.commands] and plant.sequencer.state == "running"


def test_falling_back_again_does_not_begin_again() -> None:
    plant = CatchingUp()
    gate = gate_over(plant)
    asyncio.run(gate.fall_back("hot"))
    plant.sequencer.sample(reading(101.0, L=LOW))
    written = list(plant.written)
    assert asyncio.run(gate.fall_back("a bug")) == EMPTYING
    assert plant.written == written and plant.sequencer.state == "still" and gate.latched == "hot"


def test_falling_back_again_is_tried_again_where_it_was_not_written() -> None:
    plant = CatchingUp(reachable=False)
    gate = gate_over(plant)
    with pytest.raises(ConnectionError):
        asyncio.run(gate.fall_back("hot"))
    plant._reachable = True
    asyncio.run(gate.fall_back("hot"))
    assert plant.written == [POUR.commands] and plant.sequencer.rest().then == EMPTYING.actions.then


def test_nothing_is_begun_that_nobody_will_end() -> None:
    """At a shutdown nobody will be there to take the later steps."""
    plant = CatchingUp()
    gate = gate_over(plant)
    assert asyncio.run(gate.fall_back("shut down", unattended=True)) == DRAIN == gate.armed
    assert plant.written == [DRAIN.actions.commands] and plant.sequencer.rest().then == ()


def test_what_nobody_will_end_is_ended_now() -> None:
    plant = CatchingUp()
    gate = gate_over(plant)
    asyncio.run(gate.fall_back("hot"))
    asyncio.run(gate.fall_back("shut down", unattended=True))
    assert plant.written == [POUR.commands, DRAIN.actions.commands] and plant.sequencer.state == "still"


def test_what_has_ended_is_left_at_a_shutdown() -> None:
    plant = CatchingUp()
    gate = gate_over(plant)
    asyncio.run(gate.fall_back("hot"))
    plant.sequencer.sample(reading(101.0, L=LOW))
    asyncio.run(gate.fall_back("shut down", unattended=True))
    assert plant.written == [POUR.commands]


def test_a_strategy_without_later_steps_is_good_enough_for_a_shutdown() -> None:
    plant = CatchingUp()
    gate = gate_over(plant, replace(DRAIN, name="better"))
    assert asyncio.run(gate.fall_back("shut down", unattended=True)).name == "better"


def test_the_first_strategy_must_be_done_when_it_is_written() -> None:
    with pytest.raises(ValueError, match="'empty' has later steps"):
        Gate(Bench(), LIMITS, EMPTYING, Says(), sequencer(LIMITS))


def test_no_permissive_forbids_what_leads_to_a_safe_state() -> None:
    """The vessel is too full for a release, and one transmitter is bad: it is stopped all the same."""
    subject = sequencer(LIMITS)
    high = replace(EMPTYING.actions, then=(POUR, replace(END, commands=DRAIN.actions.commands)))
    subject.load(replace(high, target="running"), 0.0, aborting=True)
    assert subject.sample(reading(101.0, L=12.0)) == POUR.commands and subject.refused is None
    subject.load(replace(high, target="running"), 0.0)
    assert subject.sample(reading(102.0, L=12.0)) == () and subject.refused is not None, "a batch is forbidden it"


def test_a_release_in_a_state_that_the_plant_has_left_is_overtaken() -> None:
    plant = CatchingUp()
    plant.sequencer.load(ActionSet((), "emptying"), 0.0)
    gate = gate_over(plant)
    with pytest.raises(Overtaken, match="from 'running' to 'emptying'"):
        asyncio.run(gate.release(BATCH, Approve(BATCH.digest, ()), 0.0, "running"))
    assert plant.written == [] and plant.sequencer.state == "emptying" and gate.latched is None
    assert MACHINE.state("emptying").recovery_target


def test_no_old_step_is_taken_while_a_fallback_is_written() -> None:
    plant = CatchingUp(reading(101.0, L=9.5))
    plant.sequencer.load(replace(BATCH, commands=()), 0.0)
    asyncio.run(gate_over(plant, replace(DRAIN, name="better")).fall_back("hot"))
    assert plant.written == [DRAIN.actions.commands] and plant.sequencer.state == "still"


def test_no_permissive_forbids_the_steps_of_a_fallback_that_acted() -> None:
    plant = CatchingUp()
    long = FallbackStrategy("long", ActionSet(DRAIN.actions.commands, "running", (POUR, END)))
    asyncio.run(gate_over(plant, long).fall_back("hot"))
    assert plant.sequencer.sample(reading(101.0, L=12.0)) == POUR.commands


def test_a_permissive_forbids_a_nominal_step_from_the_start() -> None:
    subject = sequencer(LIMITS, Step(START, (Command("F.sp", 0.03, 0.005),)))
    assert subject.sample(reading(1.0, L=12.0)) == () and subject.refused is not None
