from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from homeostat.plants.files.places import plant_names
from homeostat.plants.plant import load_plant
from tests.cli.command import environment, homeostat


def test_every_case_and_fault_is_listed(tmp_path: Path) -> None:
    done = homeostat("cases", cwd=tmp_path)
    assert (done.status, done.err) == (0, "")
    for name in plant_names():
        plant = load_plant(name)
        assert f"{name}: {plant.title}\n" in done.out
        for fault in plant.description.faults:
            (line,) = (line for line in done.out.splitlines() if line.split()[:1] == [fault.name])
            low, high = fault.severity_range.low, fault.severity_range.high
            unit = "-" if fault.severity_unit == "1" else fault.severity_unit
            assert line.split()[1:6] == [f"{fault.severity_nominal:g}", f"{low:g}", "to", f"{high:g}", unit]


def test_describing_a_plant_loads_neither_the_compiler_nor_the_twin(tmp_path: Path) -> None:
    """Whoever only wants to know what there is does not wait for what simulates it."""
    ask = "import sys; from homeostat.cli.main import main; main(['cases']); print(*sys.modules, file=sys.stderr)"
    done = subprocess.run(
        [sys.executable, "-c", ask], cwd=tmp_path, env=environment(), capture_output=True, text=True, check=True
    )
    assert not {"numba", "llvmlite", "homeostat.twin.twin", "homeostat.journal"} & set(done.stderr.split())
