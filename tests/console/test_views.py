"""Alarms, trends and journal in a real browser; nothing that axe-core objects to, in both themes and three widths."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from homeostat.domain.alarm import Priority
from tests.console.served import Served, accounts, served
from tests.console.test_deciding import at, close, confirm
from tests.console.test_orders import heard, until
from tests.equipment.attended import Attended

pytestmark = pytest.mark.slow


def test_an_alarm_is_acknowledged_shelved_and_shown_again(browser: Any, tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Bo="operator")
    with (
        Attended(tmp_path / "l") as service,
        served(service.directory, "--people", str(people)) as server,
        at(browser, server, "Bo") as page,
    ):
        service.world.guard._parts.alarms.say("odd", "the pump is odd", Priority.HIGH, service.world.vessel.now_s)
        page.keyboard.press("6")
        row = page.locator(".alarmrow", has_text="the pump is odd")
        row.get_by_role("button", name="Shelve …").click()
        page.locator("dialog input[type=number]").fill("5")
        page.locator("dialog textarea").fill("known")
        page.get_by_role("button", name="Shelve", exact=True).click()
        page.get_by_text("✓ Done").wait_for()
        close(page)
        row.get_by_text("⏸ shelved").wait_for()
        assert "known" in row.inner_text() and "by Bo" in row.inner_text()
        row.get_by_role("button", name="Show again …").click()
        page.get_by_role("button", name="Show again", exact=True).click()
        page.get_by_text("✓ Done").wait_for()
        close(page)
        row.get_by_role("button", name="Acknowledge …").click()
        page.get_by_role("button", name="Acknowledge", exact=True).click()
        page.get_by_text("✓ Done").wait_for()
        close(page)
        until(lambda: [h["verb"] for h in heard(service)] == ["shelve", "unshelve", "acknowledge"])
        page.get_by_text("No alarm stands.").wait_for()


def test_trends_are_panned_zoomed_marked_and_taken_away(page: Any, console: Served) -> None:
    page.goto(console.address)
    page.wait_for_selector(".clock")
    page.keyboard.press("7")
    title = page.locator("#explorer h2")
    page.wait_for_selector("#explorer .u-over")
    before = title.inner_text()
    page.locator(".plot").focus()
    page.keyboard.press("+")
    page.wait_for_function("t => document.querySelector('#explorer h2').innerText !== t", arg=before)
    zoomed = title.inner_text()
    page.keyboard.press("ArrowLeft")
    page.wait_for_function("t => document.querySelector('#explorer h2').innerText !== t", arg=zoomed)
    page.locator("#explorer select").select_option("L1")
    page.locator("#explorer .u-legend", has_text="L1").wait_for()
    page.locator("#explorer .u-over").click(position={"x": 200, "y": 100})
    page.get_by_text("Mark at").wait_for()
    with page.expect_download() as taken:
        page.get_by_role("button", name="Picture (PNG)").click()
    assert Path(taken.value.path()).read_bytes().startswith(b"\x89PNG")
    with page.expect_download() as taken:
        page.get_by_role("link", name="Export (CSV)").click()
    assert Path(taken.value.path()).read_text().startswith("time_s,T1,")


def test_the_journal_is_searched_on_the_page(page: Any, console: Served) -> None:
    page.goto(console.address)
    page.wait_for_selector(".clock")
    page.keyboard.press("8")
    page.get_by_text(re.compile("unaltered up to line")).wait_for()
    page.locator("#journal input[type=search]").fill("released")
    page.locator("#journal tbody tr", has_text="released").first.wait_for()


@pytest.mark.parametrize(
    ("width", "theme"),
    [
        *((800, "dark"), (1920, "light")),
        *(
            pytest.param(width, theme, marks=pytest.mark.wide)
            for width, theme in ((800, "light"), (1280, "light"), (1280, "dark"), (1920, "dark"))
        ),
    ],
)
def test_axe_core_finds_nothing(browser: Any, console: Served, theme: str, width: int) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-core is not installed").Axe()
    page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=theme)
    page.goto(console.address)
    page.wait_for_selector(".trend canvas")
    for view in "06789":
        page.keyboard.press(view)
        page.wait_for_timeout(600)
        if view == "9":
            page.get_by_role("button", name="Try it on the twin").click()
            page.wait_for_selector(".answer", timeout=60_000)
        found = axe.run(page)
        assert found.violations_count == 0, found.generate_report()
    page.close()


def test_axe_core_finds_nothing_where_people_sign_in_and_decide(browser: Any, tmp_path: Path) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-core is not installed").Axe()
    people = accounts(tmp_path / "people.json", Ada="engineer")
    with Attended(tmp_path / "l") as service, served(service.directory, "--people", str(people)) as server:
        page = browser.new_page()
        page.goto(server.address)
        page.wait_for_selector("form")
        found = axe.run(page)
        assert found.violations_count == 0, found.generate_report()
        page.close()
        with at(browser, server, "Ada") as page:
            service.propose()
            page.wait_for_selector(".decision")
            page.keyboard.press("a")
            page.wait_for_selector("dialog[open]")
            found = axe.run(page)
            assert found.violations_count == 0, found.generate_report()
            assert "do not belong" not in confirm(page, "Ada")
