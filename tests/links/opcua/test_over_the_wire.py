"""A link over OPC UA against a server in a process of its own: samples, writes, quality, and what may go wrong."""

from __future__ import annotations

import asyncio
import itertools
import math
import time
from dataclasses import replace

import pytest
from asyncua import ua
from asyncua.ua.uaerrors import UaError

from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.links.errors import LeaseVoid, LinkError
from homeostat.links.opcua.commissioning.browse import connected
from homeostat.links.opcua.link import OpcuaLink
from homeostat.links.opcua.security.security import Security
from tests.equipment.opcua.attached import until
from tests.equipment.opcua.served import Served, wait_up
from tests.equipment.opcua.tank import RULES, tank_mapping
from tests.links.opcua.conftest import HEARTBEAT_S
from tests.links.opcua.waiting import sample, settled


@pytest.mark.slow
def test_samples_follow_the_plants_clock_one_by_one(served: Served) -> None:
    with served.link() as link:
        found = [sample(link) for _ in range(20)]
        times = [s.at_s for s in found]
        assert all(b > a for a, b in itertools.pairwise(times)) and times[-1] - times[0] <= 40.0
        assert all(t == round(t) for t in times) and found[0].values.keys() == {"L", "T", "L.sp", "cool.man"}
        assert math.isnan(found[-1].values["cool.man"]) and found[-1].accepted["cool.man"] is None
        assert found[-1].accepted["L.sp"] is not None and not found[-1].bad
        assert found[0].values["T"] != found[1].values["T"], "noise differs from sample to sample"


def test_every_reading_keeps_three_times(served: Served) -> None:
    with served.link() as link:

        def is_fresh(seen: Snapshot) -> bool:
            reading = link.readings["ns=2;s=T"]
            assert reading.source_at is not None and reading.server_at is not None
            took_s = (reading.received_at - reading.source_at).total_seconds()
            assert took_s >= 0.0
            return took_s < 1.0 and abs(link.clock_s) < 1.0

        assert sample(link, is_fresh)


def test_news_of_an_earlier_lease_that_comes_late_ends_no_new_one(served: Served) -> None:
    with served.link() as link:
        wire, node = link.take(), "ns=2;s=Guard/Lease"
        ours = until(lambda: link.readings[node].value, "the plant shows whose the lease is")

        def news(lease: int, after_s: float) -> None:
            """What would have come so long after the lease was taken; of the plant nothing more comes."""
            link._board.put({node: replace(link.readings[node], value=lease, received_s=link._taken_s + after_s)})

        news(0, 1.0)
        assert not wire.void
        news(ours, 1.1)
        assert not wire.void
        news(0, 1.2)
        assert wire.void, "it was ours, and is not any more"


def test_a_write_is_one_call_with_rate_and_mode_and_is_read_back(served: Served) -> None:
    with served.link() as link:
        wire, before = link.take(), len(served.wire)
        assert settled(wire.send((Command("L.sp", 11.0, 0.5), Command("cool.man", 0.4, None)))) == ""
        seen = sample(link, lambda s: s.accepted.get("cool.man") == 0.4)
        assert seen.accepted["L.sp"] == 11.0 and seen.values["cool.man"] == pytest.approx(0.4)
        assert settled(wire.send((Command("cool.man", None, None),))) == ""
        assert sample(link, lambda s: s.accepted["cool.man"] is None)
        arrived = served.wire[before:]
        assert arrived[0] == [["L.sp", 11.0, 0.5], ["cool.man", 0.4, None]] and arrived[1] == [["cool.man", None, None]]
        link.give_back()


@pytest.mark.parametrize(
    ("command", "why"),
    [
        (Command("L.sp", 12.5, 2.0), "range is 2 to 12 L"),
        (Command("L.sp", 11.0, 3.0), "2 L/s are allowed"),
        (Command("L.sp", None, None), "no automatic mode"),
        (Command("T", 300.0, None), "cannot be commanded"),
        (Command("no such tag", 1.0, None), "cannot be commanded"),
    ],
)
def test_what_the_plants_tables_forbid_is_not_even_sent(served: Served, command: Command, why: str) -> None:
    with served.link() as link:
        wire, before = link.take(), len(served.wire)
        with pytest.raises(LinkError, match=why):
            wire.send((Command("cool.man", 0.4, None), command))
        assert len(served.wire) == before
        link.give_back()


@pytest.mark.parametrize(
    ("order", "why"),
    [
        ("refuse L.sp", "BadNotWritable"),
        ("clamp L.sp 2 10", "written as 11, and its node holds 10.0"),
        ("operate L.sp 9", "BadInvalidState"),
    ],
)
def test_a_refused_or_clamped_write_is_told(served: Served, order: str, why: str) -> None:
    with served.link() as link:
        wire = link.take()
        served.ask(order)
        assert why in settled(wire.send((Command("L.sp", 11.0, 2.0),)))
        link.give_back()


