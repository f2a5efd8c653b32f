"""An episode of a history watched again by today's configuration: what is noticed, advised, and never written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import homeostat as hs
from homeostat.history.samples import ALWAYS
from homeostat.journal import Event, Journal, Setting
from homeostat.links.errors import LinkError
from homeostat.plants.plant import Plant, load_plant
from homeostat.service.attached.place import first_event
from homeostat.service.what_if import RecordedLink, RecordedSource, what_if
from tests.cli.command import homeostat, refused
from tests.equipment.kept_run import kept

pytestmark = pytest.mark.slow

ONSET_S = 1000.0


@pytest.fixture(scope="module")
def cstr() -> Plant:
    return load_plant("cstr")


@pytest.fixture(scope="module")
def done(cstr: Plant) -> hs.Run:
    """A cooling valve sticks, and the plant is recovered: what the instruments said of it."""
    fault = hs.Fault("cool_stuck_closed", 0.7, ONSET_S)
    return hs.run(cstr, fault, seed=3, end_s=ONSET_S + 60.0, thinking=hs.declared(1.0))


def test_what_was_noticed_then_is_noticed_again_and_the_same_is_advised(
    cstr: Plant, done: hs.Run, tmp_path: Path
) -> None:
    readings = {tag: values[0] for tag, values in done.measured.signals.items()}
    history, told = kept(tmp_path / "live.history", readings, done.measured.start_s), list[Event]()
    found = what_if(cstr, history, ALWAYS, lambda event, at_s: told.append(event))
    assert done.detected_s is not None and found.detected_s == pytest.approx(done.detected_s, abs=2.0)
    assert found.diagnosis == "cool_stuck_closed" and not found.trips and told
    assert {c.tag for c in found.advice[0].commands} == {c.tag for c in done.actions}
    assert not any(isinstance(event, hs.events.ReleasedActions) for event in told)
    with pytest.raises(LinkError, match="cannot be written"):
        RecordedLink(RecordedSource(cstr, history, ALWAYS)).take()


@pytest.mark.wide
def test_the_command_says_it_too(done: hs.Run, cstr: Plant, tmp_path: Path) -> None:
    kept(tmp_path / "live.history", {tag: v[0] for tag, v in done.measured.signals.items()}, done.measured.start_s)
    with Journal(tmp_path / "live") as journal:
        journal.record(first_event("cstr", (Setting("configuration", cstr.configuration),), "now", ()), 0.0)
    shown = homeostat("replay", "live", "--what-if", cwd=tmp_path)
    assert shown.status == 0 and "noticed at 100" in shown.out and "would be released at" in shown.out
    refused(homeostat("replay", "live", "--what-if", "--last", "8x", cwd=tmp_path), "8x")


def test_an_episode_without_a_fault_is_left_alone(cstr: Plant, done: hs.Run, tmp_path: Path) -> None:
    quiet = {tag: values[0][: int(ONSET_S) - 20] for tag, values in done.measured.signals.items()}
    found = what_if(cstr, kept(tmp_path, quiet, done.measured.start_s), ALWAYS, lambda event, at_s: None)
    assert found.detected_s is None and found.advice == () and np.isfinite(found.to_s)
