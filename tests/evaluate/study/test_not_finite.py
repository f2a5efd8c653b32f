"""Studies and runs of plants in which something is no number at the end, as an output that is on automatic."""

from __future__ import annotations

from pathlib import Path

import homeostat as hs
from homeostat.evaluate.study.engine import Done, measured
from homeostat.evaluate.study.measurement import KeptRuns
from homeostat.journal.verify.verify import verify
from homeostat.record.result import read_result
from tests.plants.copies import Copy

STUDY = """
title = "Of our own"
keep = "all"
proposers = ["do-nothing"]

[[scenarios]]
case = "./cstr"
end_s = 30.0
"""
DELIVERED = 'delivered = ["product", "L1"]'


def only(copy: Copy, kept: Path) -> Done:
    """What came of the one job of a study of the plant."""
    (copy.folder.parent / "own.toml").write_text(STUDY)
    (job,) = hs.Study(copy.folder.parent / "own.toml").jobs
    return measured(job, KeptRuns(kept))


def test_a_total_that_is_no_number_is_left_out(tmp_path: Path) -> None:
    """The output of the cooling valve is on automatic: it has no value of its own."""
    copy = Copy.of("cstr", tmp_path)
    totals = f'totals = {{ valve_1 = "V2.man", level_L = "L1" }}\nreported = ["valve_1", "level_L"]\n{DELIVERED}'
    copy.replace("case.toml", DELIVERED, totals)
    done = only(copy, tmp_path)
    assert done.row is not None, done.failure
    assert list(done.row.totals) == ["level_L"]
    kept = tmp_path / done.row.trace
    result = read_result(kept)
    assert result is not None and result.totals == done.row.totals and verify(kept).complete
