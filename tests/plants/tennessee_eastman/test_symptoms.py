"""What a fault of the plant's tables shows, as one run with nobody has it, indicates that fault."""

from __future__ import annotations

import functools

import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.symptoms import first_symptoms
from homeostat.plants.files.folder import INSTALLED


@functools.cache
def bench() -> Bench:
    """The plant on the test bench."""
    return Bench(INSTALLED / "tennessee_eastman")


def shown(fault: str, severity: float) -> list[str]:
    """Symptoms that the plant by its best estimates shows after ``fault`` has begun, the first one first."""
    course = bench().faulty(bench().plant.description.fault(fault), severity, noise=1.0)
    found = first_symptoms(bench(), course, bench().onset_s)
    return [name for _, name in sorted((s.confirmed_s, r.name) for r, s in found.items() if s.confirmed_s is not None)]


def indicating(fault: str) -> set[str]:
    """Symptoms that indicate ``fault``."""
    return {rule.name for rule in bench().plant.description.symptom_rules if fault in rule.faults}


@pytest.mark.parametrize(
    ("fault", "severity"),
    [("A_poor", 0.03), ("B_rich", 0.01), ("A_lost", 1.0), ("C_header", 0.2), ("S_water_hot", 20.0)],
)
def test_what_a_fault_shows_first_indicates_it(fault: str, severity: float) -> None:
    assert shown(fault, severity)[0] in indicating(fault)


@pytest.mark.parametrize(("fault", "severity"), [("A_poor", 0.06), ("B_rich", 0.01)])
def test_what_indicates_another_composition_of_the_a_and_c_feed_is_seen_where_that_is_large(
    fault: str, severity: float
) -> None:
    """Its flow is what its valve passes, whatever is in it: it stays at its setpoint for long."""
    assert indicating(fault) <= set(shown(fault, severity)) and "S-FC4-OFF" not in indicating(fault)
