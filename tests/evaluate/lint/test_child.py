"""What a plant's code may do while it is checked: hang, end the process, raise anything, print."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.plants.site import MODEL, NAME
from homeostat.evaluate.lint.child import carried_out
from homeostat.evaluate.lint.deep.faults import Outlook
from homeostat.evaluate.lint.finding import Finding
from homeostat.knowledge.build.build import build
from tests.cli.command import homeostat
from tests.plants.copies import Copy

HANGS = """
    def truth(self, record, inputs):
        while record.shape[1] > 100:
            pass
        return super().truth(record, inputs)
"""
NAMES = ("model", "interface", "repetition")


def site(where: Path, body: str) -> Path:
    """The reactor with a model of its own, which has ``body`` in it; it has no reference values."""
    folder = Copy.of("cstr", where).folder.rename(where / NAME)
    for module in (*folder.glob("*.py"), *folder.glob("true/*"), folder / "baseline.csv"):
        module.unlink()
    (folder / "process.py").write_text(f"import os, time\n{MODEL}{body}", "utf-8")
    Copy(folder).replace("case.toml", "homeostat.plants.cstr.process:REACTOR", "process:SiteModel")
    (folder / "plant.ttl").write_bytes(build(folder))
    return folder


def readings(statement: str) -> str:
    lines = ("def readings(self, state, inputs):", f"    {statement}", "    return super().readings(state, inputs)")
    return "".join(f"\n    {line}" for line in lines) + "\n"


def said(folder: Path, silent_s: float = 20.0) -> list[Finding]:
    found: list[Finding | Outlook] = list(carried_out(folder, NAMES, lambda begun: None, silent_s))
    return [each for each in found if isinstance(each, Finding)]


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        pytest.param("raise ValueError('no such state')", "ValueError: no such state", marks=pytest.mark.wide),
        pytest.param("raise SystemExit(0)", "SystemExit: 0", marks=pytest.mark.wide),
        pytest.param("raise BaseException()", "BaseException", marks=pytest.mark.wide),
        ("os._exit(7)", "ends the process, with status 7"),
        pytest.param("return {}", "readings have no", marks=pytest.mark.wide),
        pytest.param("return 5", "TypeError", marks=pytest.mark.wide),
    ],
)
def test_whatever_it_does_is_a_finding_with_a_place_and_a_remedy(tmp_path: Path, statement: str, words: str) -> None:
    found = said(site(tmp_path, readings(statement)))
    assert words in str(found[0]) and found[0].where.file == "process.py" and found[0].remedy
    assert "Traceback" not in str(found[0])


def test_what_is_raised_names_the_line(tmp_path: Path) -> None:
    folder = site(tmp_path, readings("raise ValueError('x')"))
    line = (folder / "process.py").read_text("utf-8").splitlines().index("        raise ValueError('x')") + 1
    assert said(folder)[0].where.row == line


@pytest.mark.slow
def test_equations_that_never_end_are_ended_and_told(tmp_path: Path) -> None:
    folder = site(tmp_path, HANGS)
    found = list(carried_out(folder, ("repetition", "fault-free"), lambda begun: None, 4.0))
    (hung,) = [each for each in found if isinstance(each, Finding)]
    assert hung.check == "fault-free" and "does not answer for 4 s" in hung.what and hung.remedy
    lines = (folder / "process.py").read_text("utf-8").splitlines()
    assert hung.where.file == "process.py" and hung.where.row is not None
    assert lines[hung.where.row - 1].strip() in ("while record.shape[1] > 100:", "pass")


def test_what_it_prints_is_no_part_of_the_answer(tmp_path: Path) -> None:
    site(tmp_path, "\nprint('hello from the plant')\n")
    done = homeostat("plant", "check", "--json", f"./{NAME}", cwd=tmp_path)
    assert done.status == 0 and json.loads(done.out)["clean"] is True
    assert "checking model" in done.err
