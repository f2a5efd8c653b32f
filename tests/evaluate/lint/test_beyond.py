"""What a fault breaks only hours later is told, unless a fallback acts before."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.beyond import beyond
from homeostat.evaluate.lint.finding import Severity
from homeostat.plants.files.folder import INSTALLED
from tests.evaluate.two_tanks import TANKS, change, tanks

SEAL = """
seal = tanks.state("seal", "L", "seal_start")
warm = tanks.state("warm", "K", "seal_warm")
open_by = tanks.fault("seal_leak")
tanks.rate(seal, lambda: -open_by * "seep")
tanks.rate(warm, lambda: "friction" * (term("seal_start") / seal - 1.0))
"""
"""Liquid that a seal loses, and that warms the more the less there is: by the last of it without an end."""
FAULT = """id,label,component,severity_unit,nominal,low,high,prior,disables,description
seal_leak,Transfer pump: seal leaks,P1,1,0.5,0.1,0.95,0.1,,The seal loses its liquid
"""
PARAMETERS = """seal_start,100,L,0,,P1,Liquid of the seal
seal_warm,300,K,0,,P1,Its temperature
seep,{seep},L/s,0,,P1,What it loses where it is open
friction,0.001,K/s,0,,P1,What warms it
"""


def sealed(folder: Path, seep: float) -> Path:
    """The two tanks with such a seal, which loses ``seep`` [L/s] of 100 L where it is open."""
    made = tanks(folder)
    change(made, "process.py", "overflow, pump_flow", "overflow, pump_flow, term")
    (made / "engineering" / "faults.csv").write_text(FAULT, "utf-8")
    for file, more in (("process.py", SEAL), ("engineering/parameters.csv", PARAMETERS.format(seep=seep))):
        (made / file).write_text((made / file).read_text("utf-8") + more, "utf-8")
    return made


@pytest.mark.slow
def test_a_content_that_is_gone_after_the_run_is_told_with_the_time(tmp_path: Path) -> None:
    (only,) = beyond(Bench(sealed(tmp_path, 0.02)))
    assert only.severity is Severity.ERROR and only.where.key == "seal_leak"
    assert "takes the model out of the physical world" in only.what
    after_s = float(only.what.partition("physical world ")[2].partition(" s")[0])
    assert after_s == pytest.approx(100 / (0.02 * 0.5), rel=0.05)
    assert "later than a rollout of" in only.what and "limits.csv" in only.remedy


def test_one_that_lasts_for_weeks_is_not(tmp_path: Path) -> None:
    assert list(beyond(Bench(sealed(tmp_path, 0.0005)))) == []


@pytest.mark.parametrize("folder", [TANKS, INSTALLED / "cstr", INSTALLED / "mixing_module"], ids=lambda f: f.name)
def test_the_plants_that_ship_stay_in_the_physical_world(folder: Path) -> None:
    assert list(beyond(Bench(folder))) == []
