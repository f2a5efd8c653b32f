"""The page of plants: what one command writes stays when another one writes its part."""

from __future__ import annotations

from benchmarks.plants.__main__ import Answer, row, summary
from benchmarks.plants.mistake import table
from benchmarks.plants.page import LAST, section, with_section

PAGE = f"# A page\n\n## First\n\nOne.\n\n## {LAST}\n\nMore.\n\nMeasured here.\n"
MISTAKE = table("limits", "too low", "limits", "a", "b", "LIM-T")


def given(status: int, remedy: str, key: str = "LIM-T") -> Answer:
    where = {"file": "engineering/limits.csv", "row": 2, "key": key}
    return Answer("too low", status, False, ({"check": "rules", "where": where, "remedy": remedy},), 12.4, 3.2)


def test_a_new_section_stands_before_the_last_one_and_is_replaced_in_its_place() -> None:
    once = with_section(PAGE, "Second", "Two.")
    assert once == PAGE.replace(f"## {LAST}", f"## Second\n\nTwo.\n\n## {LAST}")
    twice = with_section(with_section(once, "First", "1"), "Second", "Three\\1.")
    assert section(twice, "Second") == "## Second\n\nThree\\1.\n\n" and twice.endswith("Measured here.\n")
    assert twice.index("## First") < twice.index("## Second") < twice.index(f"## {LAST}")


def test_a_page_without_that_last_section_gets_it_at_its_end() -> None:
    assert with_section("# A page\n", "Second", "Two.") == "# A page\n\n## Second\n\nTwo.\n"
    assert section("# A page\n", "Second") == ""


def test_a_mistake_counts_where_it_is_refused_with_place_and_remedy() -> None:
    found, missed, vague = given(1, "correct it"), given(1, "correct it", "LIM-L"), given(0, "correct it")
    assert row(MISTAKE, found) == "| limits | too low | yes | rules: engineering/limits.csv row 2 (LIM-T) | 12 | 3 |"
    assert "| no: 1 other findings |" in row(MISTAKE, missed) and "| no: status 0 |" in row(MISTAKE, vague)
    assert not given(1, "").found(MISTAKE)
    assert summary([MISTAKE] * 3, [found, missed, vague]).startswith(
        "1 of 3 found with place and remedy; 0 tracebacks."
    )
