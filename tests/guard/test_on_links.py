"""The guard on links that run in virtual time, honest and not: what is journalled is what arrives on the wire."""

from __future__ import annotations

import pytest

from homeostat.domain.guard_events import (
    FallbackStands,
    LeaseLost,
    LeaseTried,
    Tripped,
    WriteEnded,
    WriteIntended,
    WriteResult,
)
from homeostat.domain.mode import Mode
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.guard import Attachment, Guard
from homeostat.links.bad_readings import (
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
from homeostat.links.bad_writes import Clamped, Disobedient, FailingWrite, HalfWrite, HangingWrite, Late, LateAnswer
from homeostat.links.errors import LinkError
from homeostat.links.misbehaving import ByHand, LostHeartbeat, Misbehaving, Misbehaviour, NoLease
from homeostat.links.scripted import PlantScript, Push, ScriptedPlant, ScriptedTag
from homeostat.links.simulated import SimulatedLink
from homeostat.links.virtual import Link
from tests.guard.vessel import DRAIN, PATIENT, RULES, Journal

HOT_S = 100.0
"""From here on the vessel is too hot [s]."""
T = frozenset({"T"})
SCRIPT = PlantScript(
    (
        ScriptedTag("T", 305.0, {"T.sp": 1.0}, lag_s=30.0, noise=0.3),
        ScriptedTag("Tx", 305.0, {"T.sp": 1.0}, lag_s=30.0, noise=0.3),
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


def sample(link: Link) -> Snapshot | None:
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
