"""Approval on the page of a plant that is attached over OPC UA: what was shown reaches the plant, once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")
pytest.importorskip("argon2", reason="the extra 'console' is not installed")

from homeostat.journal import read_events
from homeostat.journal.verify.verify import verify
from tests.console.served import PASSWORD, accounts, served
from tests.console.test_deciding import at
from tests.equipment.opcua.attached import Attached, Reactor

pytestmark = [pytest.mark.wide, pytest.mark.timeout(900)]
SCALE, FAST = 2.0, 20.0
LONG_MS = 120_000.0


@pytest.fixture(scope="module")
def reactor(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Reactor]:
    """The served reactor; it is there before a browser, which has an event loop of its own."""
    with Reactor(tmp_path_factory.mktemp("served"), SCALE, "--heartbeat", "30") as served_reactor:
        yield served_reactor


def test_what_is_approved_on_the_page_reaches_the_plant_once(
    reactor: Reactor, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    browser = request.getfixturevalue("browser")
    people, live = accounts(tmp_path / "people.json", Ada="engineer"), tmp_path / "live"
    with Attached(reactor, live) as attached:
        attached.waits_for(lambda now: now["thinking"]["process"] and now["now_s"], "thinking")
        reactor.ask(f"pace {FAST}")
        with served(live, "--people", str(people)) as server, at(browser, server, "Ada") as page:
            page.get_by_role("button", name="Mode").click()
            page.locator("dialog select").select_option("approve")
            page.locator("dialog textarea").fill("a person decides")
            page.locator("dialog input[type=password]").fill(PASSWORD.format("Ada"))
            page.locator("dialog button[type=submit]").click()
            page.get_by_text("✓ Done").wait_for()
            page.keyboard.press("Escape")
            attached.waits_for(lambda now: now["state"] == "normal" and now["now_s"] > 1000.0, "normal", 300.0)
            reactor.ask(f"pace {SCALE}")
            before = len(reactor.commands)
            reactor.ask("fault cool_stuck_open")
            page.wait_for_selector(".decision", timeout=LONG_MS)
            shown = page.locator(".decision").inner_text()
            assert len(reactor.commands) == before, "nothing is written before somebody says yes"
            page.keyboard.press("a")
            page.locator("dialog input[type=password]").fill(PASSWORD.format("Ada"))
            page.locator("dialog button[type=submit]").click()
            page.get_by_text("✓ Done").wait_for()
            page.keyboard.press("Escape")
            attached.waits_for(lambda now: any(e.kind == "released" for e in read_events(live)), "the release", 60.0)
            (written,) = reactor.commands[before:]
            heard = [e.fields for e in read_events(live) if e.kind == "person-heard" and e.fields["verb"] == "approve"]
            (released,) = (e.fields for e in read_events(live) if e.kind == "released")
            assert heard[0]["done"] and str(heard[0]["person"]).startswith("Ada (login ") and shown
            assert {c["tag"]: c["value"] for c in released["commands"]} == pytest.approx(
                {tag: value for tag, value, _ in written}
            )
            page.get_by_text("released, and the plant holds it").first.wait_for(timeout=LONG_MS)
        assert attached.interrupt() == 0
        assert reactor.commands[before:] == [written]
    report = verify(live)
    assert report.complete and report.contradictions == ()