def test_a_write_that_is_ignored_is_seen_in_what_the_plant_works_with(served: Served) -> None:
    with served.link() as link:
        wire, before = link.take(), sample(link).accepted["L.sp"]
        served.ask("ignore L.sp")
        wanted = 5.0
        assert settled(wire.send((Command("L.sp", wanted, 2.0),))) == ""
        assert before != wanted and sample(link, lambda s: s.at_s > 0).accepted["L.sp"] == before
        link.give_back()


@pytest.mark.parametrize(
    ("status", "code", "group"),
    [
        ("BadSensorFailure", "0x808C0000", "bad"),
        ("BadOutOfService", "0x808D0000", "bad"),
        ("UncertainLastUsableValue", "0x40900000", "uncertain"),
    ],
)
def test_quality_keeps_its_sub_code(served: Served, status: str, code: str, group: str) -> None:
    with served.link() as link:
        served.ask(f"quality T {status}")
        seen = sample(link, lambda s: "T" in s.reasons)
        assert seen.reasons["T"] == f"{status} ({code})" and "T" in getattr(seen, group) and "L" not in seen.reasons
        served.ask("behave")
        assert sample(link, lambda s: not s.reasons).values["T"] == pytest.approx(300.0, abs=30.0)


def test_a_reading_that_comes_as_text_is_bad(served: Served) -> None:
    with served.link() as link:
        served.ask("text T")
        seen = sample(link, lambda s: "T" in s.bad and "text" in s.reasons["T"])
        assert math.isnan(seen.values["T"]) and "L" not in seen.bad
        served.ask("behave")
        assert sample(link, lambda s: not s.bad)


def test_a_counter_that_stands_is_a_dead_plant(served: Served) -> None:
    with served.link() as link:
        link.take()
        served.ask("counter stands")
        with pytest.raises(LinkError, match="nothing that must change has changed"):
            for _ in range(100):
                link.source.advance()
        with pytest.raises(LinkError, match="not reached"):
            link.take()
        served.ask("behave")
        assert wait_up(link) < served.back_s


def test_the_lease_is_one_at_a_time_and_writes_carry_it(served: Served) -> None:
    with served.link() as one, served.link() as other:
        old = one.take()
        new = other.take()
        assert settled(new.send((Command("cool.man", 0.3, None),))) == ""
        sample(one, lambda s: old.void)
        before = len(served.wire)
        with pytest.raises(LeaseVoid, match="take a new one"):
            old.send((Command("cool.man", 0.9, None),))
        with pytest.raises(LeaseVoid):
            one.beat()
        assert len(served.wire) == before and not new.void
        other.give_back()


@pytest.mark.slow
def test_the_plant_sheds_in_time_when_we_fall_silent(served: Served) -> None:
    with served.link() as link:
        wire = link.take()
        link.beat()
        assert settled(wire.send((Command("cool.man", 0.4, None),))) == ""
        for _ in range(15):
            sample(link)
            link.beat()
        held_s = sample(link).at_s
        assert sample(link).accepted["cool.man"] == 0.4
        shed = sample(link, lambda s: s.accepted["cool.man"] is None)
        assert 0.9 * HEARTBEAT_S <= shed.at_s - held_s <= 2.0 * HEARTBEAT_S
        assert wire.void
        with pytest.raises(LeaseVoid):
            link.beat()


@pytest.mark.slow
def test_who_never_beats_does_not_hold_the_plant_for_ever(served: Served) -> None:
    with served.link() as link:
        wire = link.take()
        assert settled(wire.send((Command("cool.man", 0.4, None),))) == ""
        assert sample(link, lambda s: s.accepted["cool.man"] == 0.4)
        assert sample(link, lambda s: s.accepted["cool.man"] is None) and wire.void
        again = link.take()
        assert settled(again.send((Command("cool.man", 0.3, None),))) == "", "a new lease ends local control"
        link.give_back()


def test_a_lease_that_is_given_back_sheds_at_once(served: Served) -> None:
    with served.link() as link:
        wire = link.take()
        assert settled(wire.send((Command("cool.man", 0.4, None),))) == ""
        link.give_back()
        assert sample(link, lambda s: s.accepted["cool.man"] is None) and wire.void
        assert served.ask("status")["Guard/Shed"] is True


def test_without_the_operators_permission_there_is_no_lease(served: Served) -> None:
    with served.link() as link:
        served.ask("permit no")
        sample(link, lambda s: link.readings["ns=2;s=Guard/Permit"].value is False)
        with pytest.raises(LinkError, match="do not permit"):
            link.take()


def test_no_lease_with_clocks_that_disagree(served: Served) -> None:
    with served.link() as link:
        served.ask("clock 10")
        sample(link, lambda s: link.clock_s > 9.0)
        with pytest.raises(LinkError, match=r"clock is \+\d+\.\d s from ours, 2 s are allowed"):
            link.take()


def test_our_alarm_stands_in_the_plants_list_until_somebody_acknowledges_it(served: Served) -> None:
    with served.link() as link:
        link.raise_alarm("a person is needed: T1 above 313 K")
        sample(link, lambda s: not link.acknowledged)
        assert served.ask("acknowledge") == "a person is needed: T1 above 313 K"
        sample(link, lambda s: link.acknowledged)
        link.raise_alarm("somebody has seen this here already", seen=True)
        shown = served.ask("status")
        assert shown["Guard/Alarm"] == "somebody has seen this here already" and shown["Guard/Acknowledged"] is True
        with served.link() as other:
            other.take()
            link.raise_alarm("")
            assert served.ask("status")["Guard/Alarm"] == "", "whoever holds the lease"
            other.give_back()
        assert served.ask("status")["leased"] is False


