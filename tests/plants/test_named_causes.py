"""A fault of the tables may be a generated fault mode: it needs no equation, and what does not fit is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.domain.diagnosis import EffectKind
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.plants.plant import load_plant
from tests.plants.copies import Copy
from tests.plants.named_causes import CAUSES, FAULTS, copied


def test_a_row_with_a_mode_is_a_fault_that_acts_as_that_mode(tmp_path: Path) -> None:
    plant = copied(tmp_path, *CAUSES).load()
    for name, (component, unit, nominal, low, high, mode, symptom) in CAUSES.items():
        fault, generated = plant.description.fault(name), plant.description.fault_mode(mode)
        assert fault.effect == generated.effect and fault.effect is not None
        assert (fault.component, fault.severity_unit, fault.severity_nominal) == (component, unit, nominal)
        assert (fault.severity_range.low, fault.severity_range.high) == (low, high)
        assert fault.listed and not generated.listed and not fault.unknown
        rule = next(r for r in plant.description.symptom_rules if r.name == symptom)
        assert name in rule.faults
    assert set(plant.model.faults) == {f.name for f in plant.description.faults if f.mode is None}


def test_tables_without_the_column_are_as_they_were(tmp_path: Path) -> None:
    copy = Copy.of("cstr", tmp_path)
    lines = [line.rpartition(",")[0] for line in copy.text(FAULTS).splitlines()]
    (copy.folder / FAULTS).write_text("\n".join(lines) + "\n")
    plant, shipped = copy.load(), load_plant("cstr")
    assert plant.description.faults == shipped.description.faults
    assert plant.description.generated == shipped.description.generated


@pytest.mark.parametrize(
    ("old", "new", "code", "told"),
    [
        ("unknown_V2_F3_max", "unknown_V2_F3_mix", Code.UNKNOWN_FAULT, "unknown_V2_F3_max"),
        ("unknown_V2_F3_max", "F3_noisy", Code.UNKNOWN_FAULT, "nothing simulates"),
        ("unknown_V2_F3_max", "T1_swings", Code.UNKNOWN_FAULT, "a table states no period"),
        ("unknown_V2_F3_max", "fouling", Code.UNKNOWN_FAULT, "there is no generated mode"),
        (",L/s,-0.125", ",L/min,-0.125", Code.BAD_WORD, "'L/s'"),
        ("-0.375", "-0.5", Code.SEVERITY_OUTSIDE_RANGE, "-0.375 to 0.375 L/s"),
        ("coolant_pipe_scaled,c", "fouling,c", Code.DUPLICATE_ID, "fouling"),
        (",V2,L/s", ",V99,L/s", Code.UNKNOWN_COMPONENT, "V99"),
    ],
)
def test_what_does_not_fit_is_one_line(tmp_path: Path, old: str, new: str, code: Code, told: str) -> None:
    copy = copied(tmp_path, "coolant_pipe_scaled")
    copy.replace(FAULTS, old, new)
    with pytest.raises(GraphError) as caught:
        copy.load()
    assert caught.value.code is code and told in str(caught.value) and "\n" not in str(caught.value)


def test_a_fault_with_an_equation_is_no_generated_mode(tmp_path: Path) -> None:
    copy = Copy.of("cstr", tmp_path)
    lines = copy.text(FAULTS).splitlines()
    k = next(k for k, line in enumerate(lines) if line.startswith("leak,"))
    lines[k] += "unknown_mass_R1"
    (copy.folder / FAULTS).write_text("\n".join(lines) + "\n")
    with pytest.raises(GraphError, match="equation of the process model"):
        copy.load()


def test_every_kind_of_effect_but_noise_can_get_a_name(tmp_path: Path) -> None:
    plant = copied(tmp_path, *CAUSES).load()
    kinds = {f.effect.kind for f in plant.description.faults if f.effect is not None}
    assert kinds == {EffectKind.PARAMETER, EffectKind.BALANCE, EffectKind.POSITION, EffectKind.FROZEN}
