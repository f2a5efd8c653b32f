"""What happens to servers and networks: data are back soon after the server is, and no write is ever repeated."""

from __future__ import annotations

import contextlib
import socket
import time

import pytest

from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.links.errors import LinkError
from homeostat.links.opcua.link import OpcuaLink
from homeostat.links.opcua.mapping import Connection
from homeostat.links.opcua.security.certificate import Pki
from tests.equipment.opcua.proxy import Proxy
from tests.equipment.opcua.served import Served, wait_up
from tests.links.opcua.waiting import sample, settled


def lost(link: OpcuaLink, connections: int, within_s: float = 15.0) -> float:
    """Tick until other than ``connections`` are counted; how long ticks took, wall-clock [s].

    They are counted because a lost connection may be there again within one tick. The longest tick but one says how
    long: one of a few may be late because the host is busy.
    """
    end, took = time.monotonic() + within_s, list[float]()
    while link.connections == connections or len(took) < 6:
        assert time.monotonic() < end, "the loss was not noticed"
        begin = time.monotonic()
        with contextlib.suppress(LinkError):
            link.source.advance()
        took.append(time.monotonic() - begin)
    return sorted(took)[-2]


def stalled(served: Served, link: OpcuaLink, seconds: float) -> None:
    """Let the whole server stand, and go on."""
    served.freeze(True)
    begin = time.monotonic()
    while time.monotonic() - begin < seconds:
        with contextlib.suppress(LinkError):
            link.source.advance()
        time.sleep(0.02)
    served.freeze(False)


@pytest.mark.slow
def test_a_server_that_is_killed_is_found_again_when_it_returns(pkis: tuple[Pki, Pki]) -> None:
    with Served(pkis) as served, served.link() as link:
        wire = link.take()
        assert settled(wire.send((Command("L.sp", 11.0, 2.0),))) == ""
        before_s, connections = sample(link).at_s, link.connections
        served.kill()
        assert lost(link, connections) < 0.8, "no tick waits longer than the guard's does"
        with pytest.raises(LinkError):
            wire.send((Command("L.sp", 9.0, 2.0),))
        with pytest.raises(LinkError):
            link.beat()
        served.start()
        assert wait_up(link) < served.back_s
        assert sample(link).at_s > before_s, "time does not run back although the plant's clock began again"
        assert wire.void and served.wire == [], "what was ordered in between is not sent now"
        assert settled(link.take().send((Command("L.sp", 9.0, 2.0),))) == ""
        assert served.wire == [[["L.sp", 9.0, 2.0]]]


@pytest.mark.slow
@pytest.mark.parametrize(
    "stalls",
    [(3.0,), pytest.param((15.0,), marks=pytest.mark.wide), pytest.param((3.0, 15.0), marks=pytest.mark.wide)],
    ids=str,
)
def test_a_server_that_stands_is_followed_again_when_it_goes_on(served: Served, stalls: tuple[float, ...]) -> None:
    with served.link() as link:
        for seconds in stalls:
            stalled(served, link, seconds)
            assert wait_up(link) < served.back_s
            assert sample(link).at_s < sample(link).at_s
            time.sleep(3.0 if len(stalls) > 1 else 0.0)


@pytest.mark.slow
def test_a_write_that_meets_a_standing_server_is_answered_and_not_repeated(served: Served) -> None:
    with served.link() as link:
        wire, before = link.take(), len(served.wire)
        served.freeze(True)
        ticket = wire.send((Command("L.sp", 8.0, 2.0),))
        error = settled(ticket, 6.0)
        assert "not" in error and "known" in error
        served.freeze(False)
        assert wait_up(link) < served.back_s
        time.sleep(1.0)
        arrived = served.wire[before:]
        assert len(arrived) <= 1, arrived


def test_a_plant_goes_on_while_its_server_does_nothing(served: Served) -> None:
    with served.link() as link:
        before_s, begin = sample(link).at_s, time.monotonic()
        served.ask("stall 1.5")
        time.sleep(2.0)

        def has_gone_on(seen: Snapshot) -> bool:
            """What a plant that had waited makes up for in 15 s at the earliest."""
            return seen.at_s - before_s >= 0.9 * (time.monotonic() - begin) * served.scale

        assert sample(link, has_gone_on, within_s=10.0), "what it did not show has happened all the same"


@pytest.mark.slow
def test_a_half_open_connection_is_noticed_by_the_age_of_the_data(served: Served) -> None:
    with Proxy(served.port) as proxy, served.link(proxy.port) as link:
        wire, connections = link.take(), link.connections
        proxy.swallow(True)
        begin = time.monotonic()
        assert lost(link, connections) < 0.8
        assert time.monotonic() - begin < 8.0 and wire.void
        proxy.swallow(False)
        assert wait_up(link) < served.back_s


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [7.0, pytest.param(8.5, marks=pytest.mark.wide)])
def test_with_default_times_data_are_back_in_ten_seconds_whatever_was_under_way(served: Served, seconds: float) -> None:
    default = Connection(url="opc.tcp://127.0.0.1:1/").model_dump(exclude={"url", "publish_s", "subscribe"})
    with Proxy(served.port) as proxy, served.link(proxy.port, **default) as link:
        connections = link.connections
        proxy.swallow(True)
        begin = time.monotonic()
        while time.monotonic() - begin < seconds or link.connections == connections:
            with contextlib.suppress(LinkError):
                link.source.advance()
            time.sleep(0.02)
        proxy.swallow(False)
        assert wait_up(link) < 10.0


@pytest.mark.slow
def test_a_cut_connection_is_made_again(served: Served) -> None:
    with Proxy(served.port) as proxy, served.link(proxy.port) as link:
        for _ in range(3):
            connections = link.connections
            proxy.cut()
            lost(link, connections)
            assert wait_up(link) < served.back_s


def test_a_link_that_never_reaches_anybody_holds_nobody_up(served: Served) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent, served.open(silent.getsockname()[1]) as link:
        begin = time.monotonic()
        with pytest.raises(LinkError, match="not reached"):
            link.source.advance()
        with pytest.raises(LinkError, match="not reached"):
            link.take()
        link.beat()
        link.give_back()
        assert time.monotonic() - begin < 2.0
        with pytest.raises(LinkError, match=r"not reached within 0\.2 s"):
            link.wait(0.2)
