"""A plant that shows what was requested and works with it once it is applied."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Sequence
from typing import cast

import pytest
from asyncua import ua

from homeostat.domain.recovery import Command
from homeostat.links.opcua.connection.session import Session
from homeostat.links.opcua.security.certificate import Pki
from homeostat.links.opcua.writing.wire import carry_out
from homeostat.links.opcua.writing.writes import Expected, NodeWrite, WriteOrder
from tests.equipment.opcua.served import Served
from tests.links.opcua.waiting import sample, settled


@pytest.mark.slow
def test_a_target_counts_once_it_was_requested_read_back_and_applied(pkis: tuple[Pki, Pki]) -> None:
    with Served(pkis, two_step=True) as served, served.link(two_step=True) as link:
        wire = link.take()
        assert settled(wire.send((Command("L.sp", 11.0, 0.5), Command("cool.man", 0.4, None)))) == ""
        seen = sample(link, lambda s: s.accepted.get("cool.man") == 0.4)
        assert seen.accepted["L.sp"] == 11.0
        served.ask("clamp L.sp 2 10")
        before = served.wire
        assert "its node holds 10.0" in settled(wire.send((Command("L.sp", 11.5, 2.0),)))
        assert served.wire == before, "what was requested otherwise is not applied"
        assert settled(wire.send((Command("cool.man", None, None),))) == ""
        assert sample(link, lambda s: s.accepted["cool.man"] is None)


def test_without_the_second_step_nothing_happens(pkis: tuple[Pki, Pki]) -> None:
    with Served(pkis, two_step=True) as served, served.link() as link:
        wire, before = link.take(), sample(link).accepted["L.sp"]
        assert settled(wire.send((Command("L.sp", 11.0, 2.0),))) == ""
        assert sample(link).accepted["L.sp"] == before and served.wire == []


class Showing:
    """A server that takes everything and shows the same value in every node."""

    def __init__(self, shown: float) -> None:
        self.shown, self.written = shown, list[Sequence[NodeWrite]]()

    def unfit(self, writes: Sequence[NodeWrite]) -> str:
        return ""

    async def write(self, writes: Sequence[NodeWrite]) -> list[str]:
        self.written.append(writes)
        return [""] * len(writes)

    async def read(self, nodes: Sequence[str]) -> list[ua.DataValue]:
        return [ua.DataValue(ua.Variant(self.shown, ua.VariantType.Double)) for _ in nodes]


def test_what_is_requested_as_no_number_is_not_applied() -> None:
    server = Showing(math.nan)
    set_it, shown = NodeWrite("ns=2;s=L", 5.0, "Double"), Expected("L.sp", "ns=2;s=L", 5.0, 0.1)
    order = WriteOrder((set_it,), (shown,), (NodeWrite("ns=2;s=apply", True, "Boolean"),))
    assert "its node holds nan" in asyncio.run(carry_out(cast(Session, server), order, ()))
    assert server.written == [(set_it,)]
