"""The picture of a run: limits where they are in force, moments in their order, the same bytes for the same run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from io import BytesIO
from itertools import combinations

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from homeostat.domain.plant.limits import Limit, LimitKind
from homeostat.domain.plant.tag import Range, Role
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import scenario
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import Plant, load_plant
from homeostat.record.figure.clock import Clock
from homeostat.record.figure.figure import compose, draw, window
from homeostat.record.figure.limits import in_force, thresholds, together
from homeostat.record.figure.lines import _COLOURS, _quantity
from homeostat.record.figure.marks import _write_times, explained
from homeostat.record.figure.panel import StripPanel
from homeostat.record.figure.states import StateRow, draw_states
from homeostat.record.figure.strips import draw_strips
from homeostat.record.releases import Release
from homeostat.stl.formula import parse


def limit(text: str) -> Limit:
    return Limit("LIM", LimitKind.TRIP_LIMIT, parse(text), True, "table", "what it protects")


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("T1 <= 313", [(313.0, True)]),
        ("313 > T1", [(313.0, True)]),
        ("T1 >= -5", [(-5.0, False)]),
        ("-5 <= T1 and T1 < 20", [(-5.0, False), (20.0, True)]),
        ("L1 >= 2 or F1 <= 0.1", []),
        ("T1 - L1 <= 3", []),
        ("abs(T1) <= 5", [(5.0, True), (-5.0, False)]),
        ("abs(T1 - 7) <= 1 or F1 >= 0.9", [(8.0, True), (6.0, False)]),
        ("abs(T1 - T1.sp) <= 1", []),
        ("2 <= abs(T1)", [(2.0, False), (-2.0, True)]),
        ("abs(L1) <= 5 or min(T1, L1) <= 3", []),
    ],
)
def test_thresholds(text: str, found: list[tuple[float, bool]]) -> None:
    assert [(t.value, t.upper) for t in thresholds(parse(text), ("T1", "T1.sp"))] == found


def test_a_limit_is_not_in_force_while_an_alternative_holds() -> None:
    truth = Trajectory(1.0, 1.0, {"L1": np.array([[3.0, 1.0, 1.0]]), "F1": np.array([[1.0, 1.0, 0.0]])})
    one = limit("L1 >= 2 or F1 <= 0.1")
    (threshold,) = thresholds(one.formula, ("L1",))
    assert in_force(one, threshold.node, truth).tolist() == [True, True, False]
    alone = limit("L1 >= 2")
    assert in_force(alone, thresholds(alone.formula, ("L1",))[0].node, truth).all()


@pytest.mark.parametrize(
    "text",
    ["L1 <= 2 or L2 <= 2", "2 >= L2 or L1 <= 2", "L1 <= 2 and L2 <= 2 or L1 <= 2 and L3 <= 2 or L2 <= 2 and L3 <= 2"],
)
def test_a_second_instrument_in_a_limit_does_not_lift_it(text: str) -> None:
    truth = Trajectory(1.0, 1.0, {name: np.array([[1.0, 1.0, 1.0]]) for name in ("L1", "L2", "L3")})
    one = limit(text)
    assert in_force(one, thresholds(one.formula, ("L1",))[0].node, truth).all()


@pytest.fixture(scope="module")
def plant() -> Plant:
    return load_plant("cstr")


def leaking(plant: Plant) -> Run:
    """So much that what was released does not keep the level, and the fallback acts."""
    trace = MemoryTrace()
    return run(plant, scenario(plant, "leak", 1, 700.0, 0.02, 900.0), trace, DeclaredClock(1.0))


@pytest.mark.slow
def test_moments_in_their_order_and_equal_runs_equal_pictures(plant: Plant) -> None:
    done = leaking(plant)
    marks = explained(done, plant.description.machine, Clock((0.0, done.scenario.end_s), plant.description.timing))
    assert [m.at_s for m in marks] == sorted(m.at_s for m in marks) and marks[0].at_s == 700.0
    assert [m.words.split()[0] for m in marks] == ["leak", "detected", "released", "fallback"]
    assert draw(done) == draw(leaking(plant))


def test_words_of_the_tables_are_no_formula(plant: Plant) -> None:
    """A price in dollars, twice in a text, ended the run that was drawn; a folder's name may be no text at all."""
    done = run(plant, scenario(plant, "none", 1, end_s=20.0), MemoryTrace(), DeclaredClock(1.0))
    d, words = plant.description, "a trip costs $_^ 100 to $ 200"
    limits = replace(d.limits, limits=tuple(replace(limit, description=words) for limit in d.limits.limits))
    figure = compose(replace(done, plant=replace(plant, name="of \udcff", description=replace(d, limits=limits))))
    figure.savefig(BytesIO(), format="png")
    told = [text.get_text() for text in figure.findobj(Text) if isinstance(text, Text)]
    assert any(text.startswith(words) for text in told)
    assert draw(replace(done, plant=replace(plant, name="of \udcff", description=replace(d, limits=limits))))


@pytest.mark.parametrize(
    ("descriptions", "words"),
    [
        (["A does not overflow"], "A does not overflow"),
        (["A does not overflow", "B does not overflow"], "A/B does not overflow"),
        (["Highest level", "Level of the weir"], "Highest level; Level of the weir"),
        (["Lowest flow", "Highest level"], "Lowest flow; Highest level"),
    ],
)
def test_limits_of_one_value_share_their_words(descriptions: list[str], words: str) -> None:
    assert together(descriptions) == words


@pytest.fixture(scope="module")
def batch() -> Plant:
    return load_plant("mixing_module")


