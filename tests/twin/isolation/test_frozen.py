"""A frozen instrument that the guard has marked bad already: it is told apart from one that is silent."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from homeostat.domain.snapshot import Snapshot
from homeostat.guard.watch.quality import QualityWatch
from homeostat.twin.history import History
from homeostat.twin.isolation.prechecks import What, flat_lines
from homeostat.twin.twin import Twin
from tests.twin.followed import LEARN_S, disturbed, reactor

ONSET = 2000


def judged(*disturbances: str, end_s: int) -> tuple[Snapshot, ...]:
    """What monitoring is shown of a true reactor: every reading with the quality that the guard gives it."""
    d = reactor().description
    watch = QualityWatch(d.qualities, d.tags_by_name, lambda event, at_s: None)
    seen = (watch.assess(raw.at_s, raw) for raw in disturbed(401, end_s, *disturbances, mismatch="plant"))
    return tuple(snapshot for snapshot in seen if snapshot is not None)


@pytest.mark.parametrize(("tag", "wrong"), [("T1", "temp_bias"), ("L1", "level_bias")])
def test_a_frozen_instrument_is_named_and_no_constant_error_is_said_of_it(tag: str, wrong: str) -> None:
    """It is bad after ten seconds, so that its readings say nothing; a bias would fit as well, and be corrected for."""
    plant = reactor()
    twin = Twin(plant.model, plant.description, plant.twin, 401)
    for snapshot in judged(f"{tag} frozen from {ONSET}", end_s=ONSET + 90):
        twin.observe(snapshot)
        if snapshot.at_s == 1400.0:
            twin.calibrate(LEARN_S)
    found = twin.explain([wrong], (), since_s=ONSET + 60.0, news=True)
    assert found[0].name == f"{tag}_frozen"
    assert found[0].faults[0].onset_s == pytest.approx(ONSET, abs=2.0)
    assert all(wrong != h.name for h in found)


def test_quality_says_since_when_a_reading_repeats_itself() -> None:
    last = judged(f"T1 frozen from {ONSET}", end_s=ONSET + 30)[-1]
    assert last.bad == {"T1"} and last.frozen_s == {"T1": pytest.approx(ONSET, abs=1.0)}
    assert math.isnan(last.values["T1"])


def test_a_silent_instrument_is_bad_and_not_frozen() -> None:
    d = reactor().description
    watch = QualityWatch(d.qualities, d.tags_by_name, lambda event, at_s: None)
    told = judged(end_s=40)
    for raw in told[:20]:
        watch.assess(raw.at_s, raw)
    values = dict(told[30].values)
    del values["T1"]
    lacking = watch.assess(told[30].at_s, Snapshot(told[30].at_s, values, frozen_s={"T1": 1.0}))
    assert lacking is not None and "T1" in lacking.bad and lacking.frozen_s == {}, "what a link says is not believed"


@pytest.mark.parametrize(("share", "stuck"), [(0.5, True), (0.0, False), (1.0, False)])
def test_an_instrument_at_the_end_of_its_range_is_at_rest_and_not_stuck(share: float, stuck: bool) -> None:
    """An empty vessel shows exactly nothing, whatever the guard makes of it."""
    d = reactor().description
    shown = d.tag("L1").range.low + share * d.tag("L1").range.span
    history = History(d.variables, reactor().model.inputs)
    for snapshot in judged(end_s=200):
        history.append(snapshot)
    window = history.window(100)
    held = {"L1": np.arange(100) >= 60}
    readings = {**window.readings, "L1": np.where(held["L1"], shown, window.readings["L1"])}
    frozen = replace(window, readings=readings, held=held, frozen_s={"L1": window.start_s + 60.0})
    assert [f.tag for f in flat_lines(frozen, d)] == ["L1"] * stuck


def test_an_instrument_that_moves_again_is_frozen_no_more() -> None:
    d = reactor().description
    history = History(d.variables, reactor().model.inputs)
    for snapshot in judged(f"T1 frozen from {ONSET} to {ONSET + 40}", end_s=ONSET + 60):
        history.append(snapshot)
        if snapshot.at_s == ONSET + 35:
            (finding,) = flat_lines(history.window(400), d)
            assert finding.what is What.FROZEN and finding.value > finding.limit
    assert flat_lines(history.window(400), d) == ()


@pytest.mark.parametrize("raw", [True, False])
def test_one_that_was_frozen_before_the_window_began_is_named_too(raw: bool) -> None:
    """Nothing shows how it scattered before; the tables say that it does. It was taken for a drift."""
    plant = reactor()
    twin = Twin(plant.model, plant.description, plant.twin, 401)
    end_s = ONSET + int(plant.twin.replay_s) + 100
    told = f"L1 frozen from {ONSET}"
    for snapshot in disturbed(401, end_s, told, mismatch="plant") if raw else judged(told, end_s=end_s):
        twin.observe(snapshot)
        if snapshot.at_s == 1400.0:
            twin.calibrate(LEARN_S)
    window = twin._last(300.0)
    assert [(f.tag, f.what) for f in flat_lines(window, plant.description)] == [("L1", What.FROZEN)]
    assert flat_lines(window, plant.description)[0].since_s <= window.start_s
    assert twin.explain(["level_bias"], (), since_s=end_s - 5.0, news=True)[0].name == "L1_frozen"


def test_what_has_no_noise_in_the_tables_may_stand_still() -> None:
    plant, readings = reactor(), [replace(s, values=s.values | {"F1": 0.02}) for s in judged(end_s=200)]
    twin = Twin(plant.model, plant.description, plant.twin, 401)
    for snapshot in readings:
        twin.observe(snapshot)
    assert flat_lines(twin._last(100.0), plant.description) == ()
