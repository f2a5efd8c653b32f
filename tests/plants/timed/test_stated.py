"""What a plant states of time: what is refused in one line, and what makes its graph stale."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.plants.error import PlantError
from homeostat.plants.plant import load_plant
from homeostat.process.blocks.given import FlowsheetError
from homeostat.process.blocks.layout import Layout
from tests.plants.copies import Copy
from tests.plants.timed.stretched import Stretched
from tests.process.blocks.sheets import two_tanks


@pytest.fixture
def slow(tmp_path: Path) -> Path:
    return Stretched.of(64.0, tmp_path).folder


def stated(folder: Path, old: str, new: str) -> None:
    settings = folder / "case.toml"
    text = settings.read_text("utf-8")
    assert old in text
    settings.write_text(text.replace(old, new), "utf-8")


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("tick_s = 64.0", "tick_s = 0.0", "time, tick_s: 0 s is outside 0.001 to 3600 s"),
        ("tick_s = 64.0", "tick_s = nan", "time, tick_s: nan s is outside"),
        ("tick_s = 64.0", "tic_s = 64.0", "time: there is no key 'tic_s'; did you mean 'tick_s'"),
        ("tick_s = 64.0", "tick_s = 64.0\nresponse_s = -1.0", "time, response_s: -1 s is outside"),
        ("gain_error", "horizon_s = 1000.0\ngain_error", "horizon_s: 1000 s is no whole number of ticks of 64 s"),
        ("gain_error", "lead_s = 32.0\ngain_error", "lead_s: 32 s is outside 64 to 230400 s"),
    ],
)
def test_a_mistake_about_time_is_one_line(slow: Path, old: str, new: str, told: str) -> None:
    stated(slow, old, new)
    with pytest.raises(PlantError, match=r"case\.toml") as raised:
        load_plant(str(slow), learned=False, kept=False)
    assert told in str(raised.value) and "\n" not in str(raised.value)


def test_another_tick_makes_the_graph_again(slow: Path) -> None:
    first = load_plant(str(slow), learned=False)
    assert first.description.timing.tick_s == 64.0
    stated(slow, "tick_s = 64.0", "tick_s = 32.0")
    again = load_plant(str(slow), learned=False)
    assert again.remade == ("plant.ttl",)
    timing, stale = again.description.timing, {r.stale_s for r in again.description.qualities.values()}
    assert (timing.tick_s, timing.response_s, stale) == (32.0, 16000.0, {160.0})
    assert load_plant(str(slow), learned=False).remade == ()


def test_a_kernel_that_goes_on_by_seconds_is_refused_another_tick(tmp_path: Path) -> None:
    copy = Copy.of("mixing_module", tmp_path)
    copy.replace("case.toml", "[run]\n", "[time]\ntick_s = 0.5\n\n[run]\n")
    with pytest.raises(PlantError, match=r"goes on by 1 s at a time, and \[time\] tick_s is 0.5 s"):
        load_plant(str(copy.folder), learned=False, kept=False)


def test_a_dead_time_is_kept_in_ticks() -> None:
    sheet = two_tanks()
    sheet.sensor("late", sheet.delay("pipe", next(iter(sheet.states.values())).term, 1200.0))
    assert "pipe_19" in Layout.of(sheet, (), 60.0).states
    assert "pipe_20" not in Layout.of(sheet, (), 60.0).states
    with pytest.raises(FlowsheetError, match="delay pipe: 1200 s are more than 600 ticks of 1 s"):
        Layout.of(sheet, ())
