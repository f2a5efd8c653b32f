"""The page in a real browser, and what of it is shipped."""

from __future__ import annotations

import gzip
import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from tests.console.served import Served, served
from tests.console.test_hostile import MARKUP, hostile_run

MOST_BYTES = 120_000
"""What the page may weigh, compressed."""


def test_the_page_is_small_and_needs_no_network() -> None:
    static = files("homeostat.console.server").joinpath("static")
    contents = {name: static.joinpath(name).read_bytes() for name in ("index.html", "console.js", "console.css")}
    assert sum(len(gzip.compress(content)) for content in contents.values()) < MOST_BYTES
    assert b"//" not in contents["index.html"] and b"url(" not in contents["console.css"]
    assert b"http://www.w3.org/" in contents["console.js"]  # names of SVG, which nobody fetches
    assert contents["console.js"].count(b"://") == contents["console.js"].count(b"://www.w3.org/")
    licences = static.joinpath("LICENSES.txt").read_text(encoding="utf-8")
    assert "preact" in licences and "uplot" in licences and licences.count("MIT") >= 2


def test_ten_seconds_answer_four_questions(page: Any, console: Served) -> None:
    page.goto(console.address)
    page.wait_for_selector(".trend canvas")
    card = page.get_by_role("region", name="Episode")
    for question in ("What is wrong", "What is proposed", "Why it is safe", "How long is left"):
        assert card.get_by_role("heading", name=question).is_visible()
    moment = console.ask(f"/api/moment?at={console.ask('/api/run').json['decided_s']}").json
    worst = moment["card"]["proposal"]["margins"][0]
    answers = page.locator(".answers").inner_text()
    assert "Cooling valve stuck towards closed" in answers and "Reduced load" in answers
    assert f"+{float(format(worst['margin'], '.3g'))} {worst['unit']} to spare at worst" in answers
    assert re.search(r"If nothing is done, the first hard limit is reached in \d+ s to ", answers)
    bands = page.get_by_role("img", name="T1: with the proposal")
    assert bands.count() == 1 and bands.locator("polygon").count() == 2 and bands.locator(".bound").count() >= 1
    assert page.locator(".flowsheet .suspect").count() == 1 and page.locator(".uplot canvas").first.is_visible()


def test_the_keyboard_is_enough(page: Any, console: Served) -> None:
    last_s = console.ask("/api/run").json["last_s"]
    page.goto(f"{console.address}#t=900")
    clock = page.locator(".clock")
    assert clock.inner_text().startswith("900 s")
    page.keyboard.press("ArrowRight")
    page.locator(".clock", has_text=re.compile(r"^910 s")).wait_for()
    # Two presses in one breath: the second one goes on from the first.
    page.evaluate("for (let k = 0; k < 2; k++) dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowLeft' }))")
    page.locator(".clock", has_text=re.compile(r"^890 s")).wait_for()
    page.keyboard.press("End")
    page.locator(".clock", has_text=re.compile(rf"^{last_s:.0f} s")).wait_for()
    page.keyboard.press("e")
    page.keyboard.press("+")
    page.keyboard.press("Space")
    page.wait_for_selector("button[aria-pressed=true]:has-text('Pause')")
    page.keyboard.press("Space")
    page.wait_for_selector("button[aria-pressed=false]:has-text('Play')")
    theme = page.evaluate("document.documentElement.dataset.theme")
    page.keyboard.press("t")
    assert page.evaluate("document.documentElement.dataset.theme") != theme
    page.keyboard.press("4")
    assert page.evaluate("document.activeElement.id") == "plant"


@pytest.mark.parametrize("width", [800, 1280, 1920])
def test_nothing_is_cut_off_at_the_side(page: Any, console: Served, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 900})
    page.goto(console.address)
    page.wait_for_selector(".uplot canvas")
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_hostile_texts_are_shown_as_texts(page: Any, tmp_path: Path) -> None:
    with served(hostile_run(tmp_path)) as server:
        page.goto(f"{server.address}#t=7")
        page.wait_for_selector(".answers")
        assert MARKUP in page.locator(".answers").inner_text()
        assert page.locator("img, body script").count() == 0
        assert "taken" not in page.title()[:8]
