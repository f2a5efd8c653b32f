"""A plant that is not sampled once per second is served and attached in its own ticks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")

from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.samples import ALWAYS
from homeostat.journal.verify.verify import verify
from homeostat.plants.files.baselines import write_baselines
from homeostat.plants.files.folder import BASELINES
from homeostat.plants.files.generated import baseline_sources
from homeostat.plants.plant import load_plant
from homeostat.plants.teaching.learning import learn
from homeostat.service.historian.observed import PROCESS_TIME
from tests.cli.command import homeostat, refused
from tests.equipment.opcua.attached import Attached, Reactor
from tests.plants.timed.stretched import Stretched

pytestmark = [pytest.mark.slow, pytest.mark.wide, pytest.mark.timeout(600)]

PER_SECOND = 4.0
"""Samples per second of wall-clock time."""


def learned(folder: Path) -> str:
    """``folder``, with reference values."""
    plant = load_plant(str(folder), learned=False)
    (folder / BASELINES).write_bytes(write_baselines(learn(plant, 2), baseline_sources(plant)))
    return str(folder)


@pytest.mark.parametrize("tick_s", [0.5, 10.0])
def test_samples_ticks_and_history_are_the_plants(tmp_path: Path, tick_s: float) -> None:
    case = learned(Stretched.of(tick_s, tmp_path).folder)
    live, scale = tmp_path / "live", PER_SECOND * tick_s
    with Reactor(tmp_path, scale, case=case) as plant:
        slow = ("attach", case, "--link", str(plant.mapping), "--dir", str(live), "--pki", str(plant.pkis[1].folder))
        if tick_s > 1.5:
            refused(homeostat(*slow, cwd=tmp_path), "dead_s = 3 s of the mapping is too short", "at least 20 s")
        plant.mapping.write_text(
            plant.mapping.read_text().replace("[connection]\n", "[connection]\npublish_s = 0.05\n")
        )
        with Attached(plant, live) as attached:
            attached.waits_for(lambda now: now["thinking"]["process"] and now["now_s"], "thinking")
            begin = attached.status["ticks"]
            now = attached.waits_for(lambda now: now["ticks"]["number"] > begin["number"] + 40, "ticks")
            assert now["ticks"]["without"] - begin["without"] < 8 and now["link"]["trouble"] == ""
            assert now["now_s"] % tick_s == 0.0
            assert attached.order("mode", "closed-loop", "--reason", "test")[0] == 0
            later = attached.waits_for(
                lambda then: then["ticks"]["number"] > now["ticks"]["number"] + 60, "more of them"
            )
            assert later["mode"]["actual"] == "closed-loop" and not any(
                alarm["lasts"] and alarm["alarm"] in ("heartbeat", "link", "clock") for alarm in later["alarms"]
            )
            assert attached.interrupt() == 0
    times = EmbeddedHistory(Path(f"{live}.history")).read([PROCESS_TIME], ALWAYS)[PROCESS_TIME].value
    steps = np.diff(times) / tick_s
    assert len(times) > 90 and (steps == np.round(steps)).all() and np.mean(steps == 1.0) > 0.8
    assert verify(live).complete