def test_a_permission_that_is_taken_back_ends_the_lease_at_once(served: Served) -> None:
    with served.link() as link:
        wire, before = link.take(), len(served.wire)
        link.beat()
        served.ask("permit no")
        sample(link, lambda s: not link.permitted)
        assert wire.void
        with pytest.raises(LeaseVoid, match="lease of this wire is over"):
            wire.send((Command("cool.man", 0.9, None),))
        with pytest.raises(LeaseVoid, match="operators do not permit"):
            link.beat()
        with pytest.raises(LinkError, match="operators do not permit"):
            link.take()
        link.give_back()
        assert served.ask("status")["leased"] is False and len(served.wire) == before
        served.ask("permit yes")
        sample(link, lambda s: link.permitted)
        assert wire.void, "what was over stays over"
        assert not link.take().void
        link.give_back()


def test_an_insecure_connection_reads_and_never_writes(served: Served) -> None:
    with OpcuaLink(tank_mapping(served.port), RULES, Security(insecure=True), pace=served.scale) as link:
        wait_up(link)
        assert sample(link).values["T"] > 0.0
        with pytest.raises(LinkError, match="not encrypted"):
            link.take()


def test_a_server_without_subscriptions_is_polled(served: Served) -> None:
    with served.link(subscribe=False) as link:
        found = [sample(link) for _ in range(10)]
        assert found[-1].at_s - found[0].at_s <= 30.0 and found[0].values["T"] != found[-1].values["T"]


@pytest.mark.slow
def test_connections_that_are_cut_again_and_again_do_not_repeat_a_write(served: Served) -> None:
    with served.link() as link:
        wire, before = link.take(), len(served.wire)
        served.ask("silence")
        ticket = wire.send((Command("L.sp", 8.0, 2.0),))
        served.ask("drop 0.4")
        assert settled(ticket) != ""
        time.sleep(3.0)
        served.ask("behave")
        assert wait_up(link) < served.back_s and wire.void
        assert served.wire[before:] == [[["L.sp", 8.0, 2.0]]]


def test_nobody_lets_the_plants_recipe_go_on_who_does_not_hold_the_lease(served: Served) -> None:
    """A client that is trusted and knows no manners."""
    url = f"opc.tcp://127.0.0.1:{served.port}/homeostat/"

    async def write(security: Security, *writes: tuple[str, object]) -> str:
        async with connected(url, security) as client:
            nodes = [client.get_node(f"ns=2;s={node}") for node, _ in writes]
            values = [ua.DataValue(ua.Variant(value)) for _, value in writes]
            try:
                await client.write_values(nodes, values)
            except UaError as refused:
                return type(refused).__name__
            return ""

    trusted, anybody, before = Security(served.pki), Security(insecure=True), served.wire
    assert asyncio.run(write(trusted, ("Guard/Hold", True))) == ""
    assert asyncio.run(write(trusted, ("Guard/Hold", False))) == "BadUserAccessDenied"
    together = ("Guard/Alarm", "words"), ("cool.man/Target", 0.9)
    assert asyncio.run(write(trusted, *together)) == "BadUserAccessDenied"
    assert asyncio.run(write(anybody, ("Guard/Alarm", "words"))) == "BadUserAccessDenied"
    shown = served.ask("status")
    assert shown["Guard/Hold"] is True and shown["Guard/Alarm"] != "words" and served.wire == before
    with served.link() as link:
        link.take()
        link.hold(False)
        link.give_back()


def test_the_plants_recipe_waits_as_long_as_it_is_told_to(served: Served) -> None:
    with served.link() as link:
        before = served.wire
        link.hold(True)
        assert served.ask("status")["Guard/Hold"] is True, "that it waits moves nothing, and needs no lease"
        assert served.wire == before and served.ask("status")["leased"] is False
        with pytest.raises(LinkError, match="only who holds the lease"):
            link.hold(False)
        assert sample(link, lambda s: link.held is True) and served.ask("status")["Guard/Hold"] is True
        link.take()
        link.hold(False)
        assert served.ask("status")["Guard/Hold"] is False
        link.give_back()


def test_a_server_keeps_raw_history_of_its_readings(served: Served) -> None:
    async def history() -> list[float]:
        url = f"opc.tcp://127.0.0.1:{served.port}/homeostat/"
        async with connected(url, Security(served.pki)) as client:
            values = await client.get_node("ns=2;s=T").read_raw_history(numvalues=10)
            return [value.Value.Value for value in values if value.Value is not None]

    with served.link() as link:
        for _ in range(10):
            sample(link)
    found = asyncio.run(history())
    assert len(found) == 10 and len(set(found)) > 5 and all(200.0 < value < 400.0 for value in found)
