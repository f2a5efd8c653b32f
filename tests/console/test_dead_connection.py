"""A connection that is dead and never says so, and answers that overtake each other: a page gets over both."""

from __future__ import annotations

from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest

from tests.console.served import Served

pytestmark = pytest.mark.slow


def held(page: Any, pattern: str, which: Any) -> tuple[list[Any], list[str]]:
    """Requests that ``which`` holds for are never answered; those, and the addresses of all that were sent."""
    kept, sent = list[Any](), list[str]()

    def route(asked: Any) -> None:
        sent.append(asked.request.url)
        if which(asked.request.url, len(sent)):
            kept.append(asked)
        else:
            asked.continue_()

    page.route(pattern, route)
    return kept, sent


def until(page: Any, holds: Any, within_s: float) -> bool:
    """Whether ``holds`` comes true while the page goes on."""
    for _ in range(int(within_s / 0.2)):
        if holds():
            return True
        page.wait_for_timeout(200)
    return False


def test_a_stream_that_says_nothing_is_asked_for_again(page: Any, console: Served) -> None:
    kept, sent = held(page, "**/api/stream*", lambda url, number: number == 1)
    page.goto(console.address)
    page.wait_for_selector(".clock")
    before = page.locator(".clock").inner_text()
    page.keyboard.press("Space")
    assert until(page, lambda: len(sent) > 1, 40.0) and len(kept) == 1
    page.wait_for_function("t => document.querySelector('.clock').innerText !== t", arg=before)


def test_a_trend_whose_answer_never_comes_is_drawn_all_the_same(page: Any, console: Served) -> None:
    kept, sent = held(page, "**/api/trend*", lambda url, number: number == 1)
    page.goto(console.address)
    assert until(page, lambda: bool(kept), 20.0)
    page.keyboard.press("Space")  # time goes on
    tags = parse_qs(urlsplit(sent[0]).query)["tag"]
    assert until(page, lambda: sum(parse_qs(urlsplit(url).query)["tag"] == tags for url in sent) > 1, 60.0)


def test_the_journal_shows_what_was_searched_for_last(page: Any, console: Served) -> None:
    page.goto(console.address)
    page.wait_for_selector(".clock")
    page.keyboard.press("8")
    rows, search = page.locator("#journal tbody tr"), page.locator("#journal input[type=search]")
    rows.first.wait_for()
    kept, _ = held(page, "**/api/journal*", lambda url, number: "released" in url)
    search.fill("released")
    assert until(page, lambda: bool(kept), 20.0)
    search.fill("no such words")
    assert until(page, lambda: rows.count() == 0, 20.0)
    with page.expect_response(lambda answer: "words=released" in answer.url):
        kept[0].continue_()
    page.wait_for_timeout(1000)
    assert rows.count() == 0
