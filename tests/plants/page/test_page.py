"""A plant on one page: everything that the tables say is on it, well-formed, escaped, and nothing overlaps."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import pytest

from homeostat.plants.described import DescribedPlant, read_described
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import BASELINES
from homeostat.plants.page.figure import Direction, Shape, arranged
from homeostat.plants.page.flowsheet import corrections, flowsheet_figure
from homeostat.plants.page.lettering import broken, width
from homeostat.plants.page.machine import machine_figure
from homeostat.plants.page.markup import Markup, element
from homeostat.plants.page.page import page
from homeostat.plants.settings.settings import DrawingTable
from tests.plants.copies import Copy

SVG = "{http://www.w3.org/2000/svg}"
PLANTS = ("cstr", "mixing_module")


@pytest.fixture(params=PLANTS)
def plant(request: pytest.FixtureRequest) -> DescribedPlant:
    return read_described(str(request.param))


def tree(text: str) -> ElementTree.Element:
    return ElementTree.fromstring(text.removeprefix("<!DOCTYPE html>\n"))


def names(root: ElementTree.Element, table: str) -> list[str]:
    """The names of the rows of one table of the page."""
    (section,) = root.iterfind(f".//section[@id='{table}']")
    return ["".join(next(cell.iter()).itertext()) for cell in section.iterfind(".//tbody/tr/th")]


def first_words(root: ElementTree.Element, table: str) -> set[str]:
    (section,) = root.iterfind(f".//section[@id='{table}']")
    return {next(iter(cell.itertext())) for cell in section.iterfind(".//tbody/tr/th")}


def test_everything_that_the_graph_says_has_a_row(plant: DescribedPlant) -> None:
    root, known = tree(page(plant)), plant.description
    assert first_words(root, "tags") == {tag.name for tag in known.tags}
    assert first_words(root, "limits") == {limit.name for limit in known.limits.limits}
    assert first_words(root, "criteria") == {criterion.name for criterion in known.limits.criteria}
    assert first_words(root, "faults") == {fault.name for fault in known.faults}
    assert first_words(root, "symptoms") == {rule.name for rule in known.symptom_rules}
    assert first_words(root, "states") == {state.name for state in known.machine.states}
    assert first_words(root, "transitions") == {transition.name for transition in known.machine.transitions}
    assert first_words(root, "parameters") == {parameter.symbol for parameter in known.parameters}
    for at, strategy in enumerate(known.fallback_strategies):
        assert len(names(root, f"fallback-{at}")) == len(strategy.actions.commands)
    said = " ".join(root.itertext())
    for text in (*(x.formula.text for x in known.limits.limits), *(t.guard.text for t in known.machine.transitions)):
        assert " ".join(text.split()) in said
    assert plant.configuration in said and "nobody has signed it" in said


def test_the_page_needs_nothing_else_and_names_its_drawings(plant: DescribedPlant) -> None:
    text = page(plant)
    root = tree(text)
    assert not re.search(r"<script|<link|<img|@import|url\((?!#)|\bsrc=", text)
    assert set(re.findall(r"https?://[^\"<\s]+", text)) == {"http://www.w3.org/2000/svg"}
    known = [each.get("id") for each in root.iter() if each.get("id")]
    assert len(known) == len(set(known))
    drawings = list(root.iter(f"{SVG}svg"))
    assert len(drawings) == 2
    for drawing in drawings:
        assert drawing.get("role") == "img"
        labels = str(drawing.get("aria-labelledby")).split()
        assert [each.tag for each in drawing if each.get("id") in labels] == [f"{SVG}title", f"{SVG}desc"]
    for link in root.iter("a"):
        assert str(link.get("href")).removeprefix("#") in known


def test_equal_plants_give_equal_pages() -> None:
    assert page(read_described("cstr")) == page(read_described("cstr"))


def test_every_operator_stream_and_state_is_drawn(plant: DescribedPlant) -> None:
    shapes, arrows = flowsheet_figure(plant.description, plant.flowsheet)
    assert {f"operator {o.name}" for o in plant.flowsheet.operators} <= shapes.keys()
    flowing = {(a.source, a.target) for a in arrows}
    for operator in plant.flowsheet.operators:
        for flow in operator.outputs:
            if f"flow {flow}" in shapes:
                assert (f"operator {operator.name}", f"flow {flow}") in flowing
    states, ways = machine_figure(plant.description)
    assert {f"state {s.name}" for s in plant.description.machine.states} <= states.keys()
    tips = " ".join(way.tip for way in ways)
    for transition in plant.description.machine.transitions:
        assert transition.source == transition.target or f"{transition.name}:" in tips


@pytest.mark.parametrize("direction", list(Direction))
def test_no_box_of_a_drawing_overlaps_another_and_no_text_leaves_its_box(
    plant: DescribedPlant, direction: Direction
) -> None:
    for shapes, arrows in (flowsheet_figure(plant.description, plant.flowsheet), machine_figure(plant.description)):
        places = arranged(shapes, arrows, direction).places
        for a, b in combinations(places.values(), 2):
            aside = a.along + a.box.along < b.along or b.along + b.box.along < a.along
            assert aside or a.across + a.box.across < b.across or b.across + b.box.across < a.across
        for shape in shapes.values():
            assert shape.lines and all(line.width < shape.width for line in shape.lines)


def test_controllers_read_and_command_by_dashed_arrows() -> None:
    plant = read_described("cstr")
    _, arrows = flowsheet_figure(plant.description, plant.flowsheet)
    informed = {(a.source, a.target) for a in arrows if a.kind == "information"}
    assert ("flow feed_stream", "operator PO_ControlFeed") in informed
    assert ("operator PO_ControlFeed", "operator PO_Feed") in informed


def test_states_say_what_they_are() -> None:
    plant = read_described("cstr")
    shapes, arrows = machine_figure(plant.description)

    def said(shape: Shape) -> str:
        return " ".join(line.text for line in shape.lines)

    assert shapes["state starting"].icon == "initial" and shapes["state normal"].kind == "state ordinary"
    assert shapes["state holding"].kind == "state abnormal" and "risk 3" in said(shapes["state holding"])
    assert "recovery may end here" in said(shapes["state holding"])
    assert shapes["state shutdown"].kind == "state safe" and "fallback ends here" in said(shapes["state shutdown"])
    kinds = {(a.source, a.target): a.kind for a in arrows}
    assert kinds["state starting", "state normal"] == "automatic"
    assert kinds["state normal", "state reduced_load"] == "decision"
    assert kinds["to shutdown, fallback", "state shutdown"] == "fallback"


def test_noise_and_writers_are_told_with_their_units() -> None:
    root = tree(page(read_described("cstr")))
    (section,) = root.iterfind(".//section[@id='tags']")
    rows = {"".join(row[0].itertext()): [" ".join(cell.itertext()) for cell in row] for row in section.iter("tr")}
    assert rows["F1"][4] == "2 % of reading" and rows["T1"][4] == "0.5 K"
    assert "FIC1, and nobody from outside" in rows["V1.cmd"][6] and "guard" in rows["T1.sp"][6]
    assert rows["T1"][6] == "–" and "0.5 K/s" in rows["T1.sp"][7]


def test_what_tables_say_is_never_markup(tmp_path: Path) -> None:
    copy = Copy.of("cstr", tmp_path)
    hostile = '<script>alert("1")</script> & <b>'
    copy.replace(
        "engineering/instruments.csv", ",Reactor temperature\n", "," + f'"{hostile.replace(chr(34), chr(34) * 2)}"\n'
    )
    copy.replace("engineering/equipment.csv", "Feed isolation valve", "<svg/onload=x>")
    copy.replace("engineering/states.csv", "Normal operation", "<i>Normal</i>]]>")
    copy.replace("case.toml", "Continuous stirred", "</title><script>Continuous stirred")
    text = page(read_described(str(copy.folder)))
    root = tree(text)
    assert "<script" not in text and "<b>" not in text and "<svg/onload" not in text and "<i>" not in text
    assert hostile in " ".join(root.itertext())
    assert str(root.findtext("head/title")).startswith("</title><script>")


def test_a_plant_is_described_without_reference_values_without_running_its_code_and_writes_nothing(
    tmp_path: Path,
) -> None:
    copy = Copy.of("mixing_module", tmp_path)
    (copy.folder / BASELINES).unlink()
    copy.replace("case.toml", "homeostat.plants.mixing_module.process:MixingModel", "process:MixingModel")
    (copy.folder / "process.py").write_text("raise SystemExit('it ran')\n")
    copy.replace("engineering/instruments.csv", "Level of B201", "Level of the first tank")
    before = {path: path.read_bytes() for path in copy.folder.rglob("*") if path.is_file()}
    assert "Level of the first tank" in page(read_described(str(copy.folder)))
    assert before == {path: path.read_bytes() for path in copy.folder.rglob("*") if path.is_file()}


def test_an_element_is_closed_and_escapes_what_is_no_markup() -> None:
    assert element("p", "a < b", Markup("<b/>"), title='"x"') == '<p title="&quot;x&quot;">a &lt; b<b/></p>'
    assert element("circle", r=5.0, class_=None) == '<circle r="5"/>' and element("td") == "<td></td>"
    assert element("p", "a\x00\ud800") == "<p>a\\x00\\ud800</p>"


def test_a_label_is_broken_at_spaces_and_what_is_cut_is_seen() -> None:
    assert broken("Heat content of the reactor", 12.0, 130.0, 3) == ["Heat content of the", "reactor"]
    assert broken("", 12.0, 130.0, 3) == []
    for text in ("x" * 90, "one two three four five six seven eight nine", "a_very.long_name_of_a.tag" * 4):
        lines = broken(text, 12.0, 80.0, 2)
        assert len(lines) == 2 and lines[-1].endswith("…") and all(width(line, 12.0) <= 80.0 for line in lines)


def test_settings_correct_the_drawing_and_name_what_is_drawn() -> None:
    plant = read_described("cstr")
    shapes, arrows = flowsheet_figure(plant.description, plant.flowsheet)
    as_it_is = arranged(shapes, arrows, Direction.RIGHT).places
    drawn = DrawingTable(later={"PO_Cool": 1}, order=["reactor_heat", "reactor_content"])
    corrected = corrections("cstr", plant.flowsheet, drawn)
    moved = arranged(shapes, arrows, Direction.RIGHT, corrected).places
    assert as_it_is["operator PO_Cool"].along == pytest.approx(as_it_is["operator PO_Withdraw"].along, abs=20.0)
    assert moved["operator PO_Cool"].along > moved["operator PO_Withdraw"].along + 100.0
    for place, content_first in ((as_it_is, True), (moved, False)):
        assert (place["flow reactor_content"].across < place["flow reactor_heat"].across) is content_first
    with pytest.raises(PlantError, match=r"no process operator or flow 'PO_Fed'.*'PO_Feed'"):
        corrections("cstr", plant.flowsheet, DrawingTable(order=["PO_Fed"]))


@pytest.mark.parametrize("wrong", ["later = { PO_Feed = 0 }", "later = { PO_Feed = 21 }", "sooner = 1", 'order = "a"'])
def test_what_is_no_correction_is_refused_with_its_place(wrong: str, tmp_path: Path) -> None:
    copy = Copy.of("cstr", tmp_path)
    settings = copy.folder / "case.toml"
    settings.write_text(f"{settings.read_text('utf-8')}\n[drawing]\n{wrong}\n", "utf-8")
    with pytest.raises(PlantError, match="drawing"):
        read_described(str(copy.folder))
