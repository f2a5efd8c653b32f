"""Whether a mapping and the tables of its plant say the same: asked before anything is signed, checked or attached."""

from __future__ import annotations

from homeostat.domain.plant.rules import GuardRules
from homeostat.links.errors import LinkError
from homeostat.links.opcua.mapping import LinkMapping, TagNodes


def refuse_disagreement(mapping: LinkMapping, rules: GuardRules) -> None:
    """LinkError with the first thing that ``mapping`` says otherwise than the plant's tables."""
    for text in disagreements(mapping, rules).values():
        raise LinkError(text)


def disagreements(mapping: LinkMapping, rules: GuardRules) -> dict[str, str]:
    """Tag -> in one sentence, what ``mapping`` says of it otherwise than the plant's tables, and the remedy."""
    found = ((tag, _disagreement(tag, nodes, rules)) for tag, nodes in mapping.tags.items())
    return {tag: text for tag, text in found if text}


def _disagreement(tag: str, nodes: TagNodes, rules: GuardRules) -> str:
    if tag not in rules.tags:
        return f"the mapping has a tag {tag!r} that the plant {rules.plant!r} has not; take it out"
    unit = rules.tags[tag].unit
    if nodes.unit not in (None, unit) and nodes.scale == 1.0 and nodes.offset == 0.0:
        return (
            f"{tag!r} is in {unit} and its node in {nodes.unit}, and nothing converts one into the other; state scale "
            f"and offset in the mapping, or unit = {unit!r} where the two are one unit"
        )
    if nodes.write is None:
        return ""
    rule = rules.writables.get(tag)
    if rule is None:
        return f"the mapping commands {tag!r}, which the plant's writables.csv does not; take it out"
    if nodes.write.ramp != rule.ramped_by.value:
        return (
            f"{tag!r} is ramped by the {nodes.write.ramp} in the mapping and by the {rule.ramped_by.value} in "
            "writables.csv; one of the two must do it, and both files must say which"
        )
    return ""
