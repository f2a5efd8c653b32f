"""What can go wrong and how it shows: tables of the page."""

from homeostat.domain.diagnosis import Direction, FaultMode, Feature, SymptomRule
from homeostat.domain.plant.description import PlantDescription
from homeostat.plants.page.markup import Markup
from homeostat.plants.page.tables import NOTHING, code, joined, number, quantity, span, table

_SIDES = {Direction.HIGH: "too high", Direction.LOW: "too low", Direction.BOTH: "too high or too low"}


def faults(plant: PlantDescription) -> Markup:
    """Every fault of the tables."""
    columns = ("Fault", "What it is", "Part", "Size", "Usual size", "Relative frequency", "Shows as", "Disables")
    rows = [
        (
            fault.name,
            [fault.label, fault.description],
            fault.component,
            span(fault.severity_range.low, fault.severity_range.high, fault.severity_unit),
            quantity(fault.severity_nominal, fault.severity_unit),
            number(fault.prior),
            _symptoms(fault, plant),
            fault.disables or NOTHING,
        )
        for fault in plant.faults
    ]
    note = (
        "Transmitters that are wrong, and disturbances that no table names, are looked for as well; they follow from "
        "tags and settings."
    )
    return table("faults", "Faults", columns, rows, note)


def symptoms(plant: PlantDescription) -> Markup:
    """Every symptom with the feature that it is seen in."""
    features = {feature.name: feature for feature in plant.features}
    columns = ("Symptom", "What is seen", "Feature", "Counts from", "After", "Indicates")
    rows = [
        (
            rule.name,
            rule.description or NOTHING,
            _feature(features[rule.feature]) if rule.feature in features else rule.feature,
            _threshold(rule, features[rule.feature].unit if rule.feature in features else ""),
            f"{number(rule.on_delay_s)} s",
            joined(rule.faults),
        )
        for rule in plant.symptom_rules
    ]
    note = "A feature is compared with what it was in fault-free runs; deviations count in standard deviations (sd)."
    return table("symptoms", "Symptoms", columns, rows, note)


def _symptoms(fault: FaultMode, plant: PlantDescription) -> str:
    return joined(rule.name for rule in plant.symptom_rules if fault.name in rule.faults)


def _feature(feature: Feature) -> list[str]:
    text = feature.expression.text
    if feature.accumulation is not None:
        text = f"change of {feature.accumulation.text} in {number(feature.window_s)} s, less {text} over this time"
    return [feature.name, code(text)]


def _threshold(rule: SymptomRule, unit: str) -> list[str]:
    least = f"at least {quantity(rule.threshold, unit)}"
    return [_SIDES[rule.direction], f"{number(rule.sigma)} sd", least]
