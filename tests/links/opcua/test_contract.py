"""The contract of links in virtual time, kept over a network: the served tank goes on when it is told to."""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Iterator
from typing import Any

import pytest

from homeostat.domain.ports import Ticket, Wire
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.links.errors import PlantEnded
from homeostat.links.opcua.link import OpcuaLink
from homeostat.links.opcua.security.certificate import Pki
from homeostat.links.virtual import Arrival, SourceView, VirtualSource
from tests.contracts.link import Handles, LinkContract, Open
from tests.equipment.opcua.served import Served
from tests.links.opcua.waiting import settled

END_S = 60.0


class StepwiseWire:
    """A wire that answers when it has answered."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire

    @property
    def void(self) -> bool:
        return self._wire.void

    def send(self, commands: tuple[Command, ...]) -> Ticket:
        ticket = self._wire.send(commands)
        settled(ticket)
        return ticket


class Stepwise:
    """A link whose plant goes on by a second when the next sample is read; its time begins when it is opened."""

    never_blocks = False

    def __init__(self, served: Served, link: OpcuaLink) -> None:
        self._link = link
        self._engineer = socket.create_connection(("127.0.0.1", served.engineer))
        self._answers = self._engineer.makefile()
        self._sample(self._ask("begin"))
        self._began_s, self._plants_s, self.end_s = link.source.now_s, 1.0, END_S
        self.source: VirtualSource = SourceView(self)

    @property
    def now_s(self) -> float:
        return self._link.source.now_s - self._began_s

    @property
    def ended(self) -> bool:
        return self.now_s >= self.end_s

    @property
    def wire_log(self) -> tuple[Arrival, ...]:
        return tuple(
            Arrival(a["at_s"] - self._plants_s, tuple(Command(*c) for c in a["commands"]), a["error"])
            for a in self._ask("wire")
        )

    @property
    def shed(self) -> bool:
        return bool(self._ask("status")["Guard/Shed"])

    def advance(self) -> Snapshot:
        if self.ended:
            raise PlantEnded("the run is over")
        sample = self._sample(self._ask("step 1"))
        return Snapshot(self.now_s, sample.values, accepted=sample.accepted)

    def take(self) -> StepwiseWire:
        return StepwiseWire(self._link.take())

    def beat(self) -> None:
        self._link.beat()

    def give_back(self) -> None:
        self._link.give_back()
        while self._link.readings["ns=2;s=Guard/Lease"].value:
            time.sleep(0.005)

    def operate(self, tag: str, value: float | None, rate: float | None = None) -> None:
        self._ask(f"operate {tag} {'automatic' if value is None else value} {'' if rate is None else rate}")

    def close(self) -> None:
        self._answers.close()
        self._engineer.close()

    def _ask(self, line: str) -> Any:
        self._engineer.sendall(line.encode() + b"\n")
        answer = json.loads(self._answers.readline())
        if "error" in answer:
            raise ValueError(answer["error"])
        return answer["done"]

    def _sample(self, told_s: float) -> Snapshot:
        """The sample of the plant's time ``told_s``."""
        end = time.monotonic() + 30.0
        while time.monotonic() < end:
            sample = self._link.source.advance()
            if sample is not None and self._link.readings["ns=2;s=Plant/Time"].value == told_s:
                return sample
        raise AssertionError(f"the sample of {told_s} s has not come")


@pytest.fixture(scope="module")
def stepwise(pkis: tuple[Pki, Pki]) -> Iterator[tuple[Served, OpcuaLink]]:
    with Served(pkis, scale=0.0, heartbeat_s=5.0) as served, served.stepping() as link:
        yield served, link


class TestOpcua(LinkContract):
    @pytest.fixture
    def opened(self, stepwise: tuple[Served, OpcuaLink]) -> Iterator[Open]:
        served, link = stepwise
        made: list[Stepwise] = []

        def opened() -> Stepwise:
            made.append(Stepwise(served, link))
            return made[-1]

        yield opened
        for each in made:
            each.close()

    @pytest.fixture
    def handles(self) -> Handles:
        return Handles("L.sp", -2.0, 0.5, "cool.man", "L")

    # It waits for a network; what may not be commanded is refused before it is sent; and a served plant waits for the
    # first heartbeat, too. Each has tests of its own.
    test_what_says_that_it_never_blocks_waits_for_nothing = None  # type: ignore[assignment]
    test_commands_are_taken_all_or_none = None  # type: ignore[assignment]
    test_who_never_beats_is_not_waited_for = None  # type: ignore[assignment]
    test_a_new_lease_ends_local_control = None  # type: ignore[assignment]
