"""The page as one file: it says what the server's page says, asks nobody for anything, and is as safe."""

from __future__ import annotations

import base64
import gzip
import json
import os
import re
from bisect import bisect_right
from pathlib import Path
from typing import Any

import pytest

from homeostat.cli.commands.console import opened
from homeostat.console.events.lines import verified
from homeostat.console.kept.page import kept_page
from homeostat.console.kept.pool import Pool
from homeostat.console.kept.record import kept_record
from homeostat.console.opened import OpenedRun
from homeostat.console.text import to_json
from homeostat.console.view import seen
from homeostat.journal.beside.files import write_whole
from tests.cli.command import homeostat, refused
from tests.console.test_hostile import MARKUP, ODD, hostile_run


@pytest.fixture(scope="module")
def kept_file(recovered_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of the run that recovered, as the command line makes it."""
    out = tmp_path_factory.mktemp("kept") / "run.html"
    done = homeostat("export-console", str(recovered_run), "--out", str(out), cwd=out.parent)
    assert done.status == 0 and str(out) in done.out
    return out


def content(page: str) -> Any:
    found = re.search(r'id="kept">([^<]*)<', page)
    assert found is not None
    return json.loads(gzip.decompress(base64.b64decode(found[1])))


def whole(pool: list[Any], parts: Any) -> Any:
    return {name: pool[v] if isinstance(v, int) else whole(pool, v) for name, v in parts.items()}


def test_the_file_has_every_moment_as_the_server_tells_it(kept_file: Path, recovered: OpenedRun) -> None:
    kept = content(kept_file.read_text("utf-8"))
    pool = kept["pool"]
    times = [m[0] for m in kept["moments"]]
    assert times == sorted(set(times)) and {0.0, *(e.at_s for e in recovered.entries), recovered.last_s} <= set(times)
    for at_s, card, overview, quality, targets, _, words in kept["moments"]:
        told = json.loads(to_json(seen(recovered, at_s)))
        assert (None if card is None else whole(pool, pool[card])) == told["card"], at_s
        assert whole(pool, pool[overview]) == told["overview"] and pool[words] == told["told"]
        assert (pool[quality], pool[targets]) == (told["quality"], told["targets"])
        broken = [names for from_s, names in kept["violated"] if from_s <= at_s]
        assert (broken[-1] if broken else []) == told["violated"], at_s


def test_between_its_moments_what_comes_next_is_what_the_server_says(kept_file: Path, recovered: OpenedRun) -> None:
    kept = content(kept_file.read_text("utf-8"))
    times, pool = [m[0] for m in kept["moments"]], kept["pool"]
    for at_s in (0.5 + n for n in range(int(recovered.last_s))):
        line = whole(pool, pool[kept["moments"][bisect_right(times, at_s) - 1][2]])
        assert line == json.loads(to_json(seen(recovered, at_s, whole=False).overview)), at_s


def test_what_was_truly_wrong_is_not_in_it(kept_file: Path, recovered_run: Path) -> None:
    kept = content(kept_file.read_text("utf-8"))
    assert "run-started" not in {line["kind"] for line in kept["journal"]["lines"]}
    assert not [tag for tag in kept["readings"]["signals"] if "true" in tag]
    assert "ground truth" not in json.dumps(kept)


def test_it_opens_from_a_disk_and_asks_nobody(page: Any, kept_file: Path) -> None:
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(kept_file.as_uri())
    page.wait_for_selector(".trend canvas")
    answers = page.locator(".answers").inner_text()
    assert "Cooling valve stuck towards closed" in answers and "Reduced load" in answers
    assert "nothing in it is live" in page.get_by_role("status").first.inner_text()
    page.keyboard.press("8")
    page.locator(".lines td", has_text="released").first.wait_for()
    page.keyboard.press("7")
    page.wait_for_selector("#explorer canvas")
    page.keyboard.press("0")
    page.keyboard.press("End")
    page.keyboard.press("Home")
    page.keyboard.press("Space")
    page.locator(".clock", has_text=re.compile(r"^[1-9]\d* s of")).wait_for()
    assert page.get_by_role("button", name="Approve").count() == 0
    assert asked == [kept_file.as_uri()]


def test_hostile_texts_are_texts_in_the_file(page: Any, tmp_path: Path) -> None:
    run_dir = hostile_run(tmp_path / "run")
    run = opened(run_dir, None)
    text = kept_page(kept_record(run, verified(run_dir), MARKUP), MARKUP + ODD)
    assert "<img" not in text and text.count("<script") == text.count("</script") == 2
    out = tmp_path / "hostile.html"
    out.write_text(text, encoding="utf-8")
    page.goto(f"{out.as_uri()}#t=7")
    page.wait_for_selector(".answers")
    assert MARKUP in page.locator(".answers").inner_text() and page.locator("img").count() == 0


def test_a_script_that_is_added_to_the_file_does_not_run(browser: Any, kept_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "changed.html"
    added = "<script>document.title='taken'</script></body>"
    out.write_text(kept_file.read_text("utf-8").replace("</body>", added), encoding="utf-8")
    page = browser.new_page()
    page.goto(out.as_uri())
    page.wait_for_selector(".answers")
    assert page.title() != "taken"
    page.close()


def test_what_is_there_is_not_replaced_unasked(kept_file: Path, recovered_run: Path, tmp_path: Path) -> None:
    before = kept_file.read_bytes()
    done = homeostat("export-console", str(recovered_run), "--out", str(kept_file), cwd=tmp_path)
    assert done.status == 2 and "--force" in done.err and kept_file.read_bytes() == before
    done = homeostat("export-console", str(tmp_path), "--out", str(tmp_path / "x.html"), cwd=tmp_path)
    assert done.status == 2 and not (tmp_path / "x.html").exists()


def test_a_pool_keeps_each_value_once() -> None:
    pool = Pool()
    assert pool.whole({"a": 1.0}) == pool.whole({"a": 1.0}) and len(pool.values) == 1
    assert pool.parts(None) is None


def test_what_is_no_file_stays_and_a_link_is_followed(recovered_run: Path, tmp_path: Path) -> None:
    pipe, page, link = tmp_path / "pipe", tmp_path / "page.html", tmp_path / "link.html"
    os.mkfifo(pipe)
    link.symlink_to(page)
    for _ in range(2):  # it leads to nothing, then to a file
        assert homeostat("export-console", str(recovered_run), "--out", str(link), "--force", cwd=tmp_path).status == 0
        assert link.is_symlink() and content(page.read_text("utf-8"))["run"]
    refused(homeostat("export-console", str(recovered_run), "--out", str(link), cwd=tmp_path), "is there already")
    refused(homeostat("export-console", str(recovered_run), "--out", str(pipe), "--force", cwd=tmp_path), "is no file")
    assert pipe.is_fifo()
    with pytest.raises(FileExistsError, match="no file"):
        write_whole(pipe, b"")
    assert pipe.is_fifo() and sorted(p.name for p in tmp_path.iterdir()) == ["link.html", "page.html", "pipe"]
