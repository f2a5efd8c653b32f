"""The page under a finger, in a real browser at 800 px: all is large enough, trends move, an approval is given."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("argon2", reason="the extra 'console' is not installed")

from tests.console.served import PASSWORD, Served, accounts, served
from tests.console.test_deciding import LONG_MS, propose, said_of
from tests.console.test_orders import heard, until
from tests.equipment.attended import Attended

pytestmark = pytest.mark.slow
TARGETS = "button, select, input, textarea, a[href], summary, .u-legend .u-series > th"
SMALL = f"""() => [...document.querySelectorAll('{TARGETS}')]
    .map(e => e.matches('[type=checkbox]') ? e.closest('label') : e)
    .filter(e => e.checkVisibility() && !(document.querySelector('dialog[open]') && !e.closest('dialog')))
    .map(e => [e.outerHTML.slice(0, 90), e.getBoundingClientRect()]).map(([text, r]) => [text, r.width, r.height])
    .filter(([, wide, high]) => wide > 0 && (wide < 43.9 || high < 43.9))"""
"""What can be touched and is less than 44 px wide or high."""


@pytest.fixture
def tablet(browser: Any) -> Iterator[Any]:
    """A page that is touched."""
    context = browser.new_context(viewport={"width": 800, "height": 1100}, has_touch=True)
    context.set_default_timeout(LONG_MS)
    page = context.new_page()
    page.on("pageerror", lambda error: pytest.fail(str(error)))
    yield page
    context.close()


class Fingers:
    """Fingers on one page."""

    def __init__(self, page: Any) -> None:
        self._page, self._line = page, page.context.new_cdp_session(page)

    def go(self, *ways: tuple[tuple[float, float], tuple[float, float]], steps: int = 12) -> None:
        """Put a finger down at the start of each of ``ways``, move all to their ends, rest halfway, and lift them."""
        for k in range(steps + 1):
            points = [
                {"x": a[0] + (b[0] - a[0]) * k / steps, "y": a[1] + (b[1] - a[1]) * k / steps, "id": n}
                for n, (a, b) in enumerate(ways)
            ]
            kind = "touchMove" if k else "touchStart"
            self._line.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
            self._page.wait_for_timeout(700 if k == steps // 2 else 25)
        self._line.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})


def shown(page: Any) -> tuple[float, float]:
    """From when to when the trends are [s]."""
    found = re.search(r"(\d+) s to (\d+) s", page.locator("#explorer h2").inner_text())
    assert found is not None
    return float(found[1]), float(found[2])


def settled(page: Any) -> Any:
    """Where the chart is, once it was drawn anew."""
    page.wait_for_timeout(400)
    page.wait_for_selector("#explorer .u-over")
    return page.locator("#explorer .u-over").bounding_box()


def test_everything_that_is_touched_is_large_enough(tablet: Any, console: Served) -> None:
    tablet.goto(console.address)
    tablet.wait_for_selector(".trend canvas")
    assert tablet.evaluate("matchMedia('(pointer: coarse)').matches")
    for view in ("Episode and plant", "Alarms", "Trends", "Journal", "What if"):
        tablet.locator("nav.views").get_by_role("button", name=re.compile(f"^{view}")).tap()
        tablet.wait_for_timeout(800)
        for details in tablet.locator("details:not([open]) summary").all():
            details.tap()
        assert tablet.evaluate(SMALL) == [], view
        assert tablet.evaluate("document.documentElement.scrollWidth") <= 800, view


def test_a_mouse_keeps_its_small_buttons(page: Any, console: Served) -> None:
    page.goto(console.address)
    page.wait_for_selector(".trend canvas")
    assert not page.evaluate("matchMedia('(pointer: coarse)').matches") and page.evaluate(SMALL) != []


def test_a_finger_drags_a_trend_two_pull_it_apart_and_a_touch_marks(tablet: Any, console: Served) -> None:
    tablet.goto(console.address)
    tablet.wait_for_selector(".clock")
    tablet.locator("nav.views").get_by_role("button", name="Trends").tap()
    tablet.wait_for_selector("#explorer .u-over")
    tablet.get_by_role("button", name="10 min").tap()
    box, fingers = settled(tablet), Fingers(tablet)
    middle = box["y"] + box["height"] / 2
    left, right = box["x"] + 0.25 * box["width"], box["x"] + 0.75 * box["width"]
    before = shown(tablet)
    fingers.go(((left, middle), (right, middle)))  # while it rests the chart is made anew under it
    settled(tablet)
    after = shown(tablet)
    wide = before[1] - before[0]
    assert before[0] - after[0] == pytest.approx(0.5 * wide, abs=0.05 * wide), "half of the chart went by"
    assert after[1] - after[0] == pytest.approx(wide, abs=2.0)

    centre = box["x"] + box["width"] / 2
    fingers.go(((centre - 60, middle), (centre - 180, middle)), ((centre + 60, middle), (centre + 180, middle)))
    settled(tablet)
    near = shown(tablet)
    assert near[1] - near[0] == pytest.approx(wide / 3, rel=0.1), "three times as far apart"
    assert sum(near) / 2 == pytest.approx(sum(after) / 2, abs=0.05 * wide), "around what is between them"
    fingers.go(((centre - 180, middle), (centre - 60, middle)), ((centre + 180, middle), (centre + 60, middle)))
    settled(tablet)
    assert shown(tablet)[1] - shown(tablet)[0] == pytest.approx(wide, rel=0.1)

    from_s, to_s = shown(tablet)
    tablet.touchscreen.tap(box["x"] + 0.5 * box["width"], middle)
    tablet.get_by_text("Mark at").wait_for()
    marked = re.search(r"Mark at (\d+) s", tablet.locator("#explorer").inner_text())
    assert marked is not None and float(marked[1]) == pytest.approx((from_s + to_s) / 2, abs=0.02 * wide + 5.0)
    assert shown(tablet) == (from_s, to_s)


def test_a_finger_that_goes_down_the_page_scrolls_it(tablet: Any, console: Served) -> None:
    tablet.goto(console.address)
    tablet.wait_for_selector(".clock")
    tablet.set_viewport_size({"width": 800, "height": 420})
    tablet.locator("nav.views").get_by_role("button", name="Trends").tap()
    tablet.wait_for_selector("#explorer .u-over")
    tablet.locator("#explorer .u-over").scroll_into_view_if_needed()
    box, before, top = settled(tablet), shown(tablet), tablet.evaluate("scrollY")
    x = box["x"] + box["width"] / 2
    Fingers(tablet).go(((x, 330), (x, 130)))
    tablet.wait_for_timeout(400)
    assert abs(tablet.evaluate("scrollY") - top) > 50 and shown(tablet) == before


def test_a_finger_reads_a_chart_of_the_episode(tablet: Any, console: Served) -> None:
    tablet.goto(console.address)
    chart = tablet.locator("#trends .u-over").first
    chart.wait_for()
    chart.scroll_into_view_if_needed()
    tablet.wait_for_timeout(500)
    box, legend = chart.bounding_box(), tablet.locator("#trends .u-legend").first
    before = legend.inner_text()
    y = box["y"] + box["height"] / 2
    Fingers(tablet).go(((box["x"] + 50, y), (box["x"] + 120, y)))
    tablet.wait_for_function("t => document.querySelector('#trends .u-legend').innerText !== t", arg=before)


def test_an_approval_is_given_by_touch(tablet: Any, tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Bo="operator")
    with Attended(tmp_path / "l") as service, served(service.directory, "--people", str(people)) as server:
        tablet.goto(server.address)
        tablet.wait_for_selector("form")
        assert tablet.evaluate(SMALL) == []
        tablet.get_by_label("Name").fill("Bo")
        tablet.get_by_label("Password").fill(PASSWORD.format("Bo"))
        tablet.get_by_role("button", name="Sign in").tap()
        tablet.wait_for_selector(".clock")
        request, _ = propose(service)
        tablet.get_by_role("button", name="Approve …").tap()
        tablet.wait_for_selector("dialog[open]")
        assert tablet.evaluate(SMALL) == []
        tablet.locator("dialog textarea").fill("seen")
        tablet.locator("dialog input[type=password]").fill(PASSWORD.format("Bo"))
        sent = len(service.sent)
        tablet.locator("dialog .act").tap()
        assert "✓ Done" in said_of(tablet)
        until(lambda: len(service.sent) > sent)
        assert [h["reason"] for h in heard(service) if h["subject"] == request] == ["seen"]
