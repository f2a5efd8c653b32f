"""The guard on links that run in virtual time, honest and not: what is journalled is what arrives on the wire."""

from __future__ import annotations

import pytest

from homeostat.domain.events.trips import FallbackStands, Tripped
from homeostat.domain.events.writes import LeaseLost, LeaseTried, WriteEnded, WriteIntended, WriteResult
from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.guard import Guard
from homeostat.guard.parts import Attachment
from homeostat.guard.restart.memory import Memory
from homeostat.journal.encode import encode_fields
from homeostat.links.errors import LinkError
from homeostat.links.simulated import SimulatedLink
from tests.equipment.links.misbehaving.link import ByHand, LostHeartbeat, Misbehaving, Misbehaviour, NoLease
from tests.equipment.links.misbehaving.readings import (
    ALL,
    BrokenReading,
    Freeze,
    Lie,
    Marked,
    Missing,
    NoReadBack,
    NotANumber,
    OldValues,
    Silence,
    StuckClock,
    WrongClock,
)
from tests.equipment.links.misbehaving.writes import (
    Clamped,
    Disobedient,
    FailingWrite,
    HalfWrite,
    HangingWrite,
    Late,
    LateAnswer,
)
from tests.equipment.links.scripted import PlantScript, Push, ScriptedPlant, ScriptedTag
from tests.equipment.links.virtual import VirtualLink
from tests.guard.test_memory import Line
from tests.guard.vessel import DRAIN, PATIENT, RULES, Journal

HOT_S = 100.0
"""From here on the vessel is too hot [s]."""
T = frozenset({"T"})
SCRIPT = PlantScript(
    (
        ScriptedTag("T", 305.0, {"T.sp": 1.0, "X.cmd": 20.0}, lag_s=30.0, noise=0.3),
        ScriptedTag("Tx", 305.0, {"T.sp": 1.0, "X.cmd": 20.0}, lag_s=30.0, noise=0.3),
        ScriptedTag("L", 8.0, noise=0.02),
    ),
    {"T.sp": 310.0, "F.sp": 0.0, "V.man": None, "X.cmd": 1.0},
    end_s=400.0,
    pushes=(Push("T", 20.0, HOT_S), Push("Tx", 20.0, HOT_S)),
)


def run(*script: Misbehaviour) -> tuple[Guard, Journal, Misbehaving]:
    """A guard on the vessel until the end of its run."""
    link = Misbehaving(SimulatedLink(ScriptedPlant(SCRIPT)), script)
    journal = Journal()
    guard = Guard(RULES, Attachment(journal, lease=link), PATIENT)
    while not link.ended:
        snapshot = sample(link)  # which lets the time go on
        guard.tick(link.now_s, snapshot)
    return guard, journal, link


def sample(link: VirtualLink) -> Snapshot | None:
    try:
        return link.advance()
    except LinkError:
        return None


SCRIPTS: tuple[Misbehaviour | None, ...] = (
    None, Silence(90.0, 130.0), BrokenReading(90.0, 130.0), Freeze(ALL, 90.0), Freeze(T, 90.0), Lie("L", 1.0, 50.0),
    NotANumber(T, 90.0), Missing(T, 90.0), Marked(T, 90.0), OldValues(ALL, 90.0), StuckClock(90.0),
    WrongClock(-50.0, 90.0), WrongClock(1e6, 90.0), WrongClock(float("nan"), 90.0), NoReadBack(ALL, 50.0),
    HangingWrite(50.0), HangingWrite(50.0, delivered=True), FailingWrite(50.0, count=1),
    FailingWrite(50.0, raises=False), HalfWrite(1, 50.0), Disobedient(frozenset({"F.sp"}), 50.0),
    Disobedient(ALL, 50.0, pretends=True),
    Clamped("V.man", 0.0, 0.5, 50.0), Late(5.0, 50.0), LateAnswer(5.0, 50.0), ByHand("T.sp", 309.0, 50.0),
)  # fmt: skip


@pytest.mark.parametrize("misbehaviour", SCRIPTS, ids=repr)
def test_attempts_in_the_journal_are_what_was_handed_to_the_wire(misbehaviour: Misbehaviour | None) -> None:
    _, journal, link = run(*([misbehaviour] if misbehaviour else []))
    attempts = [(at_s, e.commands) for e, at_s in journal.events if isinstance(e, WriteIntended)]
    assert attempts == [(a.at_s, a.commands) for a in link.wire_log]


