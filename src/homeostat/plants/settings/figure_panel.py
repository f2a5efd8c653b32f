"""Panels of a run's figure, as a plant's settings ask for them."""

from collections.abc import Iterable
from typing import Any

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.tag import Range
from homeostat.plants.error import PlantError
from homeostat.record.figure.panel import LinePanel, Panel, StripPanel
from homeostat.stl.spelling import near_matches
from homeostat.stl.units import in_unit


def read_panel(table: dict[str, Any], plant: PlantDescription) -> Panel:
    """One ``[[figure]]`` table of a plant's settings.

    Raises:
        PlantError: it names what the plant does not have, or what does not fit on one axis.
    """
    title, kind = table["title"], table.get("kind", "lines")
    names = tuple(table["tags"])
    _refuse_unknown(title, "tag", names, plant.tags_by_name)
    tags = [plant.tag(name) for name in names]
    unit = tags[0].unit
    for tag in tags:
        if tag.unit != unit:
            raise PlantError(
                f"figure {title!r} draws {tags[0].name!r} in {unit!r} and {tag.name!r} in {tag.unit!r} on one axis; "
                "give each unit its own [[figure]]"
            )
        if kind == "strips" and tag.range != tags[0].range:
            raise PlantError(
                f"figure {title!r} draws strips of {tags[0].name!r} and {tag.name!r}, whose ranges differ; "
                "give each range its own [[figure]]"
            )
    if kind == "strips":
        return StripPanel(title, unit, names, tags[0].range)
    if kind != "lines":
        raise PlantError(f"figure {title!r} is of the kind {kind!r}; there are 'lines' and 'strips'")
    limits, guards = tuple(table.get("limits", ())), tuple(table.get("guards", ()))
    _refuse_unknown(title, "limit", limits, (limit.name for limit in plant.limits.limits))
    _refuse_unknown(title, "transition", guards, (t.name for t in plant.machine.transitions))
    low, high = table["window"]
    whole = Range(min(t.range.low for t in tags), max(t.range.high for t in tags))
    if not (low >= whole.low - whole.span and high <= whole.high + whole.span and high - low >= whole.span / 1000.0):
        raise PlantError(
            f"figure {title!r} has the window {low:g} to {high:g}{in_unit(unit)}, in which its tags, {whole.low:g} to "
            f"{whole.high:g}{in_unit(unit)}, cannot be seen"
        )
    return LinePanel(title, unit, names, limits, guards, (low, high))


def _refuse_unknown(title: str, what: str, names: Iterable[str], known: Iterable[str]) -> None:
    have = set(known)
    for name in names:
        if name not in have:
            raise PlantError(
                f"figure {title!r} names {what} {name!r}, which the plant does not have{near_matches(name, have)}"
            )
