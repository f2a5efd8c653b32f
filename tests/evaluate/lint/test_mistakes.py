"""Sixty mistakes in a plant's folder and some more: each is found by its check, with place and remedy."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from benchmarks.plants.further import FURTHER
from benchmarks.plants.in_models import IN_MODELS
from benchmarks.plants.in_tables import IN_TABLES
from benchmarks.plants.mistake import Mistake
from benchmarks.plants.site import NAME, change, make
from homeostat.evaluate.lint.checks import CHECKS
from homeostat.evaluate.lint.child import findings_of
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.finding import Finding
from homeostat.evaluate.lint.stated import stated
from homeostat.plants.files.folder import read_files
from tests.cli.command import homeostat

MISTAKES = (*IN_TABLES, *IN_MODELS)
HANGS = "equations that never end"
SLOW = ("fallbacks", "faults", "loops", "numbers", "symptoms")
"""Checks that simulate many courses, or learn reference values."""
OF_KIND = {
    "misspelt names": "stated", "wrong units": "model", "wrong signs": "loops", "limits": "fault-free",
    "guards and states": "model", "permissives": "model", "readings, truth and estimate": "interface",
    "balances and the physical world": "balances", "control": "loops", "faults": "faults", "fallbacks": "fallbacks",
    "noise, quality and times": "numbers",
}  # fmt: skip
"""Class of mistakes -> the check that finds them, but for those that follow."""
OTHER = {
    "production per minute": "stated", "a flow in m3/h": "stated", "a feed temperature in Celsius": "fault-free",
    "a time constant in milliseconds": "loops", "a fallback that closes the cooling": "fallbacks",
    "the direction of a symptom": "faults", "a proportional gain": "model", "a level that no instrument shows": "model",
    "a range below the limit": "model", "a start-up that never ends": "fault-free", "a guard beyond a limit": "rules",
    "a restart that drains too far": "fallbacks", "feed only below 5 L": "fault-free",
    "cooling that is never so high": "fault-free", "a setpoint that no limit minds": "rules",
    "an estimate that forgets the level": "following", "a temperature that is no number": "fault-free",
    "controllers that forget": "following", "one controller that forgets": "following",
    "a rollout that ends too early": "model", "a symptom of a healthy plant": "symptoms",
}  # fmt: skip
"""Mistake -> the check that finds it, where others of its class are found by another."""


FOUND_BY = {
    "a symptom of a fault": "stated", "a tag in a limit": "stated", "a heat transfer in kW/K": "fault-free",
    "the time of start-up in minutes": "fault-free", "a brim in cubic metres": "fault-free",
    "both gains of the temperature loop": "loops", "a symptom of what is too hot": "faults",
    "a limit that no fallback serves": "model", "a limit that nothing can keep": "model",
    "a state that there is not": "stated", "a state that its own setpoints never settle": "model",
    "a valve that is never so open": "model", "cooling the wrong way round": "fault-free",
    "an estimate that fails": "interface", "a truth in degrees Celsius": "fault-free",
    "two readings that were swapped": "following", "liquid from nowhere": "balances",
    "a heat balance that forgets the feed": "balances", "a temperature loop without reset": "loops",
    "a pump that is too small": "loops", "a jacket that is too small": "loops",
    "gains a hundred times too small": "loops", "a typical size that is outside its range": "stated",
    "a fault of nothing that there is": "stated", "a setpoint beyond what the state admits": "model",
    "a command of what is only read": "stated", "a noise of a twin that is much too small": "numbers",
    "a time to settle that never ends": "stated", "one number where two are needed": "stated",
}  # fmt: skip
"""Mistake beside the sixty -> the check that finds it."""
CHEAP = ("stated", "model", "interface")
"""Checks that simulate nothing long."""


def check_of(mistake: Mistake) -> str:
    if mistake.name in FOUND_BY:
        return FOUND_BY[mistake.name]
    return OTHER.get(mistake.name, OF_KIND[mistake.kind])


QUICK = [m for m in MISTAKES if check_of(m) not in SLOW and m.name != HANGS]
OTHERS = [m for m in MISTAKES if check_of(m) in SLOW]
FIRST = {(m.kind, check_of(m)): m.name for m in reversed(QUICK)}
"""Class of mistakes and check that finds them -> the first such mistake."""


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make(tmp_path_factory.mktemp("template"))


@pytest.fixture
def site(template: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(template, tmp_path / NAME))


def found(folder: Path, check: str) -> list[Finding]:
    """What one check finds that counts; all that comes before it must find nothing of its own."""
    first = stated(read_files(folder))
    if check == "stated":
        return [finding for finding in first.findings if finding.counts]
    assert first.sound, first.findings
    found = findings_of(CHECKS[check], Bench(folder))
    return [each for each in found if isinstance(each, Finding) and each.counts]


def assert_found(mistake: Mistake, folder: Path) -> None:
    change(folder, mistake.edits)
    pointing = [f for f in found(folder, check_of(mistake)) if any(point in str(f) for point in mistake.points)]
    assert pointing, mistake.name
    assert pointing[0].remedy and pointing[0].where.file and "\n" not in str(pointing[0])


def test_there_are_five_of_each_of_twelve_classes() -> None:
    kinds = [mistake.kind for mistake in MISTAKES]
    assert sorted({kinds.count(kind) for kind in kinds}) == [5] and len(set(kinds)) == 12
    assert len({mistake.name for mistake in MISTAKES}) == 60


@pytest.mark.parametrize(
    "mistake",
    [pytest.param(m, id=m.name, marks=[] if m.name in FIRST.values() else pytest.mark.wide) for m in QUICK],
)
def test_a_mistake_is_found_by_its_check(mistake: Mistake, site: Path) -> None:
    assert_found(mistake, site)


@pytest.mark.wide
@pytest.mark.parametrize("mistake", OTHERS, ids=lambda mistake: mistake.name)
def test_a_mistake_that_takes_longer_is_found_by_its_check(mistake: Mistake, site: Path) -> None:
    assert_found(mistake, site)


def test_there_are_further_ones_of_each_class() -> None:
    assert {mistake.name for mistake in FURTHER} == FOUND_BY.keys() and len(FURTHER) == len(FOUND_BY) >= 24
    assert {mistake.kind for mistake in FURTHER} == {mistake.kind for mistake in MISTAKES}
    assert not FOUND_BY.keys() & {mistake.name for mistake in MISTAKES}


@pytest.mark.parametrize("mistake", [m for m in FURTHER if check_of(m) in CHEAP], ids=lambda mistake: mistake.name)
def test_a_further_mistake_is_found_by_its_check(mistake: Mistake, site: Path) -> None:
    assert_found(mistake, site)


@pytest.mark.wide
@pytest.mark.parametrize("mistake", [m for m in FURTHER if check_of(m) not in CHEAP], ids=lambda mistake: mistake.name)
def test_a_further_mistake_that_a_simulation_shows_is_found_by_its_check(mistake: Mistake, site: Path) -> None:
    assert_found(mistake, site)


def test_every_mistake_of_the_settings_is_told_at_once(site: Path) -> None:
    named = [m for m in IN_TABLES if m.name in ("a key of [twin]", "production per minute")]
    change(site, [named[0].edits[0]])
    settings = site / "case.toml"
    settings.write_text(settings.read_text("utf-8").replace("gain_error = 0.1", "gain_error = 7"), "utf-8")
    texts = [str(finding) for finding in found(site, "stated")]
    assert any("leed_s" in text and "lead_s" in text for text in texts)
    assert any("gain_error" in text and "7" in text for text in texts)


@pytest.mark.parametrize(
    "name", ["a limit of a figure", pytest.param("a guard that contradicts itself", marks=pytest.mark.wide)]
)
def test_the_command_says_where_and_ends_with_1(name: str, site: Path) -> None:
    mistake = next(m for m in MISTAKES if m.name == name)
    change(site, mistake.edits)
    done = homeostat("plant", "check", "--deep", "--json", f"./{NAME}", cwd=site.parent)
    said = json.loads(done.out)
    assert done.status == 1 and said["clean"] is False
    assert any(point in json.dumps(said["findings"]) for point in mistake.points)
    assert all(finding["where"]["file"] and finding["remedy"] for finding in said["findings"])
