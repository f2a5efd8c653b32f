"""What is abnormal, and which line is which, is told without colour."""

from __future__ import annotations

import re
from typing import Any

from tests.console.served import Served

LEGENDS = """() => [...document.querySelectorAll('#trends .u-legend')].map(l =>
    [...l.querySelectorAll('.u-series')].slice(1)
        .map(s => getComputedStyle(s.querySelector('.u-marker'))).map(c => c.background))"""
WIDTHS = "kind => [...document.querySelectorAll(kind)].map(e => e.getBoundingClientRect().width)"


def test_lines_limits_and_unusual_readings_are_told_apart_without_colour(page: Any, console: Served) -> None:
    page.goto(console.address)
    page.wait_for_selector("#trends .u-legend")
    page.wait_for_timeout(1000)
    legends = [[re.sub(r"rgba?\([\d., ]+\)", "", marker) for marker in legend] for legend in page.evaluate(LEGENDS)]
    assert max(map(len, legends)) >= 3 and all(len(set(legend)) == len(legend) for legend in legends)
    hard, other = page.evaluate(WIDTHS, ".limit.hard .tick"), page.evaluate(WIDTHS, ".limit:not(.hard) .tick")
    assert hard and other and min(hard) >= 2.0 * max(other)
    unusual = page.locator(".indicator.unusual .value").first
    assert unusual.inner_text().startswith("◇")
    assert int(unusual.evaluate("e => getComputedStyle(e).fontWeight")) >= 600
