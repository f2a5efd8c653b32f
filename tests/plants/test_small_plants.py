"""What follows from the tables of a small plant: where it starts, what its figure shows, and how a valve fails."""

from __future__ import annotations

from pathlib import Path

from homeostat.plants.plant import Plant, load_plant
from homeostat.record.figure.panel import LinePanel
from tests.evaluate.two_tanks import TANKS, change, tanks


def loaded(folder: Path) -> Plant:
    return load_plant(str(folder), learned=False, kept=False)


def start_of(plant: Plant, tag: str) -> float:
    return float(plant.start[plant.model.inputs.index(plant.description.variables[tag])])


def test_it_starts_with_the_design_values_of_start_up(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    change(
        folder, "engineering/setpoints.csv", "starting|normal,F1.sp,,,0.2", "starting,F1.sp,,,0.1\nnormal,F1.sp,,,0.2"
    )
    plant = loaded(folder)
    assert start_of(plant, "F1.sp") == 0.1 and start_of(plant, "T2.sp") == 50.0
    assert plant.production.design_rate == 0.2, "what is made by design is made after start-up"


def test_what_start_up_says_nothing_of_is_as_after_it(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    change(folder, "engineering/setpoints.csv", "starting|normal,F1.sp,,,0.2", "normal,F1.sp,,,0.2")
    assert start_of(loaded(folder), "F1.sp") == 0.2


def test_a_batch_that_begins_at_once_starts_in_its_first_phase() -> None:
    assert start_of(loaded(TANKS.parent / "heated_batch"), "V1.cmd") == 1.0


def test_a_figure_shows_what_a_criterion_compares_and_no_loop_holds(tmp_path: Path) -> None:
    assert not any("T1" in panel.tags for panel in loaded(TANKS).panels)
    folder = tanks(tmp_path)
    change(folder, "engineering/criteria.csv", "abs(T2.err) <= 2", "T1 >= 15 and T2 >= 48 and F1 <= F2 + 0.1")
    panels = loaded(folder).panels
    (panel,) = (each for each in panels if "T1" in each.tags)
    assert panel.tags == ("T1",) and panel.title == "Temperature of the feed tank"
    assert getattr(panel, "window", None) == (0.0, 40.0)
    assert sum("T2" in each.tags for each in panels) == 1 and panels[-1].title == "Actuators"


def test_a_figure_shows_every_limit_whether_or_not_a_loop_holds_its_tag(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    change(
        folder,
        "engineering/limits.csv",
        "LIM-T2-HIGH,,",
        "LIM-T1-HIGH,envelope,T1 <= 35,Datasheet,It stays cold\nLIM-T2-HIGH,,",
    )
    (panel,) = (each for each in loaded(folder).panels if "T1" in each.tags)
    assert isinstance(panel, LinePanel) and panel.limits == ("LIM-T1-HIGH",)
    assert panel.window[0] < 35.0 <= panel.window[1]


def test_what_opens_or_closes_has_no_capacity_to_lose(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    (folder / "engineering" / "signals.csv").write_text("tag,increment\nV1.cmd,1\n", "utf-8")
    faults = {fault.name for fault in loaded(folder).description.faults}
    assert {"V1_stuck_open", "V1_stuck_closed", "P1_weak"} <= faults and "V1_weak" not in faults


def test_a_row_that_omits_it_all_the_same_is_no_mistake(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    (folder / "engineering" / "signals.csv").write_text("tag,increment\nV1.cmd,1\n", "utf-8")
    (folder / "engineering" / "omitted.csv").write_text(
        "table,row,reason\nfaults,V1_weak,It opens or closes\n", "utf-8"
    )
    assert "V1_weak" not in {fault.name for fault in loaded(folder).description.faults}


def test_one_that_is_stated_stays(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    (folder / "engineering" / "signals.csv").write_text("tag,increment\nV1.cmd,1\n", "utf-8")
    (folder / "engineering" / "faults.csv").write_text("id,nominal\nV1_weak,0.3\n", "utf-8")
    assert loaded(folder).description.fault("V1_weak").severity_nominal == 0.3