@pytest.fixture(scope="module")
def clogged(batch: Plant) -> Run:
    trace = MemoryTrace()
    what = scenario(batch, "clogging_main", 3, 100.0, severity=0.98, end_s=500.0)
    return run(batch, what, trace, DeclaredClock(1.0))


def crossing(texts: Sequence[Text]) -> list[tuple[str, str]]:
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts]
    return [(a, b) for (a, first), (b, second) in combinations(boxes, 2) if first.overlaps(second)]


@pytest.mark.slow
def test_words_of_moments_and_names_of_states_can_be_read(batch: Plant, clogged: Run) -> None:
    figure = compose(clogged)
    moments, states = figure.axes[0].texts, figure.axes[-1].texts
    labels = {state.name: state.label for state in batch.description.machine.states}
    assert [t.get_text() for t in states] == [
        "Ready for a batch",
        *(labels[state] for state, _ in clogged.record.states),
    ]
    assert [t.get_text().split()[0] for t in moments] == ["clogging_main", "detected", "released", "Batch"]
    for texts in (moments, states, figure.texts):
        assert crossing(texts) == []
        assert all(figure.bbox.x0 <= b.x0 and b.x1 <= figure.bbox.x1 for b in (t.get_window_extent() for t in texts))


def test_a_name_is_never_on_a_bar_that_is_too_short_for_it() -> None:
    axis = Figure(figsize=(10.0, 2.0)).subplots()
    axis.set_xlim(0.0, 100.0)
    draw_states(
        axis, [StateRow("Somewhat long name", 0, ((0.0, 5.0), (60.0, 65.0))), StateRow("Name", 1, ((5.0, 60.0),))]
    )
    (long, short) = (text.get_window_extent().transformed(axis.transData.inverted()) for text in axis.texts)
    assert long.x0 > 5.0 and long.x1 < 60.0
    assert short.x0 > 5.0 and short.x1 < 60.0


@pytest.mark.parametrize("title", ["Content", "Excess acid in the first vessel of the second street"])
def test_the_name_of_an_axis_is_inside_the_picture(clogged: Run, title: str) -> None:
    panels = tuple(replace(panel, title=title) for panel in clogged.plant.panels)
    figure = compose(replace(clogged, plant=replace(clogged.plant, panels=panels)))
    figure.canvas.draw()
    names = [axis.yaxis.label.get_window_extent() for axis in figure.axes]
    assert any(name.width > 30.0 for name in names) and all(name.x0 >= 0.0 for name in names)


def test_every_axis_gives_its_unit_and_every_strip_its_tag(batch: Plant, clogged: Run) -> None:
    axes = compose(clogged).axes[1:-1]
    for panel, axis in zip(batch.panels, axes, strict=True):
        assert {batch.description.tag(tag).unit for tag in panel.tags} == {panel.unit}
        assert f"[{'fraction' if panel.unit == '1' else panel.unit}]" in axis.get_ylabel()
        if isinstance(panel, StripPanel):
            assert tuple(label.get_text() for label in axis.get_yticklabels()) == panel.tags
    assert any(isinstance(panel, StripPanel) for panel in batch.panels)


def test_a_bar_is_as_high_as_its_value_and_begins_with_it() -> None:
    truth = Trajectory(1.0, 1.0, {"V1": np.array([[0.0, 1.0, 1.0, 0.4, np.nan]])})
    axis = Figure().subplots()
    draw_strips(axis, StripPanel("Valves", "1", ("V1",), Range(0.0, 1.0)), truth)
    (bar,) = [path for collection in axis.collections for path in collection.get_paths()]
    heights = np.linspace(-0.5, 0.5, 201)
    full, partial, automatic = (
        float(np.mean(bar.contains_points([(at_s, y) for y in heights]))) for at_s in (1.5, 3.5, 4.5)
    )
    assert full == pytest.approx(0.76, abs=0.02) and partial == pytest.approx(0.4 * full, abs=0.02) and automatic == 0.0


def test_the_time_axis_ends_with_the_batch_or_with_the_run(clogged: Run) -> None:
    done = clogged
    assert done.complete_s is not None
    first_s, last_s = window(done)
    assert first_s == 0.0 and done.complete_s < last_s < 1.1 * done.complete_s
    assert window(replace(done, complete_s=None)) == (0.0, 500.0)
    late = replace(done, scenario=replace(done.scenario, faults=(replace(done.scenario.faults[0], onset_s=400.0),)))
    assert 400.0 < window(late)[1] < 500.0


def test_times_of_later_releases_are_not_written_over_each_other() -> None:
    figure = Figure(figsize=(8.0, 2.0))
    strip = figure.add_axes((0.1, 0.1, 0.8, 0.8))
    strip.set_xlim(0.0, 1000.0)
    later = [Release(at_s, "search", "d", (), "adjusted", None) for at_s in (300.0, 350.0, 400.0, 700.0, 703.0)]
    _write_times(strip, later, Clock((0.0, 1000.0), load_plant("cstr").description.timing))
    boxes = [text.get_window_extent() for text in strip.texts]
    assert len(boxes) >= 2 and not any(one.overlaps(other) for one, other in combinations(boxes, 2))


def test_many_signals_of_one_panel_have_colours_of_their_own() -> None:
    plant = load_plant("tennessee_eastman").description
    tags = tuple(tag.name for tag in plant.tags if tag.role is Role.PV)[:10]
    assert len({_quantity(tag, tags, plant) for tag in tags}) == len(tags) == len(set(_COLOURS))
