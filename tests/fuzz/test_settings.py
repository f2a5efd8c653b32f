"""Random keys, values and texts as settings: read within their bounds, or one line that names the place."""

from __future__ import annotations

import tomllib
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import INSTALLED, SETTINGS, PlantFiles
from homeostat.plants.settings.file import read_settings

TEXTS = {name: (INSTALLED / name / SETTINGS).read_text(encoding="utf-8") for name in ("cstr", "mixing_module")}
VALUES = st.one_of(
    st.sampled_from(
        ["nan", "inf", "-1", "0", "1e300", "true", "[]", "{}", '""', '"x"', "1979-05-27", "[1,2]", "9" * 400]
    ),
    st.floats().map(repr),
    st.integers().map(str),
)
KEYS = st.one_of(
    st.sampled_from(["horizon", "end", "draws", "modell", "titel", "x.y", '"a b"', '""']), st.text(max_size=6)
)
INSERTED = st.text(alphabet='\n[]{}="#.,-+_ aeinstx019\\\x00\u202e', max_size=8)


def judged(text: str) -> None:
    files = PlantFiles(Path("plant"), {SETTINGS: text.encode("utf-8", "surrogatepass")})
    try:
        read = read_settings(files)
    except PlantError as error:
        assert str(error).isprintable() and len(str(error)) < 1200 and SETTINGS in str(error), str(error)
    else:
        assert 0.0 < read.run.end_s <= 604_800.0 and 1 <= read.twin.settings.horizon_s <= 86_400


@settings(max_examples=300)
@given(st.sampled_from(sorted(TEXTS)), st.data())
def test_lines_that_are_others(name: str, data: st.DataObject) -> None:
    lines = TEXTS[name].split("\n")
    for _ in range(data.draw(st.integers(1, 2))):
        at = data.draw(st.integers(0, len(lines) - 1))
        key, equals, _ = lines[at].partition("=")
        match data.draw(st.sampled_from(["value", "key", "lost", "added", "twice"])):
            case "value" if equals:
                lines[at] = f"{key}= {data.draw(VALUES)}"
            case "key" if equals:
                lines[at] = lines[at].replace(key, f"{data.draw(KEYS)} ", 1)
            case "lost":
                del lines[at]
            case "twice":
                lines.insert(at, lines[at])
            case _:
                lines.insert(at, f"{data.draw(KEYS)} = {data.draw(VALUES)}")
    judged("\n".join(lines))


@settings(max_examples=200)
@given(st.sampled_from(sorted(TEXTS)), INSERTED, st.floats(0, 1), st.integers(0, 3))
def test_a_damaged_file(name: str, inserted: str, place: float, removed: int) -> None:
    text = TEXTS[name]
    at = int(place * len(text))
    judged(text[:at] + inserted + text[at + removed :])


def test_the_files_as_they_are_are_well() -> None:
    for text in TEXTS.values():
        assert tomllib.loads(text)
        judged(text)
