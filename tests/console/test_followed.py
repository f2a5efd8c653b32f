"""A page that follows, plays and looks back: it shows one moment, and says of none what is so of another."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from homeostat.cli.commands.console import opened
from homeostat.console.opened import OpenedRun
from homeostat.console.outlook import Until
from homeostat.console.view import seen, shown
from tests.cli.command import COMMAND, LIMIT_S, environment
from tests.console.served import Served, accounts, served
from tests.console.test_dead_connection import held, until
from tests.console.test_deciding import at, confirm
from tests.console.test_live import waited_for
from tests.equipment.attended import Attended

pytest.importorskip("argon2", reason="the extra 'console' is not installed")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A plant that is attached, with two engineers."""
    folder = tmp_path_factory.mktemp("people")
    people = accounts(folder / "people.json", Ada="engineer", Bo="engineer")
    with (
        Attended(tmp_path_factory.mktemp("live") / "l") as service,
        served(service.directory, "--people", str(people)) as server,
    ):
        yield server


def clock_s(page: Any) -> int:
    """The moment that the page shows [s]."""
    return int(re.match(r"\d+", page.locator(".clock").inner_text())[0])  # type: ignore[index]


def test_an_answer_that_comes_late_does_not_replace_what_is_followed(
    page: Any, console: Served, recovered: OpenedRun
) -> None:
    begins_s = shown(recovered).begins_s
    assert begins_s is not None
    page.goto(f"{console.address}#t={begins_s - 20:.0f}")
    page.wait_for_selector(".clock")
    page.locator("nav.transport select").select_option("5")
    kept, _ = held(page, "**/api/moment*", lambda url, number: True)
    page.keyboard.press("ArrowRight")
    assert until(page, lambda: bool(kept), 20.0)
    page.keyboard.press("Space")
    page.wait_for_selector(".answers")  # the episode has begun
    page.keyboard.press("Space")
    with page.expect_response("**/api/moment*"):
        kept[0].continue_()
    page.wait_for_timeout(500)
    assert page.locator(".answers").count() == 1 and clock_s(page) >= begins_s


def test_a_moment_that_it_was_played_from_can_be_gone_back_to(page: Any, console: Served) -> None:
    page.goto(f"{console.address}#t=0")
    page.wait_for_selector(".clock")
    page.keyboard.press("Space")
    assert until(page, lambda: clock_s(page) > 60, 30.0)
    page.keyboard.press("Home")
    assert until(page, lambda: clock_s(page) < 50, 3.0)
    assert until(page, lambda: clock_s(page) > 60, 30.0), "and it plays on from there"


def test_a_page_that_hears_nothing_says_so_in_words(page: Any, console: Served) -> None:
    held(page, "**/api/stream*", lambda url, number: True)
    page.goto(console.address)
    page.wait_for_selector(".clock")
    page.keyboard.press("Space")
    page.locator(".transport [role=alert]", has_text="The connection is lost").wait_for(timeout=10_000)
    assert page.locator("main.old").count() == 1


def test_a_run_that_has_ended_is_not_said_to_go_on(page: Any, tmp_path: Path) -> None:
    arguments = ["run", "cstr", "--end", "300", "--console", "--pace", "60", "--out", "run"]
    with (tmp_path / "said").open("w+") as said:
        process = subprocess.Popen(
            [*COMMAND, *arguments], cwd=tmp_path, env=environment(), stdout=subprocess.DEVNULL, stderr=said
        )
        try:
            port = int(waited_for(tmp_path / "said", r"shown at http://127\.0\.0\.1:(\d+)/"))
            page.goto(f"http://127.0.0.1:{port}/")
            page.wait_for_selector(".clock")
            assert "The run goes on" in page.locator("body").inner_text()
            waited_for(tmp_path / "said", r"(the page stays until Ctrl-C)")
            assert until(page, lambda: "The run goes on" not in page.locator("body").inner_text(), 15.0)
            assert page.get_by_role("button", name="▶ Play").count() == 1 and clock_s(page) == 300
            page.goto("about:blank")
        finally:
            os.kill(process.pid, signal.SIGINT)
            process.wait(LIMIT_S)


