"""Steps of the integration that are too long are found, and what is merely steep is not."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.integration import integration
from homeostat.evaluate.lint.finding import Finding

EXAMPLES = Path(__file__).parents[3] / "examples"


def found(folder: Path, probe: str = "") -> list[Finding]:
    with (folder / "process.py").open("a") as module:
        module.write(probe)
    return list(integration(Bench(folder)))


def copied(name: str, at: Path) -> Path:
    return Path(shutil.copytree(EXAMPLES / name, at / name))


def probing(rate: float, parts: int = 1) -> str:
    return f"""
from homeostat.process.blocks import number
from homeostat.process.blocks.term import term

tanks.parts = term({float(parts)})
probe = tanks.state("probe", "K", "T_feed")
tanks.rate(probe, (t2 - probe) * number({rate}, "1/s"))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rate", "parts", "needed"), [(5.0, 1, 4), pytest.param(5.0, 4, 0, marks=pytest.mark.wide), (1000.0, 1, 715)]
)
def test_what_moves_within_a_step_is_found_with_the_steps_that_it_needs(
    tmp_path: Path, rate: float, parts: int, needed: int
) -> None:
    findings = found(copied("two_tanks", tmp_path), probing(rate, parts))
    assert len(findings) == (1 if needed else 0)
    for finding in findings:
        assert "'probe'" in finding.what and finding.where.file == "process.py"
        proposed = f"parts={needed}" if needed <= 100 else "a shorter tick_s"
        assert proposed in finding.remedy


def test_a_valve_between_equal_pressures_is_steep_and_no_mistake(tmp_path: Path) -> None:
    assert not found(copied("instrument_air", tmp_path))


def test_gas_in_a_small_volume_is_found_where_only_commands_lead(tmp_path: Path) -> None:
    folder = copied("instrument_air", tmp_path)
    parameters = folder / "engineering" / "parameters.csv"
    small = parameters.read_text().replace("size_B2,1000,", "size_B2,8,").replace("start_B2,150,", "start_B2,1.5,")
    parameters.write_text(small)
    (finding,) = found(folder)
    assert "'B2_V'" in finding.what and "Flowsheet(parts=" in finding.remedy
