"""Reference values from a plant's history: near those of the simulation, and refused where the span is not well."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from homeostat.domain.snapshot import Snapshot
from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.samples import Batch, Span
from homeostat.history.store import UnknownTag
from homeostat.links.simulated import SimulatedLink
from homeostat.links.truth.process import PlantConfiguration, TrueProcess
from homeostat.plants.error import PlantError
from homeostat.plants.files.baselines import read_baselines
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.teaching.from_history import learned_from_history
from homeostat.plants.wired.assembly import new_sequencer
from tests.cli.command import homeostat, refused
from tests.plants.copies import Copy

T0, S = 1_764_000_000_000_000, 1_000_000
WELL = Span(T0 + 1500 * S, T0 + 6000 * S)
"""The reactor has started, and nothing is wrong with it."""

Change = Callable[[Snapshot, dict[str, float], dict[str, int]], bool]
"""Alters values and codes of a second; False where nothing of it is recorded."""


@pytest.fixture(scope="module")
def reactor() -> Plant:
    return load_plant("cstr")


@pytest.fixture(scope="module")
def snapshots(reactor: Plant) -> list[Snapshot]:
    """A fault-free run of the reactor, as its instruments show it."""
    configuration = PlantConfiguration(reactor.true_parameters(3), reactor.start, (), reactor.end_s, 7)
    link = SimulatedLink(
        TrueProcess(reactor.model, reactor.description, configuration), recipe=new_sequencer(reactor).sample
    )
    found = []
    while not link.ended:
        found.append(link.advance())
    return found


def recorded(folder: Path, snapshots: list[Snapshot], change: Change = lambda *_: True) -> EmbeddedStore:
    """A history of these snapshots; process time 0 is T0."""
    store = EmbeddedStore(folder)
    for one in snapshots:
        values, codes = dict(one.values), dict.fromkeys(one.values, 0)
        if change(one, values, codes):
            at = T0 + round(one.at_s * 1e6)
            times = np.full(len(values), at, dtype=np.int64)
            column = np.array([*values.values()], dtype=np.float64)
            store.append(Batch(tuple(values), times, column, np.array([codes[t] for t in values], "u4"), times, at))
    return store


def test_what_a_healthy_plant_recorded_teaches_what_its_simulation_does(
    tmp_path: Path, reactor: Plant, snapshots: list[Snapshot]
) -> None:
    with recorded(tmp_path, snapshots) as store:
        found = read_baselines(learned_from_history(reactor, store, WELL), reactor.description)
    assert found.keys() == reactor.baselines.keys()
    for name, baseline in found.items():
        shipped = reactor.baselines[name]
        whole = np.hypot(shipped.between_sd, shipped.within_sd)
        # Plants of one design differ, and this one is one of them; what it wanders slowly is between its stretches.
        assert abs(baseline.mean - shipped.mean) < 4.0 * whole
        assert 0.3 * shipped.within_sd < baseline.within_sd < 1.2 * shipped.within_sd
        assert np.hypot(baseline.between_sd, baseline.within_sd) < 1.2 * whole


def gone(snapshot: Snapshot, values: dict[str, float], codes: dict[str, int]) -> bool:
    return not 3000 < snapshot.at_s <= 3060


def unsteady(snapshot: Snapshot, values: dict[str, float], codes: dict[str, int]) -> bool:
    codes["T1"] = 0x808C0000 if snapshot.at_s % 50 < 1 else 0
    return True


def uncertain(snapshot: Snapshot, values: dict[str, float], codes: dict[str, int]) -> bool:
    codes["L1"] = 0x40900000 if snapshot.at_s >= 5000 else 0
    return True


def hot(snapshot: Snapshot, values: dict[str, float], codes: dict[str, int]) -> bool:
    values["T1"] += 5.0 if 4000 <= snapshot.at_s < 4020 else 0.0
    return True


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (gone, r"has no good reading for 5\d s from 2025-11-24T16:50:04.000Z on; at most 30 s are allowed"),
        (unsteady, r"'T1' has no good reading for \d+ of 4500 s \(2.0%\); at most 1% are allowed"),
        (uncertain, r"'L1' has no good reading for 1000 s from 2025-11-24T17:23:20.000Z on"),
        (hot, r"'T1 <= 313' \(LIM-T-HIGH\) does not hold for \d+ s, first at 2025-11-24T17:06:40.000Z"),
    ],
)
def test_a_span_that_is_not_well_is_refused_with_the_reason(
    tmp_path: Path, reactor: Plant, snapshots: list[Snapshot], change: Change, words: str
) -> None:
    with recorded(tmp_path, snapshots, change) as store, pytest.raises(PlantError, match=words) as caught:
        learned_from_history(reactor, store, WELL)
    assert str(caught.value).startswith("the history from 2025-11-24T16:25:00.000Z to 2025-11-24T17:40:00.000Z is")
    assert str(caught.value).endswith("choose another span") and "\n" not in str(caught.value)


def test_too_short_a_span_and_a_missing_tag_are_refused(
    tmp_path: Path, reactor: Plant, snapshots: list[Snapshot]
) -> None:
    def without(_: Snapshot, values: dict[str, float], codes: dict[str, int]) -> bool:
        del values["P1.pos"]
        return True

    with recorded(tmp_path, snapshots[:4000], without) as store:
        with pytest.raises(
            PlantError, match="it is 4000 s long; at least 4100 s are needed, 500 s to settle and 3600 s"
        ):
            learned_from_history(reactor, store, Span(T0, T0 + 4000 * S))
        with pytest.raises(UnknownTag, match=r"has no tag 'P1.pos'; did you mean 'V1.pos'"):
            learned_from_history(reactor, store, Span(T0, T0 + 6000 * S))


def test_the_command_writes_them_or_says_why_not(tmp_path: Path, snapshots: list[Snapshot]) -> None:
    copied = Copy.of("cstr", tmp_path)
    recorded(tmp_path / "history", snapshots).close()
    before = copied.text("baseline.csv")
    words = ("plant", "learn", "./cstr", "--from-history", "history")
    refused(homeostat(*words, cwd=tmp_path), "does not hold for", "choose another span")
    refused(homeostat(*words, "--last", "8x", cwd=tmp_path), "'8x' is no duration; write it as 90s, 30m, 8h or 7d")
    refused(homeostat("plant", "learn", "./cstr", "--last", "8h", cwd=tmp_path), "name that with --from-history")
    refused(homeostat(*words[:-1], "nowhere", cwd=tmp_path), "'nowhere' is no history")
    assert copied.text("baseline.csv") == before
    done = homeostat(*words, "--last", "4500s", cwd=tmp_path)
    assert (done.status, done.err) == (0, "")
    assert "12 features, learned from the history from 2025-11-24T16:2" in done.out
    assert copied.text("baseline.csv") != before and copied.load().remade == ()
