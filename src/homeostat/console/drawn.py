"""What of a plant does not change during a run: flowsheet, tags with limits, panels; as values that the page draws."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from homeostat.console.opened import KnownPlant
from homeostat.console.readings import Readings
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.flowsheet import Flowsheet
from homeostat.domain.plant.limits import LimitKind
from homeostat.plants.page.figure import Direction, Line, Shape, arranged
from homeostat.plants.page.flowsheet import flowsheet_figure
from homeostat.plants.page.layers import Corrections
from homeostat.record.figure.limits import thresholds
from homeostat.record.figure.panel import LinePanel
from homeostat.stl.formula import FormulaError
from homeostat.stl.tree import Or

_HELD_TICKS = 10
"""For so many ticks a reading that was beyond a hard limit counts as being there: noise takes it in and out."""
_ROOM = "  000.000 mmm"
"""Text as wide as a reading with its unit, for which a line leaves room."""


@dataclass(frozen=True, slots=True)
class DrawnLimit:
    """A value that a tag is compared with."""

    name: str
    """Name of the limit or criterion."""
    text: str
    """What it protects."""
    value: float
    """The value, in the tag's unit."""
    upper: bool
    """Whether the tag must stay below it."""
    hard: bool
    """Whether violating it is forbidden."""


@dataclass(frozen=True, slots=True)
class DrawnTag:
    """A tag, as an indicator needs it."""

    name: str
    """Its name."""
    text: str
    """What it is."""
    role: str
    """What it is to the control system."""
    unit: str
    """Its unit; ``1`` for a fraction."""
    low: float
    """Lower end of its range."""
    high: float
    """Upper end of its range."""
    usual: tuple[float, float] | None
    """Between what 98 % of its readings lay before anything was seen; None where that is not known."""
    stale_s: float | None
    """Oldest reading that is still the present one [s]; None where that is not stated."""
    limits: tuple[DrawnLimit, ...]
    """What it is compared with."""


@dataclass(frozen=True, slots=True)
class DrawnLine:
    """One line of a box."""

    text: str
    """The text."""
    bubble: str
    """What stands before it in a bubble."""
    title: bool
    """Whether it is in large letters."""
    tag: str
    """Tag whose reading stands behind it; empty for none."""


@dataclass(frozen=True, slots=True)
class DrawnBox:
    """A box of the flowsheet; sizes and places in px."""

    x: float
    y: float
    width: float
    height: float
    kind: str
    icon: str
    tip: str
    lines: tuple[DrawnLine, ...]


@dataclass(frozen=True, slots=True)
class DrawnArrow:
    """An arrow of the flowsheet, through its points [px]."""

    points: tuple[tuple[float, float], ...]
    kind: str
    tip: str


@dataclass(frozen=True, slots=True)
class DrawnSheet:
    """The flowsheet."""

    width: float
    height: float
    boxes: tuple[DrawnBox, ...]
    arrows: tuple[DrawnArrow, ...]


@dataclass(frozen=True, slots=True)
class DrawnPanel:
    """Tags that are drawn together."""

    title: str
    unit: str
    tags: tuple[str, ...]


def drawn_tags(plant: KnownPlant, readings: Readings | None, healthy: slice) -> tuple[DrawnTag, ...]:
    """Every tag; what is usual is taken from the ``healthy`` part of the readings."""
    known = plant.description
    made = []
    for tag in known.tags:
        usual = None if readings is None or tag.name not in readings.signals else readings.usual(tag.name, healthy)
        rule = known.qualities.get(tag.name)
        named = tag.name, tag.description, tag.role.value, tag.unit, tag.range.low, tag.range.high
        made.append(DrawnTag(*named, usual, None if rule is None else rule.stale_s, _limits(tag.name, plant)))
    return tuple(made)


