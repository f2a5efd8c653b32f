"""What a tag is and what a cost is made up of: told to whoever has a keyboard, or a finger, and nothing else."""

from __future__ import annotations

from typing import Any

import pytest

from tests.console.served import Served
from tests.console.test_tips import tablet  # noqa: F401

BEHIND = "button.behind"


@pytest.fixture
def there(page: Any, console: Served) -> Any:
    page.goto(console.address)
    page.wait_for_selector(f".indicator {BEHIND}")
    page.wait_for_selector(f"td {BEHIND}")
    return page


def test_the_keyboard_is_told_what_a_tag_is(there: Any, console: Served) -> None:
    tags = {tag["name"]: tag for tag in console.ask("/api/run").json["tags"]}
    clock = there.locator(".clock").inner_text()
    there.keyboard.press("2")
    there.keyboard.press("Tab")
    name = there.evaluate("document.activeElement.textContent")
    told = there.locator(".indicator .what")
    assert told.count() == 0
    there.keyboard.press("Enter")
    assert told.inner_text().split("\n") == [tags[name]["text"], *(limit["text"] for limit in tags[name]["limits"])]
    assert there.evaluate("document.activeElement.getAttribute('aria-expanded')") == "true"
    there.keyboard.press("Escape")
    assert told.count() == 0
    there.keyboard.press("Space")
    assert told.is_visible() and there.locator(".clock").inner_text() == clock, "it plays nothing"


def test_the_keyboard_is_told_what_a_cost_is_made_up_of(there: Any, console: Served) -> None:
    moment = console.ask(f"/api/moment?at={console.ask('/api/run').json['decided_s']}").json
    choice = next(c for c in moment["card"]["choices"] if c["items"])
    cost = there.locator(f"td {BEHIND}").first
    cost.focus()
    there.keyboard.press("Enter")
    said = there.locator("td .what").inner_text().split("\n")
    assert said == [f"{name} {value:.1f}" for name, value in choice["items"]]
    assert cost.get_attribute("aria-controls") == there.locator("td .what").get_attribute("id")


def test_a_finger_is_told_both(tablet: Any) -> None:  # noqa: F811
    tablet.wait_for_selector(f"td {BEHIND}")
    for place in (".indicator", "td"):
        button = tablet.locator(f"{place} {BEHIND}").first
        box = button.bounding_box()
        assert min(box["width"], box["height"]) >= 43.9
        button.tap()
        assert tablet.locator(f"{place} .what").inner_text()
        button.tap()
        assert tablet.locator(f"{place} .what").count() == 0
    assert tablet.evaluate("document.documentElement.scrollWidth") <= 800


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_finds_nothing_while_both_are_told(there: Any, theme: str) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-core is not installed").Axe()
    there.emulate_media(color_scheme=theme)
    for place in (".indicator", "td"):
        there.locator(f"{place} {BEHIND}").first.click()
    found = axe.run(there)
    assert found.violations_count == 0, found.generate_report()
