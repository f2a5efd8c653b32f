from __future__ import annotations

from pathlib import Path

from homeostat.plants.folder import case_names
from homeostat.plants.plant import load_case
from tests.cli.command import homeostat


def test_every_case_and_fault_is_listed(tmp_path: Path) -> None:
    done = homeostat("cases", cwd=tmp_path)
    assert (done.status, done.err) == (0, "")
    for name in case_names():
        case = load_case(name)
        assert f"{name}: {case.title}\n" in done.out
        for fault in case.description.faults:
            (line,) = (line for line in done.out.splitlines() if line.split()[:1] == [fault.name])
            low, high = fault.severity_range.low, fault.severity_range.high
            unit = "-" if fault.severity_unit == "1" else fault.severity_unit
            assert line.split()[1:6] == [f"{fault.severity_nominal:g}", f"{low:g}", "to", f"{high:g}", unit]
