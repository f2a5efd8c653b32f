"""Settings that only a course shows to be wrong are named with what they clash with."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.safe_states import safe_states
from homeostat.evaluate.lint.deep.settings import of_settings
from homeostat.evaluate.lint.finding import Severity

TANKS = Path(__file__).parents[3] / "examples" / "two_tanks"


def changed(at: Path, *changes: tuple[str, str, str]) -> Bench:
    folder = Path(shutil.copytree(TANKS, at / "two_tanks"))
    for name, before, after in changes:
        text = (folder / name).read_text()
        assert before in text
        (folder / name).write_text(text.replace(before, after))
    return Bench(folder)


@pytest.mark.parametrize(
    ("changes", "key", "said"),
    [
        ((), "", ""),
        ((("case.toml", "onset_s = 2000.0", "onset_s = 800.0"),), "run, onset_s", "a fault begins at 800 s"),
        (
            (("process.py", '("product", "L", product)', '("product", "L", product * 1000.0)'),),
            "objective, delivered",
            "0.2 L/s for each 1 s",
        ),
        ((("case.toml", 'throughput = "F1"', 'throughput = "F1"\nper_s = 60.0'),), "objective, delivered", "each 60 s"),
    ],
)
def test_what_a_course_shows_of_the_settings_is_said(
    tmp_path: Path, changes: tuple[tuple[str, str, str], ...], key: str, said: str
) -> None:
    findings = list(of_settings(changed(tmp_path, *changes)))
    assert [f.where.key for f in findings] == ([key] if key else [])
    assert all(said in f.what and f.severity is Severity.WARNING and f.remedy for f in findings)


@pytest.mark.slow
def test_a_fallback_that_its_rate_keeps_from_helping_is_told_which_one(tmp_path: Path) -> None:
    bench = changed(
        tmp_path,
        ("engineering/fallbacks.csv", "strategy,target,tag,value", "strategy,target,tag,value,rate"),
        ("engineering/fallbacks.csv", "stop,shutdown,F1.sp,0", "stop,shutdown,F1.sp,0,0.0002"),
        ("engineering/fallbacks.csv", "man,0", "man,0,"),
        ("engineering/fallbacks.csv", "T2.sp,20", "T2.sp,20,"),
        ("engineering/fallbacks.csv", "F1.sp,0.4", "F1.sp,0.4,"),
        ("engineering/fallback_limits.csv", "stop,LIM-L1-HIGH,60,10", "stop,LIM-L1-HIGH,60,1"),
    )
    told = [f.what for f in safe_states(bench) if "LIM-L1-HIGH" in f.what]
    assert told and all("'F1.sp' takes" in what and "0.0002 L/s/s" in what for what in told)
