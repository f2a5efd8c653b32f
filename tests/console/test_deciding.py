"""People decide on the page, in a real browser, over a real guard: what they saw is what is written, and once."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("argon2", reason="the extra 'console' is not installed")

from homeostat.domain.mode import Mode
from tests.console.served import PASSWORD, Served, accounts, served
from tests.console.test_orders import heard, until
from tests.equipment.attended import Attended

pytestmark = pytest.mark.slow
LONG_MS = 30_000.0


@pytest.fixture(scope="module")
def people(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("people")
    return accounts(folder / "people.json", Ada="engineer", Bo="operator", Cem="engineer", Vi="viewer")


@pytest.fixture(scope="module")
def attended(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Attended]:
    with Attended(tmp_path_factory.mktemp("live") / "l") as service:
        yield service


@pytest.fixture(scope="module")
def desk(attended: Attended, people: Path) -> Iterator[Served]:
    with served(attended.directory, "--people", str(people)) as server:
        yield server


@contextlib.contextmanager
def at(browser: Any, server: Served, name: str) -> Iterator[Any]:
    """A page at which ``name`` has signed in."""
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    context.set_default_timeout(LONG_MS)
    page = context.new_page()
    page.goto(server.address)
    sign_in(page, name)
    yield page
    context.close()


def sign_in(page: Any, name: str) -> None:
    page.get_by_label("Name").fill(name)
    page.get_by_label("Password").fill(PASSWORD.format(name))
    page.keyboard.press("Enter")
    page.wait_for_selector(".clock")


def propose(attended: Attended, target_K: float = 305.0) -> tuple[str, str]:
    """What waits for a yes: the request, and the digest."""
    name, actions = attended.propose(target_K)
    until(lambda: name in {request.id for request in attended.world.guard.offered})
    return name, actions.digest


def said_of(page: Any) -> str:
    """What the open dialog says came of it."""
    page.wait_for_selector("dialog .big, dialog .warn")
    return str(page.locator("dialog [role=status]").inner_text())


def confirm(page: Any, name: str, reason: str = "") -> str:
    """Give reason and password in the open dialog, and what came of it."""
    page.locator("dialog textarea").fill(reason)
    page.locator("dialog input[type=password]").fill(PASSWORD.format(name))
    page.keyboard.press("Enter")
    return said_of(page)


def close(page: Any) -> None:
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")


def test_an_approval_with_the_keyboard_alone(browser: Any, desk: Served, attended: Attended) -> None:
    with at(browser, desk, "Bo") as page:
        request, digest = propose(attended)
        page.wait_for_selector(".decision")
        assert digest[:16] in page.locator(".decision").inner_text()
        sent = len(attended.sent)
        page.keyboard.press("a")
        page.wait_for_selector("dialog[open]")
        assert digest[:16] in page.locator("dialog").inner_text() and "305" in page.locator("dialog").inner_text()
        assert page.evaluate("document.activeElement.tagName") == "TEXTAREA"
        page.keyboard.type("looks right, t r a 1 ?")
        page.keyboard.press("Tab")
        page.keyboard.type("not the password")
        page.keyboard.press("Enter")
        assert "do not belong together" in said_of(page) and len(attended.sent) == sent
        page.keyboard.type(PASSWORD.format("Bo"))
        page.keyboard.press("Enter")
        page.get_by_text("✓ Done").wait_for()
        close(page)
        until(lambda: len(attended.sent) > sent)
        page.wait_for_selector(".decision", state="detached")
        (order,) = [h for h in heard(attended) if h["subject"] == request]
        assert (order["verb"], order["done"], order["reason"]) == ("approve", True, "looks right, t r a 1 ?")
        assert order["person"].startswith("Bo (login ") and len(attended.sent) == sent + 1


def test_a_rejection_with_a_reason(browser: Any, desk: Served, attended: Attended) -> None:
    with at(browser, desk, "Bo") as page:
        propose(attended)
        page.wait_for_selector(".decision")
        sent = len(attended.sent)
        page.get_by_role("button", name="Reject …").click()
        assert page.locator("dialog textarea").evaluate("field => field.required")
        assert "✓ Done" in confirm(page, "Bo", "the valve was opened by hand")
        close(page)
        page.wait_for_selector(".decision", state="detached")
        assert len(attended.sent) == sent and heard(attended)[-1]["reason"] == "the valve was opened by hand"
        said = page.locator(".answers .later, .answers .status").all_inner_texts()
        assert any("refused by Bo" in text and "the valve was opened by hand" in text for text in said)


def test_what_was_refused_is_not_shown_as_proposed_nor_its_margin_as_safe(
    browser: Any, people: Path, tmp_path: Path
) -> None:
    with (
        Attended(tmp_path / "l") as service,
        served(service.directory, "--people", str(people)) as server,
        at(browser, server, "Bo") as page,
    ):
        propose(service)
        page.wait_for_selector(".decision")
        assert "waits for a person" in page.locator(".answers > div", has_text="What is proposed").inner_text()
        page.keyboard.press("r")
        assert "✓ Done" in confirm(page, "Bo", "the valve was opened by hand")
        close(page)
        page.wait_for_selector(".decision", state="detached")
        assert "Nothing any more" in page.locator(".answers > div", has_text="What is proposed").inner_text()
        assert page.locator(".answers > div", has_text="Why it is safe").count() == 0
        refused = page.locator(".answers > div", has_text="What was refused and why").inner_text()
        assert "refused by Bo" in refused and "the valve was opened by hand" in refused


def test_two_operators_at_once_write_once(browser: Any, desk: Served, attended: Attended) -> None:
    with at(browser, desk, "Bo") as bo, at(browser, desk, "Ada") as ada:
        propose(attended)
        for page in (bo, ada):
            page.wait_for_selector(".decision")
            page.keyboard.press("a")
            page.wait_for_selector("dialog[open]")
        sent = len(attended.sent)
        assert "✓ Done" in confirm(bo, "Bo")
        ada.get_by_text("does not wait any more").wait_for()
        assert ada.locator("dialog .act").is_disabled()
        until(lambda: len(attended.sent) > sent)
        assert len(attended.sent) == sent + 1


def test_what_waits_now_is_not_approved_by_a_dialog_of_what_waited_before(
    browser: Any, desk: Served, attended: Attended
) -> None:
    with at(browser, desk, "Bo") as bo, at(browser, desk, "Ada") as ada:
        _, before = propose(attended, 304.0)
        bo.wait_for_selector(".decision")
        bo.keyboard.press("a")
        bo.wait_for_selector("dialog[open]")
        ada.wait_for_selector(".decision")
        ada.keyboard.press("r")
        ada.wait_for_selector("dialog[open]")
        assert "✓ Done" in confirm(ada, "Ada", "another one comes")
        _, after = propose(attended, 307.0)
        bo.get_by_text("does not wait any more").wait_for()
        shown = bo.locator("dialog").inner_text()
        assert before[:16] in shown and after[:16] not in shown and bo.locator("dialog .act").is_disabled()
        close(bo)
        bo.locator(".decision", has_text=after[:16]).wait_for()
        bo.keyboard.press("r")
        assert "✓ Done" in confirm(bo, "Bo", "tidy")


def test_a_lost_answer_is_asked_for_again_and_written_once(browser: Any, desk: Served, attended: Attended) -> None:
    with at(browser, desk, "Bo") as page:
        request, _ = propose(attended)
        page.wait_for_selector(".decision")
        sent, lost = len(attended.sent), list[str]()

        def lose(route: Any) -> None:
            if lost:
                route.continue_()
                return
            lost.append(route.fetch().text())  # the guard has carried it out, and the page never hears of it
            route.abort()

        page.route("**/api/order", lose)
        page.keyboard.press("a")
        page.wait_for_selector("dialog[open]")
        assert "Nobody knows yet" in confirm(page, "Bo", "once")
        assert '"done":true' in lost[0]
        page.wait_for_selector(".decision", state="detached")  # the page has been told that nothing waits any more
        page.locator("dialog input[type=password]").fill(PASSWORD.format("Bo"))
        page.keyboard.press("Enter")
        page.get_by_text("✓ Done").wait_for()
        until(lambda: len(attended.sent) > sent)
        assert len(attended.sent) == sent + 1
        assert len([h for h in heard(attended) if h["subject"] == request]) == 1


def test_a_clock_that_is_wrong_at_the_page_changes_nothing(browser: Any, desk: Served, attended: Attended) -> None:
    with at(browser, desk, "Bo") as page:
        page.evaluate("const now = Date.now; Date.now = () => now() - 86_400_000 * 365")
        propose(attended)
        page.wait_for_selector(".decision")
        assert "void in" in page.locator(".decision").inner_text() and not page.locator(".stale").count()
        page.keyboard.press("a")
        assert "✓ Done" in confirm(page, "Bo", "by the right clock")


def test_closed_loop_needs_two_and_a_viewer_sees_no_button(browser: Any, desk: Served, attended: Attended) -> None:
    for name, words in (("Ada", "1 of 2 people"), ("Cem", "✓ Done")):
        with at(browser, desk, name) as page:
            page.get_by_role("button", name="Mode …").click()
            page.locator("dialog select").select_option("closed-loop")
            assert words in confirm(page, name, "quiet for days")
    assert attended.world.guard.mode is Mode.CLOSED_LOOP
    with at(browser, desk, "Ada") as page:
        page.get_by_role("button", name="Mode …").click()
        page.locator("dialog select").select_option("approve")
        assert "✓ Done" in confirm(page, "Ada")
        close(page)
        page.locator(".fact", has_text="approve").wait_for()
    with at(browser, desk, "Vi") as page:
        propose(attended)
        page.locator(".answers .status", has_text="waits for a person").wait_for()
        assert page.locator(".orders button, .decision").count() == 0
        page.keyboard.press("a")
        assert page.locator("dialog").count() == 0


def test_a_proposal_that_expires_cannot_be_approved(browser: Any, people: Path, tmp_path: Path) -> None:
    with (
        Attended(tmp_path / "l", person_s=200.0) as service,
        served(service.directory, "--people", str(people)) as server,
        at(browser, server, "Bo") as page,
    ):
        propose(service)
        page.wait_for_selector(".decision")
        page.keyboard.press("a")
        page.get_by_text("does not wait any more").wait_for()
        assert page.locator("dialog .act").is_disabled()
        assert "T.sp" not in {c.tag for commands in service.sent for c in commands}


def test_a_service_that_stops_makes_the_page_old_and_one_that_begins_again_makes_it_live(
    browser: Any, people: Path, tmp_path: Path
) -> None:
    service = Attended(tmp_path / "l")
    with served(service.directory, "--people", str(people)) as server, at(browser, server, "Bo") as page:
        propose(service)
        page.wait_for_selector(".decision")
        assert page.locator(".stale").count() == 0
        service.close()
        page.locator(".stale", has_text="no service runs").wait_for()
        assert page.evaluate("getComputedStyle(document.querySelector('main.old')).display") == "grid"
        with Attended(tmp_path / "l"):
            page.wait_for_selector(".stale", state="detached")
            page.wait_for_selector(".decision", state="detached")  # a guard that begins again knows of no request


def test_a_page_outlives_its_server_and_says_so_meanwhile(browser: Any, people: Path, attended: Attended) -> None:
    with served(attended.directory, "--people", str(people)) as first, at(browser, first, "Bo") as page:
        port = first.port
        first.process.send_signal(signal.SIGINT)
        page.get_by_text("The console does not answer").wait_for()
        first.process.wait(30.0)
        with served(attended.directory, "--people", str(people), port=port):
            page.get_by_role("form", name="Sign in").wait_for()  # sessions end with the server
            sign_in(page, "Bo")
            assert page.locator(".stale").count() == 0
