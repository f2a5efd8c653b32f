"""Later steps of a fallback that the plant was read not to hold: sent until they stand, also by the next life."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.guard import SequenceLoaded, StepTaken
from homeostat.domain.events.trips import FallbackActivated, FallbackStands, Shed, Tripped
from homeostat.domain.events.writes import WriteEnded, WriteIntended, WriteResult
from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.plant.rules import TripRule
from homeostat.domain.recovery import Command, Effect, FallbackStrategy, Step
from tests.guard.test_trial import killed
from tests.guard.vessel import CLOSE, DRAIN, LIMITS, MACHINE, RULES, TRIPS, Vessel, World, awaited, limit, running

COOL = awaited("cool", "shut", "emptying", "L <= 5")
MACHINE_2 = replace(MACHINE, transitions=(*MACHINE.transitions, COOL))
STEP = Step(COOL, (Command("F.sp", 0.0, 0.005), Command("V.man", 0.5, 0.2)))
TWO = replace(CLOSE, actions=replace(CLOSE.actions, then=(STEP,)))
RULES_2 = replace(RULES, machine=MACHINE_2, fallbacks=(TWO,))


class Deaf(Vessel):
    """A vessel that takes some commands and carries none of them out."""

    deaf: frozenset[str] = frozenset()

    def send(self, commands: tuple[Command, ...]) -> Any:
        held = {c.tag: self.accepted[c.tag] for c in commands if c.tag in self.deaf}
        answer = super().send(commands)
        self.accepted.update(held)
        return answer


def owing(ticks: int) -> World:
    """A fallback that stands, and whose later step the link has taken and the plant not."""
    vessel = Deaf()
    world = running(rules=RULES_2, vessel=vessel)
    world.tick(3, L=14.0)
    assert world.journal.of(FallbackStands)
    vessel.deaf = frozenset({"V.man"})
    world.tick(1, L=4.0)
    while not world.journal.of(StepTaken)[1:]:
        world.tick()
    world.tick(ticks)
    vessel.wire.clear()
    return world


def heal(world: World) -> None:
    assert isinstance(world.vessel, Deaf)
    world.vessel.deaf = frozenset()


@pytest.mark.parametrize("ticks", [0, 1, 3, 12, 19, 22, 24])
def test_a_later_step_that_is_owed_is_sent_again_after_a_death(ticks: int) -> None:
    world = owing(ticks)
    heal(world)
    world = killed(world, RULES_2)
    world.tick(25)
    assert world.vessel.accepted["V.man"] == 0.5 and STEP.commands in world.sent
    assert world.seen[-1].state == "emptying" and len(world.journal.of(FallbackActivated)) == 1
    sent = len(world.sent)
    world.tick(25)
    assert len(world.sent) == sent, "what stands is not sent again"


def test_it_is_sent_again_through_as_many_deaths_as_there_are() -> None:
    world = owing(1)
    for ticks in (2, 11, 13, 1):
        world = killed(world, RULES_2)
        world.tick(ticks)
    heal(world)
    world = killed(world, RULES_2)
    world.tick(25)
    assert world.vessel.accepted["V.man"] == 0.5
    assert len({e.write for e in world.journal.of(WriteIntended) if e.source == "cool"}) > 2


def test_a_step_of_a_strategy_that_was_given_up_is_not_sent_again() -> None:
    stated = {"LIM-FULL": Effect(6.0)}
    rules = replace(RULES_2, fallbacks=(replace(TWO, serves=stated), replace(DRAIN, serves=stated)))
    vessel = Deaf()
    world = running(rules=rules, vessel=vessel)
    world.tick(3, L=14.0)
    vessel.deaf = frozenset({"V.man"})
    world.tick(1, L=4.0)
    while not world.journal.of(StepTaken)[1:]:
        world.tick()
    world.tick(1, L=14.0)
    while [e.strategy for e in world.journal.of(FallbackActivated)] != ["close", "drain"]:
        world.tick()
    vessel.deaf = frozenset()
    vessel.wire.clear()
    world = killed(world, rules)
    world.tick(20, L=8.0)
    assert STEP.commands not in world.sent and world.vessel.accepted["V.man"] == 1.0


@pytest.mark.parametrize("before", [(), ("third",)])
def test_after_one_that_is_not_obeyed_one_that_serves_the_violated_limit_acts_then_the_others_then_the_shed(
    before: tuple[str, ...],
) -> None:
    def named(name: str, strategy: FallbackStrategy, *limits: str) -> FallbackStrategy:
        return replace(strategy, name=name, serves={limit: Effect(50.0) for limit in limits})

    first, hot = named("first", DRAIN, "LIM-FULL"), named("hot", CLOSE, "LIM-HOT")
    rules = replace(RULES, fallbacks=(first, hot, named("none", CLOSE), named("full", CLOSE, "LIM-FULL")))
    world = running(rules=rules)
    world.vessel.ignores = True
    world.tick(1, L=14.0)
    while "shed" not in world.alarms:
        world.tick()
        if before and len(world.journal.of(FallbackActivated)) == 2:
            world, before = killed(world, rules), ()
    found = [e.strategy for e in world.journal.of(FallbackActivated)]
    assert list(dict.fromkeys(found)) == ["first", "full", "hot", "none"]


def test_one_that_fails_its_checks_is_followed_by_one_that_serves_the_violated_limit() -> None:
    void = FallbackStrategy("void", replace(CLOSE.actions, target="nowhere"))
    serving = replace(CLOSE, name="full", serves={"LIM-FULL": Effect(50.0)})
    world = running(rules=replace(RULES, fallbacks=(void, DRAIN, serving)))
    world.tick(1, L=14.0)
    assert [e.strategy for e in world.journal.of(FallbackActivated)] == ["full"]


@pytest.mark.parametrize("how", ["silent", "hangs"])
def test_the_later_steps_of_a_fallback_follow_also_where_its_answer_comes_late(how: str) -> None:
    """One that the plant carries out without a word, and one that needs a second attempt."""
    world = running(rules=RULES_2)
    setattr(world.vessel, how, True)
    world.tick(1, L=14.0)
    while not world.sent:
        world.tick()
    assert world.journal.of(FallbackActivated) and not world.journal.of(SequenceLoaded)
    setattr(world.vessel, how, False)
    while not world.journal.of(FallbackStands):
        world.tick()
    loads = world.journal.of(SequenceLoaded)
    assert [(e.source, e.aborting, [s.transition for s in e.steps]) for e in loads] == [("close", True, ["cool"])]
    world.tick(6, L=4.0)
    assert world.vessel.accepted["V.man"] == 0.5 and world.seen[-1].state == "emptying"


def test_what_answers_the_limit_that_nothing_answers_yet_comes_before_what_would_help_against_more() -> None:
    """Two limits are answered when the third is violated."""
    warm = limit("LIM-WARM", LimitKind.TRIP_LIMIT, "Tx <= 330", hard=True)

    def named(name: str, *limits: str) -> FallbackStrategy:
        return replace(CLOSE, name=name, serves={limit: Effect(50.0) for limit in limits})

    rules = replace(
        RULES, limits=Limits((*LIMITS.limits, warm), ()), trips=TRIPS | {"LIM-WARM": TripRule("LIM-WARM", 8.0, 6.0)},
        fallbacks=(
            named("both", "LIM-FULL", "LIM-WARM"), named("again", "LIM-FULL", "LIM-WARM"), named("hot", "LIM-HOT"),
        ),
    )  # fmt: skip
    world = running(rules=rules)
    world.tick(6, L=13.5, Tx=340.0)
    assert [e.strategy for e in world.journal.of(FallbackActivated)] == ["both"] and world.journal.of(FallbackStands)
    assert {e.limit for e in world.journal.of(Tripped)} == {"LIM-FULL", "LIM-WARM"}
    while not world.journal.of(FallbackActivated)[1:]:
        world.tick(1, T=340.0)
    assert [(e.strategy, e.answers) for e in world.journal.of(FallbackActivated)[1:]] == [("hot", ("LIM-HOT",))]


def test_a_step_that_hangs_is_given_up_when_the_plant_is_left_to_its_own_control() -> None:
    rules = replace(RULES_2, fallbacks=(replace(TWO, serves={"LIM-HOT": Effect(8.0)}),))
    world = running(rules=rules)
    world.tick(13, T=340.0, Tx=340.0)
    world.vessel.hangs = True
    world.tick(1, L=4.0)
    while not world.journal.of(Shed):
        world.tick()
    ended = world.journal.of(WriteEnded)[-1]
    assert (ended.result, ended.detail) == (WriteResult.GIVEN_UP, "the plant's own control goes on")
