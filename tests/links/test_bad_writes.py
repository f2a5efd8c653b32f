"""Links that do not obey: each way in which a write goes wrong, and people who interfere."""

from __future__ import annotations

import pytest

from homeostat.domain.recovery import Command
from homeostat.links.errors import LeaseVoid, LinkError
from homeostat.links.simulated import SimulatedLink
from tests.contracts.link import Handles, LinkContract, Open, read
from tests.equipment.links.misbehaving.link import ByHand, LostHeartbeat, Misbehaving, NoLease
from tests.equipment.links.misbehaving.writes import (
    BadWrite,
    Clamped,
    Disobedient,
    FailingWrite,
    HalfWrite,
    HangingWrite,
    Late,
    LateAnswer,
)
from tests.links import test_simulated_link
from tests.links.tank import misbehaving, tank

SET = (Command("L.sp", 12.0, None), Command("cool.man", 0.5, None))
BEFORE = {"L.sp": 10.0, "cool.man": None}
AFTER = {"L.sp": 12.0, "cool.man": 0.5}
HALF = {"L.sp": 12.0, "cool.man": None}


class TestMisbehavingWithoutScript(LinkContract):
    @pytest.fixture
    def opened(self) -> Open:
        return lambda: Misbehaving(SimulatedLink(test_simulated_link.process()), ())

    @pytest.fixture
    def handles(self) -> Handles:
        return test_simulated_link.HANDLES


def accepted(link: Misbehaving) -> dict[str, float | None]:
    """What the plant says that it has accepted, one second later."""
    return dict(read(link)[0].accepted)


@pytest.mark.parametrize("delivered", [False, True])
def test_a_hanging_write_is_never_answered(delivered: bool) -> None:
    link, beneath = misbehaving(HangingWrite(0.0, delivered=delivered))
    ticket = link.take().send(SET)
    assert accepted(link) == (AFTER if delivered else BEFORE)
    read(link, 100)
    assert not ticket.done and len(beneath.wire_log) == delivered


@pytest.mark.parametrize(("count", "stands"), [(0, BEFORE), (1, HALF), (None, AFTER)])
@pytest.mark.parametrize("raises", [False, True])
def test_a_failing_write_leaves_what_had_arrived(
    count: int | None, stands: dict[str, float | None], raises: bool
) -> None:
    link, _ = misbehaving(FailingWrite(0.0, count=count, raises=raises))
    wire = link.take()
    if raises:
        with pytest.raises(LinkError, match="not known"):
            wire.send(SET)
    else:
        ticket = wire.send(SET)
        assert ticket.done and "not known" in ticket.error
    assert accepted(link) == stands
    assert [(a.commands, a.error != "") for a in link.wire_log] == [(SET, True)]


@pytest.mark.parametrize(
    ("bad", "stands"),
    [
        (HalfWrite(1, 0.0), HALF),
        (Disobedient(frozenset({"cool.man"}), 0.0), HALF),
        (Disobedient(frozenset(), 0.0), BEFORE),
        (Clamped("L.sp", 9.0, 11.0, 0.0), {"L.sp": 11.0, "cool.man": 0.5}),
        (Clamped("cool.man", 0.6, 1.0, 0.0), {"L.sp": 12.0, "cool.man": 0.6}),
    ],
)
def test_disobedience_answers_well_and_is_seen_by_reading_back(bad: BadWrite, stands: dict[str, float | None]) -> None:
    link, _ = misbehaving(bad)
    ticket = link.take().send(SET)
    assert ticket.done and ticket.error == "" and accepted(link) == stands
    assert [a.commands for a in link.wire_log] == [SET]


def test_what_a_plant_pretends_is_seen_by_its_values_alone() -> None:
    link, beneath = misbehaving(Disobedient(frozenset({"L.sp"}), 0.0, 5.0, pretends=True))
    wire = link.take()
    wire.send(SET)
    sample = read(link)[0]
    assert sample.accepted == AFTER and sample.values["L.sp"] == 10.0
    assert [a.commands for a in beneath.wire_log] == [SET[1:]]
    read(link, 10)
    wire.send((Command("L.sp", 11.0, None),))
    assert accepted(link)["L.sp"] == 11.0, "an honest write ends the pretence"