def changed(page: Any, pattern: str, change: Any) -> None:
    """What ``change`` does to an answer is what the page gets."""

    def route(asked: Any) -> None:
        content = asked.fetch().json()
        change(content)
        asked.fulfill(status=200, content_type="application/json", body=json.dumps(content))

    page.route(pattern, route)


def test_a_cost_that_nobody_knows_and_a_probability_that_is_nearly_one(page: Any, console: Served) -> None:
    def change(moment: Any) -> None:
        card = moment["card"]
        card["probability"] = 0.9971
        for choice in card["choices"]:
            if choice["kind"] == "leave alone":
                choice["cost"] = None
        assert any(choice["cost"] is None for choice in card["choices"])

    changed(page, "**/api/moment*", change)
    page.goto(console.address)
    page.wait_for_selector(".answers")
    assert "99.7 % probable" in page.locator(".answers").inner_text()
    costs = page.get_by_role("region", name="Costs").locator("tbody tr", has_text="Leave alone")
    assert "not known" in costs.inner_text() and "null" not in page.locator("body").inner_text()


def test_what_cannot_be_verified_is_not_said_to_be_under_way(browser: Any, console: Served) -> None:
    page = browser.new_page()
    page.route("**/api/verified*", lambda asked: asked.abort())
    page.goto(console.address)
    page.wait_for_selector(".clock")
    page.keyboard.press("8")
    page.locator("#journal [role=status]", has_text="Not verified").wait_for(timeout=10_000)
    assert "Being verified" not in page.locator("#journal").inner_text()
    page.close()


def test_nothing_is_ordered_beside_an_earlier_moment(browser: Any, live: Served) -> None:
    with at(browser, live, "Ada") as page:
        page.get_by_role("button", name="Mode …").wait_for()
        page.keyboard.press("Home")
        page.locator(".stale, .notice", has_text="Not live").wait_for()
        assert page.locator(".orders button").count() == 0
        assert "orders are given once the page is back to live" in page.locator(".desk").inner_text()
        page.keyboard.press("End")
        page.get_by_role("button", name="Mode …").wait_for()


def test_a_dialog_says_how_it_is_now_and_not_when_it_was_opened(browser: Any, live: Served) -> None:
    with at(browser, live, "Ada") as one, at(browser, live, "Bo") as other:
        one.get_by_role("button", name="Mode …").click()
        one.locator("dialog p", has_text="It is approve now.").wait_for()
        other.get_by_role("button", name="Mode …").click()
        other.locator("dialog select").select_option("observe")
        assert "✓ Done" in confirm(other, "Bo")
        one.locator("dialog p", has_text="It is observe now.").wait_for()


def test_what_was_judged_before_a_limit_was_violated_is_not_said_to_be_safe(page: Any, advised_run: Path) -> None:
    run = opened(advised_run, None)
    moments = [at_s for at_s in range(900, int(run.last_s)) if (c := seen(run, at_s).card) and c.proposal]
    beyond_s = next(s for s in reversed(moments) if seen(run, s).overview.left.until is Until.BEYOND)
    ahead_s = next(s for s in moments if seen(run, s).overview.left.until is Until.LIMIT)
    answer = page.locator(".answers > div", has_text="Why it is safe")
    with served(advised_run) as server:
        for at_s, words in ((ahead_s, "to spare at worst"), (beyond_s, "■ A hard limit is violated")):
            page.goto("about:blank")
            page.goto(f"{server.address}#t={at_s}")
            answer.wait_for()
            assert words in answer.locator(".big").inner_text()
            assert re.search(r"judged at \d+ s", answer.inner_text())
