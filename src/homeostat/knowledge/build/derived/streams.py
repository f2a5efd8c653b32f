"""What follows from a row of a stream: what the parts do that it leaves and enters, and their flows."""

from collections.abc import Mapping

from homeostat.knowledge.build.derived.draft import Draft, Line

PRODUCT = "Product"


def add_streams(draft: Draft) -> None:
    """Add an operator for each part that a stream leaves or enters, and the flows of both."""
    lines = draft.lines("streams")
    after: dict[str, str] = {}
    operators = stated_operators(draft)
    for line in lines:
        line.cells["kind"] = line["kind"] or PRODUCT
        line.cells["label"] = line["label"] or line["stream"].replace("_", " ").capitalize()
        if line["kind"] == PRODUCT and line["target"]:
            after.setdefault(line["source"], line["target"])
    for line in lines:
        for part, direction in ((line["source"], "output"), (line["target"], "input")):
            if part:
                operator, to = (operator_of(each, operators) for each in (part, after.get(part, "")))
                _add(draft, line, part, operator, to)
                own = {"operator": operator, "direction": direction, "flow": line["stream"]}
                shared = {column: line[column] for column in ("kind", "tag", "label")}
                draft.add("flows", line.follows, own | shared)


def stated_operators(draft: Draft) -> dict[str, str]:
    """Part of the plant -> the first operator that the tables state of it, and that is none of a loop."""
    of_loops, found = draft.column("loops", "operator"), dict[str, str]()
    for line in draft.lines("operators"):
        if not line.origin.generated and line["id"] not in of_loops:
            found.setdefault(line["resource"], line["id"])
    return found


def operator_of(part: str, operators: Mapping[str, str]) -> str:
    """Name of what a part of the plant does; empty for no part. ``operators``: as :func:`stated_operators`."""
    return operators.get(part, f"PO_{part}") if part else ""


def _add(draft: Draft, line: Line, part: str, operator: str, after: str) -> None:
    place = draft.find("equipment", part)
    label = place["label"] if place is not None else part
    own = {"id": operator, "resource": part, "successor": after, "label": label}
    draft.add("operators", line.follows, own)
