"""What the page says is so: time left in advise, moves and later steps, altered journals, ended sessions, plants."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from homeostat.cli.commands.console import opened
from homeostat.console.outlook import Until
from homeostat.console.view import seen
from homeostat.journal.beside.files import JOURNAL
from homeostat.record.directory import TRAJECTORY
from tests.console.served import Served, accounts, served
from tests.console.test_deciding import at, close
from tests.console.test_hostile import hostile_run
from tests.console.test_orders import until
from tests.equipment.attended import Attended
from tests.guard.vessel import POUR

pytestmark = pytest.mark.slow
TIMES = re.compile(r"\b(\d+ s to |at any moment, within )\d+ s\b")


def test_in_advise_the_time_to_the_limit_stands_above_and_no_fallback_is_promised(page: Any, advised_run: Path) -> None:
    run = opened(advised_run, None)
    heads = {at_s: seen(run, float(at_s)).overview for at_s in range(900, int(run.last_s), 3)}
    ahead = [at_s for at_s, line in heads.items() if line.left.until is Until.LIMIT]
    beyond = [at_s for at_s, line in heads.items() if line.left.until is Until.BEYOND]
    assert len(ahead) > 6 and len(beyond) > 3 and all(heads[at_s].level == "critical" for at_s in beyond)
    after = [heads[at_s] for at_s in range(ahead[0], int(run.last_s), 3)]
    assert {line.left.until for line in after} == {Until.LIMIT, Until.BEYOND}
    assert {line.level for line in after} == {"high", "critical"}
    with served(advised_run) as server:
        for at_s in (ahead[3], beyond[-1]):
            page.goto("about:blank")
            page.goto(f"{server.address}#t={at_s}")
            page.wait_for_selector(".answers")
            said = f"{page.locator('.overview').inner_text()} {page.locator('.answers').inner_text()}"
            assert "allback" not in said and "no deadline" not in said.lower(), said
            assert "a person at the plant" in page.locator(".fact", has_text="Waiting for").inner_text()
            if at_s in beyond:
                assert "Beyond a hard limit: Highest reactor temperature" in said and "Critical" in said
            else:
                assert len(TIMES.findall(said)) >= 2 and "High" in said


def test_the_picture_that_a_recorded_run_opens_on_has_its_time(page: Any, console: Served) -> None:
    page.goto(console.address)
    page.wait_for_selector(".answers")
    left = page.locator(".answers > div", has_text="How long is left")
    assert TIMES.search(left.inner_text()) and "until hard limit ‘Highest reactor" in left.inner_text()
    assert "the guard: check what was decided" in page.locator(".overview").inner_text()


def test_every_move_is_told_and_two_numbers_are_told_apart(page: Any, advised_run: Path) -> None:
    run = opened(advised_run, None)
    cards = {at_s: seen(run, float(at_s)).card for at_s in range(905, int(run.last_s))}
    with served(advised_run) as server:
        for at_s in (905, int(run.last_s) - 1):
            card = cards[at_s]
            assert card is not None and card.proposal is not None
            page.goto("about:blank")
            page.goto(f"{server.address}#t={at_s}")
            page.wait_for_selector(".answers")
            chips = page.locator(".answers .chip").all_inner_texts()
            moves = [m for m in card.proposal.moves if not m.known or m.before != m.after]
            more = [int(found[1]) for chip in chips if (found := re.match(r"and (\d+) more", chip))]
            assert len([c for c in chips if "→" in c]) + sum(more) == len(moves)
            for chip in chips:
                before, _, after = chip.partition(" → ")
                assert before.partition(" ")[2] != after


def test_the_dialog_shows_what_would_be_written_to_the_last_step(browser: Any, tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Bo="operator")
    with (
        Attended(tmp_path / "l") as service,
        served(service.directory, "--people", str(people)) as server,
        at(browser, server, "Bo") as page,
    ):
        name, actions = service.propose(305.0, POUR)
        until(lambda: name in {request.id for request in service.world.guard.offered})
        page.wait_for_selector(".decision")
        assert "then 1 step more" in page.locator(".answers").inner_text()
        page.keyboard.press("a")
        shown = page.locator("dialog .about").inner_text()
        assert actions.digest[:16] in shown and "L >= 9" in shown and "emptying" in shown
        rows = [" ".join(text.split()) for text in page.locator("dialog .about tbody tr").all_inner_texts()]
        assert rows[0].startswith("T.sp") and "→ 305 0.5/s" in rows[0]
        assert any(row.startswith("V.man") and "→ 1" in row and "0.2/s" in row for row in rows[2:])
        (pour,) = [row for row in rows[2:] if row.startswith("F.sp")]
        assert "0.02 → 0 " in pour, "from what the first step has brought it to"
        close(page)


def test_the_time_of_an_altered_journal_ends_with_its_last_good_line(
    page: Any, recovered_run: Path, tmp_path: Path
) -> None:
    bad = tmp_path / "bad"
    shutil.copytree(recovered_run, bad)
    lines = (bad / JOURNAL).read_bytes().splitlines(keepends=True)
    number = next(n for n, line in enumerate(lines) if b'"released"' in line)
    lines[number] = lines[number].replace(b'"released"', b'"relaesed"', 1)
    (bad / JOURNAL).write_bytes(b"".join(lines))
    run = opened(bad, None)
    assert run.readings is not None and run.readings.last_s > run.last_s == run.entries[-1].at_s
    with served(bad) as server:
        page.goto(f"{server.address}#t=1e308")
        banner = page.locator(".stale[role=alert]")
        assert "ALTERED" in banner.inner_text() and f"line {number + 2} " in banner.inner_text()
        page.keyboard.press("End")
        page.locator(".clock", has_text=re.compile(rf"^{run.last_s:.0f} s of {run.last_s:.0f} s")).wait_for()


@pytest.mark.parametrize(("asked", "shown"), [("1e308", "last"), ("-5", "0 s")])
def test_a_moment_beyond_the_run_is_its_nearest(page: Any, console: Served, asked: str, shown: str) -> None:
    last_s = console.ask("/api/run").json["last_s"]
    page.goto(f"{console.address}#t={asked}")
    page.wait_for_selector(".clock")
    first = f"{last_s:.0f} s" if shown == "last" else shown
    assert page.locator(".clock").inner_text().startswith(f"{first} of {last_s:.0f} s")


def test_a_session_that_is_over_is_noticed_wherever_something_is_asked(
    browser: Any, recovered_run: Path, tmp_path: Path
) -> None:
    people = accounts(tmp_path / "people.json", Bo="operator")
    with served(recovered_run, "--people", str(people)) as server:
        for view in ("6", "7", "8", "ArrowRight"):
            with at(browser, server, "Bo") as page:
                page.wait_for_selector(".answers")
                page.context.clear_cookies()
                page.keyboard.press(view)
                page.get_by_role("form", name="Sign in").wait_for()
                assert page.get_by_text("Sign out").count() == 0


def test_runs_of_different_plants_are_said_to_be(page: Any, recovered_run: Path, tmp_path: Path) -> None:
    other = hostile_run(tmp_path / "other")
    with served(recovered_run, "--beside", str(other)) as server:
        page.goto(f"{server.address}#t=905")
        page.wait_for_selector(".answers")
        page.keyboard.press("c")
        page.locator("#compare", has_text="runs of different plants").wait_for()
        assert "no tag in common" in page.locator("#compare").inner_text()
        assert page.locator("#compare canvas").count() == 0  # and the page's own complaints fail the test


def test_readings_have_no_digits_of_noise(page: Any, recovered_run: Path, tmp_path: Path) -> None:
    still = tmp_path / "still"
    shutil.copytree(recovered_run, still)
    table = pq.read_table(still / TRAJECTORY)
    flows = [n for n in table.column_names if re.fullmatch(r"measured F\d", n)]
    for name in flows:
        noise = pa.array([-7.219e-6] * table.num_rows)
        table = table.set_column(table.column_names.index(name), table.schema.field(name), noise)
    pq.write_table(table, still / TRAJECTORY)
    with served(still) as server:
        page.goto(f"{server.address}#t=905")
        page.wait_for_selector(".indicator")
        values = page.locator(".indicator .value").all_inner_texts()
        assert [v.split()[-2] for v in values if v.endswith("L/s")] == ["0"] * len(flows) and len(flows) > 2
        wide = "[...document.querySelectorAll('.indicator')].filter(i => i.scrollWidth > i.clientWidth).length"
        assert page.evaluate(wide) == 0
