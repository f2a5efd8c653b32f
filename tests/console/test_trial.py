"""What if: the twin says of a person's setpoints what it says of a proposal's, and nothing comes of it."""

from __future__ import annotations

import json
import threading
from pathlib import Path
from typing import Any

import pytest

from homeostat.console.opened import KnownPlant, OpenedRun
from homeostat.console.trial.trials import Busy, NotTried, Trials
from homeostat.domain.events.recovery import Attempted, Diagnosed
from tests.console.served import Browser, Served, accounts, served
from tests.console.test_hostile import hostile_run

REDUCED = "reduced_load"


@pytest.fixture(scope="module")
def trials(recovered: OpenedRun) -> Trials:
    return Trials(recovered)


@pytest.fixture(scope="module")
def proposed(recovered: OpenedRun) -> tuple[float, Attempted]:
    """What recovery proposed, after the time of the diagnosis that it is from."""
    at_s = next(e.at_s for e in recovered.entries if isinstance(e.event, Diagnosed))
    tried = next(e.event for e in recovered.entries if isinstance(e.event, Attempted) and e.event.approved)
    return at_s, tried


def asked(trials: Trials, at_s: float, state: str, **values: float | None) -> Any:
    return json.loads(trials.ask(at_s, state, {name.replace("_", "."): value for name, value in values.items()}))


def test_the_twin_judges_it_as_it_judged_the_proposal(trials: Trials, proposed: tuple[float, Attempted]) -> None:
    at_s, tried = proposed
    said = json.loads(trials.ask(at_s, REDUCED, {c.tag: c.value for c in tried.commands}))
    assert said["approved"] and said["objections"] == []
    theirs = {f.criterion: f.margin if f.deciding is None else f.deciding.margin for f in tried.findings}
    for margin in said["margins"]:  # another draw of the same parameters
        assert margin["margin"] == pytest.approx(theirs[margin["name"]], rel=0.25, abs=0.3), margin["name"]
    assert said["foresight"]["told"]["first"] is None and said["beside"]["told"]["first"] is not None
    assert said["cost"] > 0.0 and said["cost_alone"] > 0.0
    assert said["learnt_s"] == 0.0, "healthy for less than the 600 s that the monitoring of this plant learns from"
    assert said["assumed"][0][0] == "Cooling valve stuck towards closed"


def test_what_would_be_refused_says_why(trials: Trials, proposed: tuple[float, Attempted]) -> None:
    said = asked(trials, proposed[0], REDUCED, F1_sp=0.033)
    assert not said["approved"] and "Highest reactor temperature" in " ".join(said["objections"])
    assert said["foresight"]["told"]["first"]["members"] > 0


def test_nothing_comes_of_it(trials: Trials, proposed: tuple[float, Attempted], recovered_run: Path) -> None:
    before = {path: path.read_bytes() for path in recovered_run.rglob("*") if path.is_file()}
    asked(trials, proposed[0], REDUCED, F1_sp=0.02)
    assert {path: path.read_bytes() for path in recovered_run.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize(
    ("state", "values", "words"),
    [
        (REDUCED, {"F1.sp": 0.5}, "it must be from 0.002 to 0.0333"),
        (REDUCED, {"F1.sp": float("nan")}, "it must be from"),
        (REDUCED, {"F1.sp": None}, "cannot be left on automatic"),
        (REDUCED, {"P9.sp": 1.0}, "may not be moved"),
        ("nowhere", {}, "cannot be decided on"),
    ],
)
def test_what_is_outside_is_refused_before_any_twin(
    trials: Trials, proposed: tuple[float, Attempted], state: str, values: dict[str, float | None], words: str
) -> None:
    with pytest.raises(NotTried, match=words):
        trials.ask(proposed[0], state, values)


def test_a_twin_that_takes_too_long_is_ended(recovered: OpenedRun, proposed: tuple[float, Attempted]) -> None:
    trials = Trials(recovered, longest_s=0.05)
    with pytest.raises(NotTried, match=r"has not answered within 0\.05 s"):
        trials.ask(proposed[0], REDUCED, {})
    assert Trials(recovered).ask(proposed[0], REDUCED, {}), "and the next one is asked"


def test_one_asks_at_a_time(trials: Trials, proposed: tuple[float, Attempted]) -> None:
    first = threading.Thread(target=asked, args=(trials, proposed[0], REDUCED))
    first.start()
    while not trials._asking.locked():
        pass
    with pytest.raises(Busy):
        asked(trials, proposed[0], REDUCED)
    first.join()


def test_nothing_is_tried_before_there_are_readings_or_without_the_plant(recovered: OpenedRun, tmp_path: Path) -> None:
    with pytest.raises(NotTried, match="samples are too few"):
        Trials(recovered).ask(1.0, recovered.plant.description.machine.initial.name, {})
    unknown = OpenedRun(hostile_run(tmp_path / "run"), KnownPlant("x", recovered.plant.description))
    assert Trials(unknown).options(7.0) == ()
    with pytest.raises(NotTried, match="not to be had"):
        Trials(unknown).ask(7.0, "normal", {})


def sent(server: Served, **changed: str) -> int:
    headers = {"Content-Type": "application/json", "Origin": server.address.rstrip("/")} | changed
    content = json.dumps({"at_s": 903.0, "state": "nowhere", "values": {}}).encode()
    return server.ask("/api/trial", "POST", content, **headers).status


def test_only_the_page_asks(console: Served) -> None:
    assert sent(console) == 400
    assert sent(console, Origin="http://elsewhere.example") == 403
    assert sent(console, **{"Content-Type": "text/plain"}) == 415
    content = b'{"at_s": 903, "state": "x", "values": {"F1.sp": 1e999}}'
    origin = {"Content-Type": "application/json", "Origin": console.address.rstrip("/")}
    assert console.ask("/api/trial", "POST", content, **origin).status == 400
    assert console.ask("/api/trial", "POST", b"x" * 20_000, **origin).status == 400


def test_a_viewer_asks_nothing(recovered_run: Path, tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", vi="viewer", op="operator")
    with served(recovered_run, "--people", str(people)) as server:
        what = {"at_s": 903.0, "state": "nowhere", "values": {}}
        assert Browser(server).send("/api/trial", what).status == 401
        for name, status in (("vi", 403), ("op", 400)):
            browser = Browser(server)
            browser.sign_in(name)
            assert browser.send("/api/trial", what).status == status
            assert browser.send("/api/trial", what, X_Homeostat_Token="").status == 403


@pytest.mark.slow
def test_a_person_tries_something_on_the_page(page: Any, console: Served) -> None:
    page.goto(console.address)
    page.wait_for_selector(".answers")
    page.keyboard.press("9")
    page.get_by_label("State").select_option(REDUCED)
    page.get_by_label("F1.sp Setpoint of the feed flow loop in L/s").fill("0.02")
    page.get_by_role("button", name="Try it on the twin").click()
    answer = page.locator(".answer")
    answer.wait_for(timeout=60_000)
    assert "Every check holds on the twin" in answer.inner_text() and "Nothing here is written" in page.inner_text(
        "#ask"
    )
    assert answer.get_by_role("img", name="T1: with the proposal").count() == 1
