"""Single sign-on in a real browser, at a provider of another site: signing in, and an approval that is proven there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("authlib", reason="the extra 'console' is not installed")

from tests.console.served import accounts, served
from tests.console.test_deciding import LONG_MS, propose, said_of
from tests.console.test_orders import heard, until
from tests.equipment.attended import Attended
from tests.equipment.oidc.providing import providing

pytestmark = pytest.mark.slow


def fill(page: Any, who: str) -> None:
    """Sign in at the provider with the keyboard."""
    page.wait_for_selector("input[name=login]")
    page.locator("input[name=login]").focus()
    page.keyboard.type(who)
    page.keyboard.press("Tab")
    page.keyboard.type("anything")
    page.keyboard.press("Enter")


def test_somebody_signs_in_and_approves_by_the_provider_with_the_keyboard_alone(browser: Any, tmp_path: Path) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-core is not installed").Axe()
    people = accounts(tmp_path / "people.json", Ada="engineer")
    with providing() as provider, Attended(tmp_path / "l") as service:
        options = ("--people", str(people), "--sign-on", str(provider.settings(tmp_path)))
        with served(service.directory, *options, port=provider.console) as server:
            context = browser.new_context(viewport={"width": 800, "height": 900})
            context.set_default_timeout(LONG_MS)
            page = context.new_page()
            page.goto(server.address)
            link = page.get_by_role("link", name="Sign in with Works login")
            link.wait_for()
            found = axe.run(page)
            assert found.violations_count == 0, found.generate_report()
            link.focus()
            page.keyboard.press("Enter")
            fill(page, "op.hal")
            page.wait_for_selector(".clock")
            assert "hal, operator" in page.locator(".who").inner_text()
            assert not [c for c in context.cookies() if c["name"].startswith("homeostat-sign-on")]
            (cookie,) = [c for c in context.cookies() if c["name"] == f"homeostat-{provider.console}"]
            assert cookie["sameSite"] == "Strict" and cookie["httpOnly"]

            request, digest = propose(service)
            page.wait_for_selector(".decision")
            sent = len(service.sent)
            page.keyboard.press("a")
            page.wait_for_selector("dialog[open]")
            assert digest[:16] in page.locator("dialog").inner_text()
            assert (
                page.locator("dialog input[type=password]").count() == 0 and page.locator("dialog .act").is_disabled()
            )
            found = axe.run(page)
            assert found.violations_count == 0, found.generate_report()
            page.keyboard.type("seen")
            page.keyboard.press("Tab")
            with context.expect_page() as opened:
                page.keyboard.press("Enter")
            fill(opened.value, "op.hal")
            opened.value.get_by_text("It is known that it is you").wait_for()
            opened.value.close()
            page.get_by_text("✓ Works login says that it is you").wait_for()
            page.locator("dialog .act:enabled").focus()
            page.keyboard.press("Enter")
            assert "✓ Done" in said_of(page)
            until(lambda: len(service.sent) > sent)
            (order,) = [h for h in heard(service) if h["subject"] == request]
            assert order["person"].startswith("hal (login ") and order["reason"] == "seen"
            context.close()
