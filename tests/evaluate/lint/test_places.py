"""A place is the row of the table that states the thing, by whatever name a check knows it."""

from __future__ import annotations

import csv

import pytest

from homeostat.evaluate.lint.finding import Finding, Place, Severity, split
from homeostat.evaluate.lint.places import Places, setting
from homeostat.plants.files.folder import INSTALLED

FOLDER = INSTALLED / "cstr"
PLACES = Places(FOLDER)


@pytest.mark.parametrize(
    ("thing", "file", "column", "name"),
    [
        ("limit 'LIM-T-HIGH'", "limits", "id", "LIM-T-HIGH"),
        ("trip of limit 'LIM-L-LOW'", "trips", "limit", "LIM-L-LOW"),
        ("quality of tag 'V1.pos'", "quality", "tag", "V1.pos"),
        ("fallback 'isolate'", "fallbacks", "strategy", "isolate"),
        ("feature_F-MASS", "features", "id", "F-MASS"),
        ("FIC1-loop", "loops", "id", "FIC1-loop"),
    ],
)
def test_a_thing_is_where_its_table_states_it(thing: str, file: str, column: str, name: str) -> None:
    place = PLACES.thing(thing)
    assert place.file == f"engineering/{file}.csv" and place.row is not None
    with (FOLDER / place.file).open(encoding="utf-8", newline="") as stream:
        assert name in list(csv.DictReader(stream))[place.row - 2][column].split("|")


def test_a_row_that_a_message_names_is_that_row() -> None:
    assert PLACES.thing("trips.csv row 2 ('LIM-T-HIGH')") == Place("engineering/trips.csv", 2, "LIM-T-HIGH")


def test_what_no_table_states_has_no_row() -> None:
    assert PLACES.row("limits", id="LIM-X") == Place("engineering/limits.csv", None, "LIM-X")
    assert PLACES.thing("something else").row is None


def test_keys_of_settings_are_a_place() -> None:
    place, said = setting("site/case.toml: twin, judged_draws: -1 draws is outside 1 to 1000 draws")
    assert (place.file, place.key, said) == ("case.toml", "twin, judged_draws", "-1 draws is outside 1 to 1000 draws")


def test_the_last_clause_is_the_remedy_and_only_notes_do_not_count() -> None:
    assert split("it is wrong; correct it", "x") == ("it is wrong", "correct it") and split("it is", "x") == (
        "it is",
        "x",
    )
    counting = [Finding(severity, "c", Place("f"), "w", "r").counts for severity in Severity]
    assert counting == [True, True, False]
