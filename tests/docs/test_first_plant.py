"""The guide to a first plant has every file of the example, word for word, and the example is as short as it says."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from homeostat.evaluate.lint.check import check
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.symptoms import first_symptoms
from homeostat.plants.plant import load_plant
from tests.docs.blocks import REPO, blocks
from tests.evaluate.two_tanks import tanks

GUIDE = (REPO / "docs" / "tutorials" / "your-first-plant.md").read_text("utf-8")
EXAMPLE = REPO / "examples" / "two_tanks"
GENERATED = {"plant.ttl", "baseline.csv"}
FILES = sorted(path for path in EXAMPLE.rglob("*") if path.is_file() and path.suffix in (".py", ".csv", ".toml"))
WRITTEN = [path for path in FILES if path.name not in GENERATED]
MOST_LINES = 260
MOST_LINES_OF_MODEL = 25


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: path.name)
def test_the_guide_shows_the_file_as_it_is(path: Path) -> None:
    assert path.read_text("utf-8") in {block.body for block in blocks(GUIDE)}
    assert f"`{path.relative_to(EXAMPLE).as_posix()}`:" in GUIDE


def test_the_table_of_totals_is_one_that_the_plant_takes(tmp_path: Path) -> None:
    (shown,) = (block.body for block in blocks(GUIDE) if "totals = " in block.body)
    folder = tanks(tmp_path)
    settings = (folder / "case.toml").read_text("utf-8")
    stated, separator, rest = settings.partition("[objective]\n")
    (folder / "case.toml").write_text(f"{stated}{shown}\n{rest[rest.index('[twin]') :]}", "utf-8")
    assert separator and load_plant(str(folder), learned=False, kept=False).totals == {"product_L": "product"}


def worked(folder: Path) -> Path:
    """The example with the tables of the guide's section on what a loop hides."""
    made = Path(
        shutil.copytree(EXAMPLE, folder / "two_tanks", ignore=shutil.ignore_patterns("plant.ttl", "__pycache__"))
    )
    section = GUIDE.partition("## 6. What a loop hides")[2].partition("\n## ")[0]
    names = re.findall(r"^`engineering/(\w+)\.csv`:$", section, re.MULTILINE)
    assert names == ["features", "symptoms", "symptom_faults"]
    for name, block in zip(names, blocks(section), strict=True):
        (made / "engineering" / f"{name}.csv").write_text(block.body, "utf-8")
    return made


@pytest.mark.slow
def test_what_a_loop_hides_is_shown_by_the_balance_alone(tmp_path: Path) -> None:
    made = worked(tmp_path)
    assert [str(each) for each in check(str(made)).findings if each.counts] == []
    bench = Bench(made)
    healthy = first_symptoms(bench, bench.quiet, bench.onset_s)
    assert all(shown.confirmed_s is None for shown in healthy.values())
    course = bench.faulty(bench.plant.description.fault("H1_weak"), 1.0 / 6.0)
    found = first_symptoms(bench, course, bench.onset_s)
    assert [rule.name for rule, shown in found.items() if shown.confirmed_s is not None] == ["S-HEAT"]


def test_the_plant_is_short() -> None:
    lines = {path: len(path.read_text("utf-8").splitlines()) for path in WRITTEN}
    assert sum(lines.values()) <= MOST_LINES
    assert lines[EXAMPLE / "process.py"] <= MOST_LINES_OF_MODEL
