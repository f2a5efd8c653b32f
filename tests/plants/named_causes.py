"""A copy of the reactor whose tables give names to disturbances that the process model has no equation of."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from tests.plants.copies import Copy

FAULTS, SYMPTOMS = "engineering/faults.csv", "engineering/symptom_faults.csv"
CAUSES: Final = {
    "coolant_pipe_scaled": ("V2", "L/s", -0.125, -0.375, -0.01, "unknown_V2_F3_max", "S-COOLANT-OFF"),
    "thermowell_loose": ("TT1", "K", 5.0, 0.0, 15.0, "T1_reads_low", "S-COLD"),
    "lagging_lost": ("R1", "W/K", 150.0, 10.0, 375.0, "unknown_heat_R1_UA_ambient", "S-HEAT-LOW"),
    "impeller_worn": ("P1", "L/s", -0.016, -0.04, -0.002, "unknown_P1_K_P1", "S-OUTLET-LOW"),
    "heater_on": ("R1", "kW", 2.0, 0.5, 10.0, "unknown_heat_R1", "S-HEAT-HIGH"),
    "valve_offset": ("V2", "1", -0.2, -0.6, 0.0, "unknown_position_V2", "S-V2-OFF"),
    "thermometer_stuck": ("TT1", "1", 1.0, 0.5, 1.0, "T1_frozen", "S-COLD"),
    "weir_leaks_more": ("R1", "L/s/s", -1e-6, -1e-5, -1e-7, "unknown_mass_R1_growing", "S-MASS-LOSS"),
}
"""Name -> component, unit, nominal, low and high severity, generated mode, symptom."""


def named(copy: Copy, *names: str) -> Copy:
    """``copy`` with rows of these :data:`CAUSES`."""
    rows, seen = copy.text(FAULTS), copy.text(SYMPTOMS)
    for name in names:
        component, unit, nominal, low, high, mode, symptom = CAUSES[name]
        rows += f"{name},{name},{component},{unit},{nominal},{low},{high},0.11,,,{mode}\n"
        seen += f"{symptom},{name}\n"
    (copy.folder / FAULTS).write_text(rows, encoding="utf-8")
    (copy.folder / SYMPTOMS).write_text(seen, encoding="utf-8")
    return copy


def copied(where: Path, *names: str) -> Copy:
    """A copy of the reactor in ``where`` with these causes."""
    return named(Copy.of("cstr", where), *names)
