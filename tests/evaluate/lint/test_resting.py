"""A controller that an override keeps from acting is off its setpoint: the check says how to leave its symptom out."""

from __future__ import annotations

import shutil
from pathlib import Path

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.fault_free import healthy_symptoms

AIR = Path(__file__).parents[3] / "examples" / "instrument_air"
OMITTED = "symptoms,S-JIC1-OFF,"


def air(folder: Path, **shown: str) -> Bench:
    """The example with the symptom of the resting controller, and with one of its rows stated."""
    made = Path(shutil.copytree(AIR, folder / "air", ignore=shutil.ignore_patterns("plant.ttl", "__pycache__")))
    omitted = made / "engineering" / "omitted.csv"
    lines = omitted.read_text("utf-8").splitlines(keepends=True)
    assert any(line.startswith(OMITTED) for line in lines)
    omitted.write_text("".join(line for line in lines if not line.startswith(OMITTED)), "utf-8")
    for table, text in shown.items():
        (made / "engineering" / f"{table}.csv").write_text(text, "utf-8")
    return Bench(made)


def test_the_symptom_of_a_resting_controller_may_be_left_out(tmp_path: Path) -> None:
    bench = air(tmp_path, symptoms="id,threshold,sigma,on_delay_s\nS-JIC1-OFF,0.001,0.5,1\nS-FIC4-OFF,0.0001,0.5,1\n")
    told = {rule.what.split("'")[1]: rule.remedy for rule in healthy_symptoms(bench)}
    assert told["S-JIC1-OFF"].endswith(
        "or leave it out where JIC1 and PIC1 override each other and it rests by design (omitted.csv)"
    )
    assert "omitted.csv" not in told["S-FIC4-OFF"]


def test_the_example_leaves_it_out() -> None:
    assert "JIC1" not in {name for rule in Bench(AIR).plant.description.symptom_rules for name in rule.name.split("-")}
