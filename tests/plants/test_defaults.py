"""What settings may leave open because the plant's graph says it: start, production, errors, figures."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import pytest

from homeostat.domain.plant.description import PlantDescription
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import INSTALLED, PlantFiles
from homeostat.plants.plant import load_plant
from homeostat.plants.settings.check import refuse_misnamed
from homeostat.plants.settings.defaults import completed
from homeostat.plants.settings.figure_panel import read_panel
from homeostat.plants.settings.file import read_settings
from homeostat.plants.settings.settings import Settings
from homeostat.record.figure.panel import LinePanel
from tests.plants.copies import Copy

TEXT = (INSTALLED / "cstr" / "case.toml").read_text(encoding="utf-8")


@cache
def reactor() -> PlantDescription:
    return load_plant("cstr").description


def without(*parts: str) -> str:
    """The reactor's settings without some tables and keys."""
    text = TEXT
    for part in parts:
        pattern = rf"(?m)^\[+{re.escape(part)}\]+.*\n(?:(?!\[).*\n)*" if part[0] != "=" else rf"(?m)^{part[1:]} = .*\n"
        text, found = re.subn(pattern, "", f"{text}\n")
        assert found, part
    return text


def read(text: str) -> Settings:
    settings = read_settings(PlantFiles(INSTALLED / "some", {"case.toml": text.encode()}))
    return completed("some", settings, reactor())


def test_a_run_starts_where_the_first_state_after_start_up_has_its_design_values() -> None:
    settings = read(without("=started_by", "start"))
    assert settings.run.started_by == "t_started"
    assert settings.start == {"T1.sp": 310.0, "L1.sp": 10.0, "F1.sp": 0.0333333333333333, "XV1.cmd": 1.0}


def test_the_design_rate_is_where_the_loop_of_the_throughput_holds_it() -> None:
    assert read(without("=design_rate")).objective.production.design_rate == 0.0333333333333333


def test_a_rate_is_priced_by_the_total_that_is_delivered_and_an_amount_by_itself() -> None:
    assert read(TEXT).objective.production.delivered == ("product", "L1")
    stated = read(TEXT.replace("[objective]", '[objective]\npriced = "throughput"'))
    assert stated.objective.production.delivered == ()
    assert load_plant("cstr").twin.delivered == ("product", "L1")
    assert load_plant("mixing_module").twin.delivered == load_plant("mixing_module").production.delivered == ()


def test_errors_are_those_of_the_instruments() -> None:
    twin = read(without("twin.errors", "=corrected", "=ignored")).twin
    measured = {"T1", "L1", "F1", "F2", "F3", "T2", "T3", "V1_zt", "P1_zt", "V2_zt"}
    assert twin.errors.keys() == measured and twin.corrected == ["L1", "T1"]
    assert twin.errors["T1"] == [0.5, 0.25] and twin.errors["L1"] == [0.01, 0.02]
    assert twin.errors["F1"] == pytest.approx([0.02 * 0.03333, 0.01 * 0.03333], rel=1e-3), "relative to the design"


def test_who_states_one_error_leaves_the_others_to_the_tables() -> None:
    follows = read(without("twin.errors", "=ignored")).twin.errors
    twin = read(without("twin.errors", "=ignored") + "\n[twin.errors]\nL1 = [0.03, 0.5]\n").twin
    assert twin.errors == follows | {"L1": [0.03, 0.5]} and follows["L1"] != [0.03, 0.5]


def test_what_is_ignored_has_no_error() -> None:
    twin = read(without("twin.errors")).twin
    assert twin.ignored == ["T2", "T3"] and not {"T2", "T3"} & twin.errors.keys() and "T1" in twin.errors
    with pytest.raises(PlantError, match="twin, ignored: 'T1' has an entry in errors; leave out one of them"):
        refuse_misnamed("some", read(TEXT.replace('"T2", "T3"', '"T1", "T2", "T3"')), reactor())
    with pytest.raises(PlantError, match="twin, ignored: the plant has no variable 'T9'"):
        refuse_misnamed("some", read(TEXT.replace('"T2", "T3"', '"T2", "T3", "T9"')), reactor())


def test_a_figure_shows_every_loop_with_its_limits_and_where_actuators_stand() -> None:
    tables = read(without("figure")).figure or []
    panels = [read_panel(table.model_dump(exclude_none=True), reactor()) for table in tables]
    assert [panel.tags for panel in panels[:3]] == [("F1", "F1.sp"), ("L1", "L1.sp"), ("T1", "T1.sp")]
    assert panels[3].tags == ("P1.pos", "V1.pos", "V2.pos", "XV1.cmd")
    level = panels[1]
    assert isinstance(level, LinePanel) and {"LIM-L-HIGH", "LIM-L-LOW"} <= set(level.limits)
    assert level.window[0] < 2.0 and level.window[1] > 11.0


def test_what_is_stated_is_kept() -> None:
    text = TEXT.replace("[objective]", '[objective]\npriced = "throughput"')
    stated = read_settings(PlantFiles(INSTALLED / "some", {"case.toml": text.encode()}))
    assert completed("some", stated, reactor()) == stated
    bare = read(without("figure", "start").replace("recipe =", "figure = []\nstart = {}\nrecipe ="))
    assert bare.figure == [] and bare.start == {}


def test_completed_settings_fit_their_plant(tmp_path_factory: pytest.TempPathFactory) -> None:
    parts = ("=started_by", "start", "=design_rate", "twin.errors", "=corrected", "figure")
    refuse_misnamed("some", read(without(*parts)), reactor())
    copy = Copy.of("cstr", tmp_path_factory.mktemp("plants"))
    (copy.folder / "case.toml").write_text(without(*parts), encoding="utf-8")
    plant, shipped = load_plant(str(copy.folder), learned=False), load_plant("cstr")
    assert plant.start.tolist()[:3] == shipped.start.tolist()[:3]
    assert plant.started == shipped.started and len(plant.panels) == 4


def _module(text: str) -> None:
    plant = load_plant("mixing_module").description
    completed("some", read_settings(PlantFiles(INSTALLED / "some", {"case.toml": text.encode()})), plant)


OPEN: list[tuple[str, Callable[[str], object], str]] = [
    (without("=design_rate"), _module, "some/case.toml: objective: 'design_rate' is missing, and no loop holds 'F1'"),
    (
        without("=design_rate").replace('throughput = "F1"', 'throughput = "F2"'),
        read,
        "some/case.toml: objective: 'design_rate' is missing, and no loop holds 'F2' at a design value after start-up",
    ),
]


@pytest.mark.parametrize(("text", "carry_out", "words"), OPEN, ids=["no loops", "no loop of it"])
def test_what_does_not_follow_must_be_stated(text: str, carry_out: Callable[[str], object], words: str) -> None:
    with pytest.raises(PlantError, match=f"^{re.escape(words)}") as caught:
        carry_out(text)
    assert str(caught.value).endswith("; state it")


def test_of_two_ways_out_of_start_up_one_must_be_stated() -> None:
    machine = reactor().machine
    other = replace(next(t for t in machine.transitions if t.name == "t_started"), name="t_warm")
    two = replace(reactor(), machine=replace(machine, transitions=(*machine.transitions, other)))
    settings = read_settings(PlantFiles(INSTALLED / "some", {"case.toml": without("=started_by").encode()}))
    words = "some/case.toml: run: 'started_by' is missing, and 't_started', 't_warm' lead out of 'starting'"
    with pytest.raises(PlantError, match=f"^{re.escape(words)}; state it$"):
        completed("some", settings, two)
