"""Two runs on one time axis: each says what it says alone, from a server and from a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.cli.command import homeostat
from tests.console.served import Browser, accounts, served

pytestmark = pytest.mark.slow


def compared(page: Any, address: str) -> str:
    page.goto(f"{address}#t=1040")
    page.wait_for_selector(".answers")
    page.keyboard.press("c")
    page.wait_for_selector("#compare canvas")
    page.locator("#compare td", has_text="latch").first.wait_for()
    text: str = page.locator("#compare").inner_text()
    page.get_by_label("the first symptom of both at the same place").check()
    page.locator("#compare h2", has_text="than it was").wait_for()
    return text


def test_two_runs_stand_side_by_side(page: Any, recovered_run: Path, handed_over_run: Path, tmp_path: Path) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-core is not installed").Axe()
    with served(recovered_run, "--beside", str(handed_over_run)) as server:
        for path in ("run", "moment?at=1000", "trend?tag=T1&from=0&to=1000&width=100"):
            with served(handed_over_run) as alone:
                theirs = alone.ask(f"/api/{path}")
            told = server.ask(f"/api/other/{path}")
            assert (told.status, told.json) == (200, theirs.json)
        assert server.ask("/api/run").json["beside"] is True
        said = compared(page, server.address)
        found = axe.run(page)
        assert found.violations_count == 0, found.generate_report()
    assert "Cooling valve stuck" in said and "isolate" in said
    out = tmp_path / "two.html"
    command = "export-console", str(recovered_run), "--beside", str(handed_over_run), "--out", str(out)
    assert homeostat(*command, cwd=tmp_path).status == 0
    assert compared(page, out.as_uri()) == said


def test_alone_there_is_no_other_run(page: Any, recovered_run: Path, tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Ada="viewer")
    with served(recovered_run, "--beside", str(recovered_run), "--people", str(people)) as server:
        assert server.ask("/api/other/run").status == 401
        ada = Browser(server)
        ada.sign_in("Ada")
        assert ada.send("/api/other/run", b"", "GET").status == 200
    with served(recovered_run) as server:
        assert server.ask("/api/other/run").status == 404 and not server.ask("/api/run").json["beside"]
        page.goto(server.address)
        page.wait_for_selector(".answers")
        assert page.get_by_role("button", name="Two runs").count() == 0
    done = homeostat("console", str(recovered_run), "--beside", str(tmp_path), cwd=tmp_path)
    assert done.status == 2 and "run directory" in done.err
