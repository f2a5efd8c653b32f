"""The whole path: the reactor served by a process of its own, recovered over the wire from a fault that nobody told."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import homeostat as hs
from homeostat.domain.mode import Mode
from homeostat.domain.observation import Observation
from homeostat.journal import MemoryTrace
from homeostat.links.clock import ThinkingClock
from homeostat.links.opcua.link import OpcuaLink
from homeostat.links.opcua.mapping import read_mapping
from homeostat.links.opcua.security.security import Security
from homeostat.plants.wired.assembly import guard_rules
from tests.cli.command import homeostat_process
from tests.equipment.opcua.attached import Reactor
from tests.equipment.opcua.served import wait_up

FAST, SLOW = 20.0, 3.0
"""Process seconds per second until the fault, and from then on."""
ONSET_S, END_S = 1000.0, 1400.0


@pytest.fixture
def reactor(tmp_path: Path) -> Iterator[Reactor]:
    with Reactor(tmp_path, 0.0, "--heartbeat", "30") as served:
        pki, mapping = str(served.pkis[1].folder), served.mapping
        done = homeostat_process("link", "check", "cstr", str(mapping), "--pki", pki, cwd=tmp_path)
        assert done.status == 0 and "nothing is wrong" in done.out, done.out
        mapping.write_text(mapping.read_text().replace("[connection]\n", "[connection]\npublish_s = 0.02\n"))
        yield served


def attached(reactor: Reactor, mode: Mode, onset_s: float, end_s: float) -> MemoryTrace:
    """What happens to a supervisor until process time ``end_s``; the cooling valve sticks at ``onset_s``."""
    plant, trace = hs.load_plant("cstr"), MemoryTrace()
    told: list[float] = []
    rules, mapping = guard_rules(plant), read_mapping(reactor.mapping)
    with OpcuaLink(mapping, rules, Security(reactor.pkis[1]), pace=SLOW) as link:
        reactor.ask(f"pace {FAST}")
        wait_up(link)
        supervisor = hs.Supervisor(plant, link, mode, trace, clock=ThinkingClock(SLOW))

        def hook(seen: Observation) -> None:
            if not told and seen.now_s >= onset_s:
                told.append(reactor.ask(f"pace {SLOW}"))
                reactor.ask("fault cool_stuck_closed 0.7")
            link.source.ended = seen.now_s >= end_s

        supervisor.run(pace=FAST, hook=hook)
    return trace


@pytest.mark.wide
@pytest.mark.timeout(600)
def test_the_reactor_is_recovered_over_the_wire(reactor: Reactor) -> None:
    trace = attached(reactor, Mode.CLOSED_LOOP, ONSET_S, END_S)
    released = trace.of(hs.events.ReleasedActions)
    assert released and not trace.of(hs.events.FallbackActivated), [e.event for e in trace.entries][-20:]
    assert [s.state for s in trace.of(hs.events.StateEntered)][:2] == ["normal", "reduced_load"]
    assert reactor.ask("status")["T1"] < 313.0
    tags = guard_rules(hs.load_plant("cstr")).tags
    beside = hs.run("cstr", hs.Fault("cool_stuck_closed", 0.7, ONSET_S), seed=1, end_s=END_S)
    wanted = {c.tag: c.value for c in beside.actions}
    written = [commands for arrival in reactor.ask("wire") if len(commands := arrival["commands"]) == len(wanted)][-1]
    assert {tag for tag, _, _ in written} == wanted.keys()
    for tag, value, _ in written:
        assert value == wanted[tag] or abs(value - wanted[tag]) < 0.05 * tags[tag].range.span, (tag, value, wanted[tag])


@pytest.mark.wide
def test_in_advise_nothing_is_written_as_the_server_knows(reactor: Reactor) -> None:
    begin = time.monotonic()
    trace = attached(reactor, Mode.ADVISE, 400.0, 700.0)
    assert time.monotonic() - begin < 200.0
    assert trace.of(hs.events.Tripped), "it has looked on"
    status = reactor.ask("status")
    assert reactor.ask("wire") == [] and status["Guard/Lease"] == status["Guard/Heartbeat"] == 0
