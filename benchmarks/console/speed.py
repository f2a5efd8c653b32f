"""Times in a browser and the cost of watchers: ``python -m benchmarks.console.speed`` prints them as JSON."""

from __future__ import annotations

import json
import os
import socket
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any, Final
from urllib.parse import urlsplit

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from benchmarks.console.browser import chromium
from benchmarks.console.runs import served
from homeostat.journal import Journal, RunStarted
from homeostat.journal.beside.artifacts import TIME
from homeostat.plants.plant import load_plant

DAY_S: Final = 86_400
TAGS: Final = ("F1", "L1", "T1", "T2", "T3")
PANS: Final = 60
WATCHERS: Final = 100
WATCHED_S: Final = 30.0
_TICK: Final = os.sysconf("SC_CLK_TCK")


def a_day(folder: Path) -> Path:
    """A run of the reactor with noise for readings, one a second for a day."""
    tags = [tag.name for tag in load_plant("cstr").description.tags]
    with Journal(folder) as journal:
        journal.record(RunStarted("cstr", (), 1), 0.0)
    draw = np.random.default_rng(1)
    columns = {TIME: np.arange(DAY_S, dtype=float)}
    columns |= {f"measured {tag}": 100.0 + draw.standard_normal(DAY_S).cumsum() * 0.01 for tag in tags}
    pq.write_table(pa.table(columns), folder / "trajectory.parquet")
    return folder


def panned(browser: Any, address: str) -> dict[str, float]:
    """Script time of a frame while a day of five tags is dragged along [ms]."""
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.goto(f"{address}#t={DAY_S - 1}")
    page.wait_for_selector("#card")
    page.keyboard.press("7")
    page.wait_for_selector("#explorer .u-over")
    for button in page.get_by_role("button", name="Take").all():
        if (button.get_attribute("aria-label") or "").split()[1] not in TAGS:
            button.click()
    for tag in TAGS:
        if not page.get_by_role("button", name=f"Take {tag} away").count():
            page.locator("#explorer select").select_option(tag)
    page.get_by_role("button", name="all").click()
    page.wait_for_timeout(1500)
    page.get_by_role("button", name="Zoom in").click()
    page.wait_for_timeout(1500)
    box = page.locator("#explorer .u-over").bounding_box()
    chrome = page.context.new_cdp_session(page)
    chrome.send("Performance.enable")
    page.evaluate("window.frames_ = 0; const n = () => { window.frames_++; requestAnimationFrame(n); }; n()")

    def metrics() -> dict[str, float]:
        return {m["name"]: m["value"] for m in chrome.send("Performance.getMetrics")["metrics"]}

    before, frames = metrics(), page.evaluate("window.frames_")
    y = box["y"] + 100.0
    page.mouse.move(box["x"] + 900.0, y)
    page.mouse.down()
    for k in range(PANS):
        page.mouse.move(box["x"] + 900.0 - 8.0 * k, y)
        page.wait_for_timeout(50)
    page.mouse.up()
    page.wait_for_timeout(300)
    after, shown = metrics(), page.evaluate("window.frames_") - frames
    page.close()
    script, task = (1000.0 * (after[n] - before[n]) for n in ("ScriptDuration", "TaskDuration"))
    return {"frames": shown, "script_ms": round(script / shown, 2), "task_ms": round(task / shown, 2),
            "script_per_pan_ms": round(script / PANS, 2)}  # fmt: skip


def painted(browser: Any, address: str, times: int = 10) -> dict[str, float]:
    """First contentful paint, and until the four answers stand, of a page that nothing is kept of [ms]."""
    paints, answers = [], []
    for _ in range(times):
        context = browser.new_context(viewport={"width": 1280, "height": 900})
        page = context.new_page()
        begun = time.monotonic()
        page.goto(address)
        page.wait_for_selector(".answers")
        answers.append(1000.0 * (time.monotonic() - begun))
        page.wait_for_function("performance.getEntriesByName('first-contentful-paint').length")
        paints.append(page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime"))
        context.close()
    return {
        "paint_ms": round(median(paints)),
        "paint_most_ms": round(max(paints)),
        "answers_ms": round(median(answers)),
    }


def watched(address: str, process: int, watchers: int = WATCHERS, seconds: float = WATCHED_S) -> dict[str, float]:
    """What ``watchers`` who follow the page cost its process [cores], and bytes that each was told a second."""
    place = urlsplit(address)
    lines = []
    for _ in range(watchers):
        line = socket.create_connection((place.hostname, place.port))
        line.sendall(f"GET /api/stream?at=1e12&speed=1000 HTTP/1.1\r\nHost: {place.netloc}\r\n\r\n".encode())
        line.setblocking(False)
        lines.append(line)
    _listen(lines, 5.0)
    before, begun = _cpu_s(process), time.monotonic()
    told = _listen(lines, seconds)
    used, passed = _cpu_s(process) - before, time.monotonic() - begun
    for line in lines:
        line.close()
    each = told / max(watchers, 1) / passed
    return {"watchers": watchers, "cores": round(used / passed, 3), "bytes_each_s": round(each)}


def _listen(lines: list[socket.socket], seconds: float) -> int:
    end, told = time.monotonic() + seconds, 0
    while time.monotonic() < end:
        for line in lines:
            try:
                told += len(line.recv(1 << 20))
            except BlockingIOError:
                continue
        time.sleep(0.05)
    return told


def _cpu_s(process: int) -> float:
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICK


def live(folder: Path) -> dict[str, float]:
    """Watchers of a served and attached reactor, once a second."""
    from tests.equipment.opcua.attached import Attached, Reactor

    (folder / "served").mkdir()
    with Reactor(folder / "served", 1.0) as reactor, Attached(reactor, folder / "live") as attached:
        attached.waits_for(lambda now: now["now_s"], "samples")
        with served(folder / "live") as (address, process):
            alone = watched(address, process, 0)
            many = watched(address, process)
    return many | {"cores_alone": alone["cores"]}


def main() -> None:
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        run = Path(sys.argv[1])
        watchers = live(folder)  # before a browser, which has an event loop of its own
        with chromium() as browser:
            with served(a_day(folder / "day")) as (address, _):
                found: dict[str, Any] = {"panned": panned(browser, address)}
            with served(run) as (address, _):
                found["painted"] = painted(browser, address)
        found["watched"] = watchers
    found["load"] = round(os.getloadavg()[0], 1)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