@pytest.mark.parametrize("misbehaviour", SCRIPTS, ids=repr)
def test_a_vessel_that_gets_hot_trips_and_the_fallback_is_sent(misbehaviour: Misbehaviour | None) -> None:
    guard, journal, link = run(*([misbehaviour] if misbehaviour else []))
    tripped = [at_s for e, at_s in journal.events if isinstance(e, Tripped)]
    assert tripped and tripped[0] <= HOT_S + 45.0 and guard.latched is not None
    sent = [a.at_s for a in link.wire_log if a.commands == DRAIN.actions.commands]
    assert sent and sent[0] == tripped[0]


def test_an_honest_plant_is_brought_to_rest() -> None:
    _, journal, link = run()
    assert len(journal.of(FallbackStands)) == 1
    assert [c for a in link.wire_log for c in a.commands][-3:] == list(DRAIN.actions.commands)


def test_a_guard_whose_heartbeat_gets_lost_takes_the_lease_again_and_writes_on_no_lost_wire() -> None:
    guard, journal, link = run(LostHeartbeat(50.0, 125.0))
    assert [at_s for e, at_s in journal.events if isinstance(e, LeaseLost)] == [55.0]
    assert [e.given for e in journal.of(LeaseTried)] == [True]
    assert [e.commands for e in journal.of(WriteIntended)] == [a.commands for a in link.wire_log]
    assert [e.result for e in journal.of(WriteEnded)] == [WriteResult.ACCEPTED] * 2
    assert DRAIN.actions.commands in [a.commands for a in link.wire_log] and guard.latched is not None


def test_a_plant_that_gives_no_lease_is_observed() -> None:
    guard, _, link = run(NoLease(0.0))
    assert guard.mode is Mode.OBSERVE and link.wire_log == () and "mode" in {a.id for a in guard.alarms}


def test_a_fallback_that_stood_when_the_plant_shed_is_put_right_on_a_new_lease() -> None:
    guard, journal, link = run(LostHeartbeat(150.0, 155.5))
    assert [at_s for e, at_s in journal.events if isinstance(e, LeaseLost)] == [155.0]
    assert link.wire_log[-1].commands == (Command("V.man", 1.0, 0.2),)
    assert guard.out_of_service == frozenset() and {"latched"} <= {a.id for a in guard.alarms if a.returned_s is None}


def test_a_lease_that_is_refused_for_a_while_is_had_again_with_nobody_s_help() -> None:
    guard, journal, _ = run(LostHeartbeat(20.0, 25.5), NoLease(25.0, 60.0))
    assert [e.given for e in journal.of(LeaseTried)] == [False] * 5 + [True]
    assert guard.out_of_service == frozenset() and len(journal.of(FallbackStands)) == 1


def test_a_hand_during_a_fallback_stays_where_it_is() -> None:
    guard, _, link = run(Disobedient(frozenset({"F.sp"}), 50.0, 127.0), ByHand("V.man", 0.2, 123.0))
    assert guard.out_of_service == {"V.man"} and guard.latched is not None
    held = {c.tag: c.value for a in link.wire_log if a.at_s > 123.0 for c in a.commands}
    assert held == {"X.cmd": 0.0, "F.sp": 0.0}


def test_a_hand_while_the_guard_is_dead_is_a_person_and_the_plant_s_shed_is_not() -> None:
    link = Misbehaving(SimulatedLink(ScriptedPlant(SCRIPT)), (ByHand("V.man", 0.4, 2.0), ByHand("T.sp", 309.0, 70.0)))
    journal = Journal()
    guard = Guard(RULES, Attachment(journal, lease=link), PATIENT)
    while link.now_s < 60.0:
        snapshot = sample(link)
        guard.tick(link.now_s, snapshot)
    assert guard.out_of_service == {"V.man"}
    guard.mailbox.put(PersonCommand("o1", "Ada", Role.ENGINEER, Verb.IN_SERVICE, "V.man"))
    snapshot = sample(link)
    guard.tick(link.now_s, snapshot)
    while link.now_s < 75.0:
        sample(link)  # nobody beats
    assert link.shed
    memory = Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e, _ in journal.events)
    after = Journal()
    again = Guard(RULES, Attachment(after, lease=link, memory=memory), PATIENT)
    while link.now_s < 80.0:
        snapshot = sample(link)
        again.tick(link.now_s, snapshot)
    assert again.out_of_service == {"T.sp"} and {"moved:T.sp", "local"} <= {a.id for a in again.alarms}
