"""The sign-in page in a real browser: password and code with the keyboard alone, and axe-core finds nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("pyotp", reason="the extra 'console' is not installed")

from homeostat.console.people.accounts import Asked
from homeostat.console.people.changes import enrolled, required
from tests.console.served import PASSWORD, accounts, code_of, served
from tests.console.test_deciding import confirm, propose
from tests.console.test_orders import until
from tests.equipment.attended import Attended

pytestmark = pytest.mark.slow
SECRET = "GEZDGNBVGY3TQOJQGEZDGNBVGY3TQOJQ"


@pytest.mark.parametrize("theme", ["light", pytest.param("dark", marks=pytest.mark.wide)])
def test_password_and_code_with_the_keyboard_alone(browser: Any, tmp_path: Path, theme: str) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-core is not installed").Axe()
    people = accounts(tmp_path / "people.json", Bo="operator", Cem="operator")
    enrolled(people, "Bo", SECRET)
    required(people, Asked.ORDERING)
    with Attended(tmp_path / "l") as service, served(service.directory, "--people", str(people)) as server:
        page = browser.new_page(color_scheme=theme, viewport={"width": 800, "height": 900})
        page.goto(server.address)
        page.wait_for_selector("input[name=code]")
        found = axe.run(page)
        assert found.violations_count == 0, found.generate_report()
        assert page.evaluate("document.activeElement.name") == "name"

        def enter(name: str, code: str) -> None:
            page.keyboard.type(name)
            page.keyboard.press("Tab")
            page.keyboard.type(PASSWORD.format(name))
            page.keyboard.press("Tab")
            page.keyboard.type(code)
            page.keyboard.press("Enter")

        enter("Bo", "000000")
        page.get_by_role("alert").get_by_text("do not belong together").wait_for()
        assert page.evaluate("document.activeElement.name") == "password"
        page.keyboard.type(PASSWORD.format("Bo"))
        page.keyboard.press("Tab")
        page.keyboard.type(code_of(SECRET))
        page.keyboard.press("Enter")
        page.wait_for_selector(".clock")
        propose(service)
        page.wait_for_selector(".decision")
        sent = len(service.sent)
        page.keyboard.press("a")
        assert "✓ Done" in confirm(page, "Bo", "password again, no code")
        until(lambda: len(service.sent) > sent)
        page.close()
        page = browser.new_page()
        page.goto(server.address)
        page.wait_for_selector("input[name=code]")
        enter("Cem", "")
        page.get_by_role("alert").get_by_text("needs a second factor").wait_for()
        page.close()