def _limits(tag: str, plant: KnownPlant) -> tuple[DrawnLimit, ...]:
    """What a tag alone is compared with at every moment; what is one way of several only where a figure shows it."""
    panels = [p for p in plant.panels if isinstance(p, LinePanel) and tag in p.tags]
    asked = {name for panel in panels for name in panel.limits}
    found = []
    for limit in plant.description.limits.limits:
        if limit.kind is LimitKind.PERMISSIVE or (isinstance(limit.formula.root, Or) and limit.name not in asked):
            continue
        for threshold in thresholds(limit.formula, (tag,)):
            found.append(DrawnLimit(limit.name, limit.description, threshold.value, threshold.upper, limit.hard))
    return tuple(found)


def violated(values: Mapping[str, float], plant: PlantDescription) -> tuple[str, ...]:
    """Names of the limits and envelopes that ``values`` violate; what they leave open is not violated."""
    judged = (limit for limit in plant.limits.limits if limit.kind is not LimitKind.PERMISSIVE)
    return tuple(limit.name for limit in judged if limit.formula.margin_at(values) < 0.0)


def lately_violated(
    readings: Readings | None, sampled_s: float, plant: PlantDescription, started_s: float | None
) -> tuple[str, ...]:
    """Names of the hard limits that the readings up to ``sampled_s`` [s] violate, or did within the last ticks.

    What goes in and out of a limit with the noise is beyond it. Nothing counts before ``started_s``, the end of
    start-up [s]; None where that is not over.
    """
    if readings is None or started_s is None:
        return ()
    part = readings.between(max(sampled_s - held_s(plant), started_s), sampled_s)
    signals = {tag: values[part] for tag, values in readings.signals.items()}
    found = []
    for limit in plant.limits.hard:
        if part.start < part.stop and limit.formula.tags <= signals.keys():
            try:
                margins = limit.formula.margins({t: signals[t] for t in limit.formula.tags}, readings.dt_s)[0]
            except FormulaError:
                continue
            if (margins < 0.0).any():
                found.append(limit.name)
    return tuple(found)


def held_s(plant: PlantDescription) -> float:
    """How long a reading that was beyond a hard limit counts as being there [s]."""
    return _HELD_TICKS * plant.timing.tick_s


def drawn_panels(plant: KnownPlant) -> tuple[DrawnPanel, ...]:
    """What the plant's figures show."""
    return tuple(DrawnPanel(panel.title, panel.unit, panel.tags) for panel in plant.panels)


def drawn_sheet(plant: KnownPlant) -> DrawnSheet | None:
    """The flowsheet with its layout; None where it is not known."""
    if plant.flowsheet is None:
        return None
    return _sheet(plant.description, plant.flowsheet, plant.corrections)


def _sheet(plant: PlantDescription, flowsheet: Flowsheet, corrections: Corrections) -> DrawnSheet:
    shapes, arrows = flowsheet_figure(plant, flowsheet)
    tags = plant.tags_by_name
    shown = {name: list(_lines(shape, tags)) for name, shape in shapes.items()}
    roomy = {name: _roomy(shape, shown[name]) for name, shape in shapes.items()}
    layout = arranged(roomy, arrows, Direction.RIGHT, corrections)
    boxes = []
    for name, place in layout.places.items():
        shape = roomy[name]
        size = shape.width, shape.height
        boxes.append(DrawnBox(place.along, place.across, *size, shape.kind, shape.icon, shape.tip, tuple(shown[name])))
    ways = [DrawnArrow(layout.routes[a.source, a.target], a.kind, a.tip) for a in arrows if a.source != a.target]
    return DrawnSheet(layout.along, layout.across, tuple(boxes), tuple(ways))


def _lines(shape: Shape, tags: Mapping[str, object]) -> Iterator[DrawnLine]:
    """The lines of a box, each with the tag whose reading belongs behind it; none behind what a controller sets."""
    sets = False
    for line in shape.lines:
        sets = sets or line.text.startswith("sets ")
        name = line.text.partition(" [")[0]
        tag = name if name in tags and not (line.title or sets) else ""
        yield DrawnLine(tag or line.text, line.bubble, line.title, tag)


def _roomy(shape: Shape, lines: list[DrawnLine]) -> Shape:
    """The shape with room for readings."""
    texts = (Line(d.text + _ROOM if d.tag else d.text, d.bubble, d.title) for d in lines)
    return Shape(shape.kind, tuple(texts), shape.tip, shape.icon)
