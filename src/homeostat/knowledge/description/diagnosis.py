"""What can go wrong, what monitoring computes, and when that counts as a symptom."""

from collections.abc import Mapping

from pyoxigraph import NamedNode

from homeostat.domain.diagnosis import Direction, FaultMode, Feature, SymptomRule
from homeostat.domain.plant.tag import Tag
from homeostat.knowledge.description.entry import entries, unique
from homeostat.knowledge.store.error import Code
from homeostat.knowledge.store.store import GraphStore


def faults(store: GraphStore, system: NamedNode) -> tuple[FaultMode, ...]:
    """The fault modes, sorted by name."""
    return tuple(
        FaultMode(
            name=entry.name,
            label=entry.words("label"),
            component=entry.reference("component", Code.UNKNOWN_COMPONENT),
            disables=entry.optional_reference("disabled", Code.UNKNOWN_COMPONENT),
            severity_range=entry.range("low", "high"),
            severity_nominal=entry.number("nominal"),
            severity_unit=entry.text("unit"),
            prior=entry.number("prior"),
            description=entry.words("description"),
            mode=entry.optional_text("mode"),
        )
        for entry in unique(entries(store, "plant_faults", "fault", system))
    )


def features(store: GraphStore, system: NamedNode, tags: Mapping[str, Tag]) -> tuple[Feature, ...]:
    """The features, sorted by name; expressions are read over ``tags``."""
    return tuple(
        Feature(
            name=entry.name,
            expression=entry.expression("expression", tags),
            accumulation=entry.optional_expression("accumulation", tags),
            window_s=entry.number("window"),
            filter_s=entry.number("filter"),
            unit=entry.text("unit"),
            component=entry.reference("component", Code.UNKNOWN_COMPONENT),
        )
        for entry in unique(entries(store, "plant_features", "feature", system))
    )


def symptom_rules(store: GraphStore, system: NamedNode) -> tuple[SymptomRule, ...]:
    """The symptom rules with the faults that each indicates, sorted by name."""
    pairs = [
        (entry.name, entry.reference("fault", Code.UNKNOWN_FAULT))
        for entry in entries(store, "plant_symptom_faults", "symptom", system)
    ]
    return tuple(
        SymptomRule(
            name=entry.name,
            feature=entry.reference("feature", Code.UNKNOWN_FEATURE),
            direction=entry.word("direction", Direction),
            sigma=entry.number("sigma"),
            threshold=entry.number("threshold"),
            on_delay_s=entry.number("on_delay"),
            faults=tuple(fault for symptom, fault in pairs if symptom == entry.name),
            description=entry.words("description"),
        )
        for entry in unique(entries(store, "plant_symptoms", "symptom", system))
    )