@pytest.mark.parametrize("how", ["hand", "shed"])
def test_a_pretence_ends_where_somebody_else_acts(how: str) -> None:
    link, _ = misbehaving(Disobedient(frozenset(), 0.0, pretends=True))
    link.take().send(SET)
    if how == "hand":
        link.operate("L.sp", 9.0)
        assert accepted(link) == {"L.sp": 9.0, "cool.man": 0.5}
    else:
        link.give_back()
        assert accepted(link) == BEFORE


def test_late_obedience() -> None:
    link, _ = misbehaving(Late(3.0, 0.0))
    ticket = link.take().send(SET)
    assert ticket.done and [accepted(link) for _ in range(5)] == [BEFORE] * 3 + [AFTER] * 2


def test_what_comes_late_overwrites_what_was_sent_later() -> None:
    link, beneath = misbehaving(Late(3.0, 0.0, 1.0))
    wire = link.take()
    wire.send(SET)
    read(link)
    wire.send((Command("L.sp", 8.0, None),))
    assert [accepted(link)["L.sp"] for _ in range(3)] == [8.0, 8.0, 12.0]
    assert [a.at_s for a in beneath.wire_log] == [1.0, 3.0] and [a.at_s for a in link.wire_log] == [0.0, 1.0]


def test_what_comes_after_its_lease_does_not_arrive() -> None:
    link, beneath = misbehaving(Late(3.0, 0.0))
    link.take().send(SET)
    link.take()
    read(link, 10)
    assert beneath.wire_log == ()


def test_a_late_answer() -> None:
    link, _ = misbehaving(LateAnswer(3.0, 0.0))
    wire = link.take()
    ticket, refused = wire.send(SET), wire.send((Command("T", 1.0, None),))
    assert accepted(link) == AFTER and not ticket.done and refused.error == ""
    read(link, 2)
    assert ticket.done and ticket.error == "" and "'T' cannot be commanded" in refused.error


def test_writes_outside_the_time_go_through() -> None:
    link, _ = misbehaving(Disobedient(frozenset(), 5.0, 10.0))
    wire = link.take()
    seen = []
    for at_s in (4.0, 5.0, 8.0, 10.0):
        read(link, int(at_s - link.now_s))
        wire.send((Command("L.sp", at_s, None),))
        seen.append(accepted(link)["L.sp"])
    assert seen == [4.0, 4.0, 4.0, 10.0]


def test_a_void_wire_says_so_whatever_the_script() -> None:
    link, _ = misbehaving(HangingWrite(0.0))
    old = link.take()
    link.take()
    with pytest.raises(LeaseVoid):
        old.send(SET)
    assert old.void and link.wire_log == ()


def test_by_hand() -> None:
    link, _ = misbehaving(ByHand("L.sp", 12.0, 5.0, rate=0.5), ByHand("cool.man", 0.5, 5.0), ByHand("L.sp", 9.0, 20.0))
    found = read(link, 30)
    assert [s.accepted["L.sp"] for s in found] == [10.0] * 5 + [12.0] * 15 + [9.0] * 10
    assert found[5].values["L.sp"] == 10.5 and found[5].values["cool.man"] == 0.5 and link.wire_log == ()


def test_a_plant_that_gives_no_lease() -> None:
    link, _ = misbehaving(NoLease(0.0, 5.0))
    with pytest.raises(LinkError, match="does not give the lease at t = 0 s"):
        link.take()
    read(link, 5)
    assert link.take().send(SET).error == ""


def test_a_lost_heartbeat_sheds_although_the_guard_is_alive() -> None:
    link, _ = misbehaving(LostHeartbeat(10.0))
    wire = link.take()
    for _ in range(13):
        link.beat()
        read(link)
    assert not link.shed
    for _ in range(2):
        link.beat()
        read(link)
    assert link.shed and wire.void


def test_misbehaving_links_can_be_laid_over_each_other() -> None:
    link = Misbehaving(Misbehaving(tank(), (HalfWrite(1, 0.0),)), (Late(2.0, 0.0),))
    link.take().send(SET)
    assert [accepted(link) for _ in range(3)] == [BEFORE, BEFORE, HALF]
