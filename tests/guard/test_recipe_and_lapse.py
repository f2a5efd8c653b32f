"""The plant's own recipe beside what the guard has released: steps that are owed, lost leases, hands, and start-up."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.events.guard import SequenceLoaded, StartUpBegan
from homeostat.domain.events.people import ServiceChanged
from homeostat.domain.events.writes import WriteIntended
from homeostat.domain.mode import Mode, Side, Verb
from homeostat.domain.plant.state_machine import SetpointRange
from homeostat.guard.restart.memory import Memory
from homeostat.journal.encode import encode_fields
from tests.guard.test_lapse import MORE, Sheds, causes
from tests.guard.test_memory import Line
from tests.guard.test_recipe import begun, pours
from tests.guard.vessel import BEGIN, MACHINE, POUR, ROUTE, RULES, Journal, World, state, statuses

PLANTS = replace(RULES, recipe=Side.PLANT, nominal=(BEGIN, POUR))


def released() -> World:
    """A request has been written whose later step, to pour, waits; its plant runs the recipe."""
    world = begun()
    world.ask(world.request(actions=ROUTE, path=("adjust", "empty")))
    world.tick(3)
    assert statuses(world)[-1] == "confirmed" and world.guard.carries
    world.vessel.wire.clear()
    return world


def times(world: World) -> list[float]:
    return [at_s for at_s, _ in world.vessel.wire]


def test_the_last_step_that_was_released_is_owed_until_the_plant_holds_it_and_its_recipe_waits_so_long() -> None:
    world = released()
    world.vessel.ignores = True
    world.tick(7, L=9.5)
    assert times(world) == [9.0, 11.0, 13.0] and "write:sequence" in world.alarms
    world.vessel.ignores = False
    world.tick(9)
    assert len(world.sent) == 3 and world.guard.carries and world.seen[-1].state == "emptying"
    world.tick(2)
    assert times(world)[3:] == [25.0] and world.vessel.accepted["V.man"] == 1.0
    assert not world.guard.carries and world.alarms == set()


@pytest.mark.parametrize(("mode", "sent", "stands"), [(Mode.APPROVE, 2, "emptying"), (Mode.OBSERVE, 1, "running")])
def test_a_step_that_a_change_of_the_mode_overtakes_is_sent_again_where_somebody_writes(
    mode: Mode, sent: int, stands: str
) -> None:
    world = released()
    world.vessel.ignores = True
    world.tick(1, L=9.5)
    world.vessel.ignores = False
    world.order(Verb.MODE, mode.value)
    world.tick(4)
    assert world.sent == [POUR.commands] * sent and not world.guard.carries
    assert world.seen[-1].state == stands


def test_what_the_plant_does_while_nobody_writes_ends_what_was_owed_to_it() -> None:
    world = released()
    world.vessel.ignores = True
    world.tick(1, L=9.5)
    world.order(Verb.MODE, Mode.OBSERVE.value)
    world.tick(2)
    world.vessel.ignores = False
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(20)
    assert world.sent == [POUR.commands] and not world.guard.carries


def lapsed(world: World) -> Sheds:
    """The plant says that the lease is over, and somebody else has it."""
    assert isinstance(world.vessel, Sheds)
    world.vessel.tells = world.vessel.keeps = True
    world.vessel.shed()
    return world.vessel


def in_recipe() -> tuple[World, Sheds]:
    """A plant that runs its own recipe and has come to feed, under a guard that holds the lease."""
    world = World(rules=PLANTS, vessel=Sheds())
    world.tick(3, L=4.0)
    world.vessel.accepted["F.sp"] = 0.03
    world.tick(2, L=6.0)
    assert world.seen[-1].state == "running"
    return world, lapsed(world)


def test_a_recipe_that_goes_on_while_the_lease_is_lost_is_followed_and_taken_over_by_nobody() -> None:
    world, vessel = in_recipe()
    world.tick(20)
    pours(world)
    assert world.seen[-1].state == "emptying" and "heartbeat" in world.alarms
    vessel.keeps = False
    world.tick(80)
    assert "heartbeat" not in world.alarms and world.guard.out_of_service == frozenset()
    assert [c for c in causes(world, "local") if "F.sp from 0.03 to 0, V.man from automatic to 1" in c]
    assert [c for c in causes(world, "local") if c.endswith("its own recipe goes on, followed in state 'emptying'")]
    vessel.accepted["F.sp"] = 0.0
    world.tick(3, L=0.5)
    assert world.seen[-1].state == "rest" and world.sent == [] and not world.guard.carries


def test_where_the_plant_stands_nowhere_after_a_lapse_its_recipe_is_followed_once_it_stands_somewhere() -> None:
    world, vessel = in_recipe()
    vessel.keeps = False
    vessel.void = False
    pours(world)
    vessel.shed()  # its valve goes back to automatic, which no state but those before admits
    world.tick(3)
    assert [c for c in causes(world, "local") if "its own recipe goes on" in c]
    assert world.seen[-1].state == "emptying"
    vessel.accepted["V.man"] = 1.0
    world.tick(2, L=0.5)
    assert world.seen[-1].state == "rest" and world.sent == []


def test_a_step_that_was_released_and_that_the_plant_took_during_a_lapse_is_still_the_guards() -> None:
    vessel = Sheds()
    world = World(rules=PLANTS, vessel=vessel)
    world.tick(3, L=4.0)
    vessel.accepted["F.sp"] = 0.03
    world.tick(2, L=6.0)
    world.ask(world.request(actions=ROUTE, path=("adjust", "empty")))
    world.tick(3)
    vessel.wire.clear()
    lapsed(world)
    world.tick(5)
    pours(world)
    assert world.seen[-1].state == "running" and world.seen[-1].refused is not None, "it cannot be written"
    vessel.keeps = False
    world.tick(15)
    assert world.seen[-1].state == "emptying" and world.sent == [POUR.commands]
    assert world.guard.out_of_service == frozenset() and not world.guard.carries


@pytest.mark.parametrize("mode", [Mode.OBSERVE, Mode.CLOSED_LOOP])
def test_a_hand_in_the_very_second_of_a_step_of_the_recipe_is_told_from_it(mode: Mode) -> None:
    world = begun(mode)
    world.vessel.accepted["T.sp"] = 305.0
    pours(world)
    assert world.seen[-1].state == "emptying" and world.guard.out_of_service == {"T.sp"}
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(3)
    assert world.guard.out_of_service == {"T.sp"} and world.vessel.accepted["T.sp"] == 305.0 and world.sent == []
    assert [e.tag for e in world.journal.of(ServiceChanged)] == ["T.sp"]


def hot(world: World) -> None:
    """More than 313 K is ordinary only while a vessel starts."""
    world.tick(15, T=316.0, Tx=316.0)


def emptied() -> World:
    """The lease is lost while the vessel is emptied; its valve goes to automatic, and a state of start-up fits."""
    world = World(vessel=Sheds(), rules=replace(MORE, machine=TOLD_APART))
    world.tick(4)
    world.tick(4, L=9.5)
    world.tick(2, L=3.0)
    vessel = lapsed(world)
    vessel.keeps = False
    world.tick(3)
    assert world.seen[-1].state == "waiting" and world.journal.of(SequenceLoaded)[-1].source == "local control"
    return world


def restarted(world: World) -> World:
    memory = Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e, _ in world.journal.events)
    return World(
        vessel=world.vessel,
        rules=replace(MORE, machine=TOLD_APART),
        memory=memory,
        record=Journal(world.journal.events),
    )


@pytest.mark.parametrize("dies", [False, True])
def test_a_state_of_start_up_that_a_lapse_leads_to_gives_no_wider_limits(dies: bool) -> None:
    world = emptied()
    if dies:
        world = restarted(world)
        world.tick(2)
    assert len(world.journal.of(StartUpBegan)) == 1, "nobody has started anything"
    hot(world)
    assert world.guard.latched is not None and "LIM-HOT" in world.guard.latched


FED = state(
    "running", SetpointRange("T.sp", 298.0, 312.0, 310.0), SetpointRange("F.sp", 0.01, 0.05, 0.03),
    SetpointRange("V.man", 0.0, 1.0, None), SetpointRange("X.cmd", 1.0, 1.0, 1.0), target=True,
)  # fmt: skip
REST = state("rest", SetpointRange("F.sp", 0.0, 0.0, 0.0), target=True, settled="L <= 1")
TOLD_APART = replace(MACHINE, states=tuple({"running": FED, "rest": REST}.get(s.name, s) for s in MACHINE.states))
"""A vessel in which no two states fit the same targets."""


@pytest.mark.parametrize("dies", [False, True])
@pytest.mark.parametrize("mode", [Mode.OBSERVE, Mode.CLOSED_LOOP])
def test_a_state_of_start_up_that_the_plant_is_found_in_gives_no_wider_limits(mode: Mode, dies: bool) -> None:
    rules = replace(PLANTS, machine=TOLD_APART)
    world = World(mode=mode, rules=rules)
    world.tick(2, L=4.0)
    world.vessel.accepted["F.sp"] = 0.03
    world.tick(2, L=6.0)
    assert world.seen[-1].state == "running"
    world.vessel.accepted["F.sp"] = 0.0
    world.tick(2, L=3.0)
    assert world.seen[-1].state == "waiting"
    if dies:
        memory = Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e, _ in world.journal.events)
        world = World(mode=mode, rules=rules, vessel=world.vessel, memory=memory, record=Journal(world.journal.events))
    hot(world)
    assert "trip:LIM-HOT" in world.alarms and len(world.journal.of(StartUpBegan)) == 1
    assert (world.guard.latched is not None) is mode.writes


def test_the_start_up_of_a_recipe_that_the_plant_runs_has_its_limits() -> None:
    world = World(mode=Mode.OBSERVE, rules=replace(PLANTS, machine=TOLD_APART))
    world.tick(2, L=3.0)
    hot(world)
    assert world.alarms == set() and world.sent == [] and world.journal.of(WriteIntended) == []


def test_a_lease_that_is_lost_soon_after_it_was_given_back_excuses_no_hand() -> None:
    world = World(vessel=Sheds())
    world.tick(4)
    world.order(Verb.MODE, Mode.OBSERVE.value)
    world.tick()
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick()
    vessel = lapsed(world)
    world.tick()
    vessel.accepted["T.sp"] = 305.0
    world.tick()
    assert world.guard.out_of_service == {"T.sp"} and "moved:T.sp" in world.alarms
