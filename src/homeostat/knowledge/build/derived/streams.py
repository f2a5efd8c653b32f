"""What follows from a row of a stream: what the parts do that it leaves and enters, and their flows."""

from homeostat.knowledge.build.derived.draft import Draft, Line

PRODUCT = "Product"


def add_streams(draft: Draft) -> None:
    """Add an operator for each part that a stream leaves or enters, and the flows of both."""
    lines = draft.lines("streams")
    after: dict[str, str] = {}
    for line in lines:
        line.cells["kind"] = line["kind"] or PRODUCT
        line.cells["label"] = line["label"] or line["stream"].replace("_", " ").capitalize()
        if line["kind"] == PRODUCT and line["target"]:
            after.setdefault(line["source"], line["target"])
    for line in lines:
        for part, direction in ((line["source"], "output"), (line["target"], "input")):
            if part:
                _add(draft, line, part, after.get(part, ""))
                own = {"operator": operator_of(part), "direction": direction, "flow": line["stream"]}
                shared = {column: line[column] for column in ("kind", "tag", "label")}
                draft.add("flows", line.follows, own | shared)


def operator_of(part: str) -> str:
    """Name of what a part of the plant does."""
    return f"PO_{part}"


def _add(draft: Draft, line: Line, part: str, after: str) -> None:
    place = draft.find("equipment", part)
    label = place["label"] if place is not None else part
    successor = operator_of(after) if after else ""
    draft.add(
        "operators",
        line.follows,
        {"id": operator_of(part), "resource": part, "successor": successor, "label": label},
    )
