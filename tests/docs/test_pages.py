"""What pages say of the code is so: the glossary's events and outcomes, the journeys' calls, the tree, the layers."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from homeostat.domain.outcome import Outcome
from homeostat.record.events import EVENTS

REPO = Path(__file__).resolve().parents[2]
SOURCES = REPO / "src" / "homeostat"


def rows(page: str, columns: int) -> list[list[str]]:
    """Cells of the page's table lines that have so many columns."""
    lines = (REPO / "docs" / page).read_text(encoding="utf-8").splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    return [row for row in cells if len(row) == columns]


def test_the_glossary_has_every_event_and_no_other() -> None:
    told = {row[0]: row[1] for row in rows("glossary.md", 3) if row[0].startswith("`")}
    assert told == {f"`{event.kind}`": f"`{event.__name__}`" for event in EVENTS}


def test_the_glossary_has_every_outcome_in_the_order_in_which_they_apply() -> None:
    told = [row[0].strip("`") for row in rows("glossary.md", 2) if row[0].startswith("`")]
    assert told == [outcome.value for outcome in Outcome]


def test_the_words_are_in_alphabetical_order_and_there_once() -> None:
    words = [row[0] for row in rows("glossary.md", 3) if not row[0].startswith(("`", "-", "Word", "Event"))]
    assert len(words) > 40 and len(set(words)) == len(words)
    assert words == sorted(words, key=str.lower)


@pytest.mark.parametrize("row", [r for r in rows("journeys.md", 3) if r[0].startswith("`")], ids=lambda row: row[1])
def test_every_call_of_the_journeys_is_in_its_folder(row: list[str]) -> None:
    folders = [SOURCES / floor.strip("`") for floor in row[0].split(", ") if "<plant>" not in floor]
    text = "\n".join(p.read_text(encoding="utf-8") for folder in folders for p in folder.rglob("*.py"))
    for span in re.findall(r"`([^`]+)`", row[1]):
        for name in re.findall(r"[A-Za-z_]\w+(?=\()|\b[A-Z]\w+", span.partition("(")[0] + "(" * ("(" in span)):
            assert not folders or re.search(rf"\b(class|def) {name}\b", text), f"{name} is not in {row[0]}"


def test_every_folder_is_in_the_architecture_and_in_the_layers() -> None:
    page = (REPO / "docs" / "architecture.md").read_text(encoding="utf-8")
    contributing = (REPO / "CONTRIBUTING.md").read_text(encoding="utf-8")
    settings = tomllib.loads((REPO / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    layers = next(c["layers"] for c in settings["importlinter"]["contracts"] if c["id"] == "layers")
    order = " > ".join(layers)
    assert f"`{order}`" in page and f"`{order}`" in contributing
    for folder in (path.name for path in SOURCES.iterdir() if path.is_dir() and path.name[0] != "_"):
        assert f"\n  {folder}/ " in page, f"{folder}/ is not in the tree of the architecture"


def tree() -> dict[str, str]:
    """Folder under the package -> what the architecture's tree says is in it, without what stands in brackets."""
    page = (REPO / "docs" / "architecture.md").read_text(encoding="utf-8")
    block = page.partition("```\nsrc/homeostat/\n")[2].partition("```")[0]
    found, above = dict[str, str](), ""
    for line in block.splitlines():
        entry = re.match(r"( {2}| {4})([\w.]+/?) +(.*)", line)
        if entry is None:
            found[next(reversed(found))] += " " + line.strip()
            continue
        depth, name, said = len(entry[1]), entry[2], entry[3]
        above = name if depth == 2 else above
        found[name if depth == 2 else above + name] = said
    return {name: re.sub(r"\([^()]*\)", "", said) for name, said in found.items()}


@pytest.mark.parametrize(("name", "said"), tree().items(), ids=lambda value: value[:20])
def test_every_module_and_folder_in_the_tree_of_the_architecture_is_there(name: str, said: str) -> None:
    assert (SOURCES / name).exists(), name
    for each in [] if (SOURCES / name).is_file() else re.split(r"[,;:]| and |  ", said):
        if re.fullmatch(r"[a-z_]+(/|\.\w+)?", word := each.strip()):
            places = [SOURCES / name / word, SOURCES / name / f"{word}.py"]
            assert any(place.exists() for place in places), f"{name}{word}"


def pages() -> list[Path]:
    """The pages of people: what is made by a command may not be there."""
    return [REPO / "README.md", REPO / "CONTRIBUTING.md", *sorted((REPO / "docs").rglob("*.md"))]


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.name)
def test_every_link_to_a_file_leads_to_one(page: Path) -> None:
    made = {REPO / "docs" / "coverage.md"}
    for target in re.findall(r"\]\(([^)\s#]+)[^)]*\)", page.read_text(encoding="utf-8")):
        if not re.match(r"[a-z]+:", target):
            there = (page.parent / target).resolve()
            assert there.exists() or there in made, f"{page.name}: {target}"
