"""What a part of the flowsheet is: told to whoever points, touches, or has a keyboard and nothing else."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from tests.console.served import Served

FOCUSED = "document.activeElement.getAttribute('aria-label')"


@pytest.fixture
def sheet(page: Any, console: Served) -> Any:
    """The page, where something is wrong, at its flowsheet."""
    page.goto(console.address)
    page.wait_for_selector(".flowsheet .suspect")
    page.locator(".flowsheet").scroll_into_view_if_needed()
    return page


@pytest.fixture
def tablet(browser: Any, console: Served) -> Iterator[Any]:
    context = browser.new_context(viewport={"width": 800, "height": 1100}, has_touch=True)
    page = context.new_page()
    page.goto(console.address)
    page.wait_for_selector(".flowsheet .suspect")
    yield page
    context.close()


def parts(page: Any) -> int:
    return int(page.locator(".flowsheet .part").count())


def test_the_keyboard_goes_from_part_to_part_and_is_told_what_each_is(sheet: Any) -> None:
    clock = sheet.locator(".clock").inner_text()
    sheet.keyboard.press("4")
    sheet.keyboard.press("Tab")
    told = []
    for _ in range(parts(sheet)):
        label = sheet.evaluate(FOCUSED)
        assert sheet.locator(".tip").inner_text() == label.strip() and label
        told.append(sheet.evaluate("document.activeElement.id"))
        sheet.keyboard.press("ArrowRight")
    assert len(set(told)) == parts(sheet), "each once, and the last stays"
    assert sheet.locator(".clock").inner_text() == clock, "time does not move meanwhile"
    sheet.keyboard.press("Home")
    assert sheet.evaluate("document.activeElement.id") == told[0]
    sheet.keyboard.press("Escape")
    assert sheet.locator(".tip").count() == 0
    sheet.keyboard.press("Enter")
    assert sheet.locator(".tip").is_visible()
    sheet.keyboard.press("Tab")
    assert sheet.locator(".tip").count() == 0 and not sheet.evaluate("document.activeElement.closest('.flowsheet')")
    sheet.keyboard.press("Shift+Tab")
    assert sheet.evaluate("document.activeElement.id") == told[0], "the whole sheet is one stop"


def test_what_may_be_wrong_with_a_part_is_told_with_it(sheet: Any) -> None:
    part = sheet.locator(".flowsheet .part", has=sheet.locator(".suspect")).first
    assert "▲ Cooling valve stuck towards closed" in (part.get_attribute("aria-label") or "")
    part.hover()
    assert "▲ Cooling valve stuck towards closed" in sheet.locator(".tip").inner_text()
    assert part.get_attribute("aria-expanded") == "true"
    sheet.locator("h1, .clock").first.hover()
    assert sheet.locator(".tip").count() == 0


def test_a_finger_is_told_too(tablet: Any) -> None:
    for part in tablet.locator(".flowsheet .part.shape").all():
        part.tap()
        assert tablet.locator(".tip").inner_text() == (part.get_attribute("aria-label") or "").strip()
    flows = tablet.locator(".flowsheet .part:not(.shape)")
    wide = flows.first.locator(".touched").evaluate("e => parseFloat(getComputedStyle(e).strokeWidth)")
    scale = tablet.locator(".flowsheet").evaluate("e => e.getBoundingClientRect().width / e.viewBox.baseVal.width")
    assert wide * scale >= 20.0, "a line can be met by a finger"
    middle = flows.first.locator(".touched").evaluate(
        "e => { const p = e.getPointAtLength(e.getTotalLength() / 2).matrixTransform(e.getScreenCTM());"
        " return [p.x, p.y]; }"
    )
    tablet.touchscreen.tap(*middle)
    assert tablet.locator(".tip").inner_text() in {p.get_attribute("aria-label") for p in flows.all()}
    tablet.locator("h2", has_text="Plant").first.tap()
    assert tablet.locator(".tip").count() == 0


@pytest.mark.parametrize("theme", [pytest.param("light", marks=pytest.mark.wide), "dark"])
def test_axe_finds_nothing_while_a_tip_stands(sheet: Any, theme: str) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-core is not installed").Axe()
    sheet.emulate_media(color_scheme=theme)
    sheet.keyboard.press("4")
    sheet.keyboard.press("Tab")
    assert sheet.locator(".tip").is_visible()
    found = axe.run(sheet)
    assert found.violations_count == 0, found.generate_report()
