"""The served reactor attached: what its own people see of the guard, what comes back, and whose word ends a mode."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")

from homeostat.domain.events.people import AlarmAcknowledged
from homeostat.journal import read_events
from homeostat.journal.verify.verify import verify
from homeostat.record.decode import decode
from homeostat.service.attached.mirroring import OPERATORS, SETTLES_S
from tests.equipment.opcua.attached import Attached, Reactor, until

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


@pytest.fixture(scope="module")
def reactor(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Reactor]:
    with Reactor(tmp_path_factory.mktemp("served"), 5.0) as reactor:
        yield reactor


def sampled(now: dict[str, Any]) -> bool:
    return now["now_s"] is not None and not now["link"]["trouble"]


def test_a_latch_stands_in_the_plants_list_and_its_operators_acknowledge_it(reactor: Reactor, tmp_path: Path) -> None:
    live = tmp_path / "live"
    with Attached(reactor, live) as attached:
        attached.waits_for(sampled, "samples")
        assert attached.order("mode", "closed-loop", "--reason", "test")[0] == 0
        assert attached.order("fall-back", "--reason", "smoke")[0] == 0
        attached.waits_for(lambda now: now["latched"], "the latch")
        until(lambda: "critical latched" in reactor.ask("status")["Guard/Alarm"], "the alarm at the plant")
        until(lambda: reactor.ask("status")["Guard/Hold"], "the plant's recipe waits")
        reactor.ask("permit no")
        now = attached.waits_for(lambda now: now["mode"]["actual"] == "observe", "observe")
        assert "do not permit" in now["mode"]["why"]
        until(lambda: reactor.ask("status")["leased"] is False, "the lease is over", 30.0)
        assert reactor.ask("status")["Guard/Hold"] is True
        written = len(reactor.commands)
        at_s = time.monotonic()

        def acknowledged(now: dict[str, Any]) -> bool:
            nonlocal at_s
            if time.monotonic() > at_s:  # who reads it takes longer than a new text takes to settle
                reactor.ask("acknowledge")
                at_s = time.monotonic() + SETTLES_S + 2.0
            return any(a["alarm"] == "latched" and a["acknowledged_by"] for a in now["alarms"])

        attached.waits_for(acknowledged, "acknowledged")
        assert attached.order("reset", "--reason", "no smoke")[0] == 0
        until(lambda: "latched" not in reactor.ask("status")["Guard/Alarm"], "no alarm of a latch at the plant")
        assert reactor.ask("status")["Guard/Hold"] is True, "in observe nobody lets the plant's recipe go on"
        assert len(reactor.commands) == written
        reactor.ask("permit yes")
        assert until(lambda: attached.order("mode", "closed-loop", "--reason", "test")[0] == 0, "the mode")
        # The plant is half emptied by the fallback: where a limit is violated again at once, it goes on waiting.
        until(
            lambda: reactor.ask("status")["Guard/Hold"] is False or attached.status.get("latched"),
            "the plant's recipe goes on",
        )
        assert attached.interrupt() == 0
    seen = [decode(e) for e in read_events(live) if e.kind == AlarmAcknowledged.kind]
    assert any(OPERATORS in str(one) for one in seen) and verify(live).contradictions == ()


def test_a_configuration_that_nobody_signed_commands_nothing(reactor: Reactor, tmp_path: Path) -> None:
    before = len(reactor.commands)
    with Attached(reactor, tmp_path / "live", unsigned=False) as attached:
        now = attached.waits_for(sampled, "samples")
        assert "not signed" in now["writes_nothing"] and "UNSIGNED" in attached.errors.read_text()
        _, shown = attached.order("status")
        assert "UNSIGNED" in shown and "writes    nothing: the configuration is not signed" in shown
        assert attached.order("mode", "advise")[0] == 0
        status, said = attached.order("mode", "closed-loop", "--reason", "test")
        assert status != 0 and "not signed" in said, said
        assert attached.order("fall-back", "--reason", "smoke")[0] != 0
        assert attached.status["mode"]["actual"] in ("observe", "advise")
    assert len(reactor.commands) == before
