"""The flowsheet: process operators and what flows between them (VDI 3682), instruments, and what controllers do."""

from collections import defaultdict
from collections.abc import Iterator
from typing import Final

from homeostat.domain.plant.description import ComponentKind, PlantDescription, Relation
from homeostat.domain.plant.flowsheet import Flow, FlowKind, Flowsheet, ProcessOperator
from homeostat.domain.plant.tag import Role
from homeostat.plants.described import DescribedPlant
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import SETTINGS
from homeostat.plants.page.figure import Arrow, Direction, Line, Shape, drawing, lines
from homeostat.plants.page.layers import Corrections
from homeostat.plants.page.markup import Markup
from homeostat.plants.settings.settings import DrawingTable
from homeostat.stl.spelling import near_matches

_ICONS: Final = {FlowKind.PRODUCT: "circle", FlowKind.ENERGY: "rhombus", FlowKind.INFORMATION: "hexagon"}


def flowsheet_drawing(plant: DescribedPlant) -> Markup:
    """The drawing."""
    sheet = plant.flowsheet
    shapes, arrows = flowsheet_figure(plant.description, sheet)
    described = (
        f"{len(sheet.operators)} process operators from left to right, with what flows between them, where it is "
        "measured, and by dashed arrows what controllers read and command. The tables below say the same."
    )
    words = f"Flowsheet of {plant.description.label}", described
    correct = corrections(plant.name, sheet, plant.settings.drawing)
    return drawing("flowsheet", words, shapes, arrows, Direction.RIGHT, correct)


def corrections(name: str, sheet: Flowsheet, drawn: DrawingTable) -> Corrections:
    """What the settings of the plant called ``name`` correct.

    PlantError where they name what is no process operator and does not flow.
    """
    boxes = {flow.name: f"flow {flow.name}" for flow in sheet.flows if flow.kind is not FlowKind.INFORMATION}
    boxes |= {operator.name: f"operator {operator.name}" for operator in sheet.operators}
    for box in (*drawn.later, *drawn.order):
        if box not in boxes:
            hint = near_matches(box, boxes)
            where = f"{name}/{SETTINGS}: drawing"
            raise PlantError(f"{where}: the flowsheet has no process operator or flow {box!r}{hint}")
    later = {boxes[box]: layers for box, layers in drawn.later.items()}
    return Corrections(later, tuple(boxes[box] for box in drawn.order))


def flowsheet_figure(plant: PlantDescription, sheet: Flowsheet) -> tuple[dict[str, Shape], list[Arrow]]:
    """Boxes and arrows of the drawing; what flows comes first, then what controllers read and command."""
    known = _Sheet(plant, sheet)
    shapes = {f"flow {flow.name}": known.flow(flow) for flow in known.streams.values()}
    shapes |= {f"operator {operator.name}": known.operator(operator) for operator in known.steps}
    shapes |= {f"operator {operator.name}": known.control(operator) for operator in known.controls}
    arrows = [arrow for kind in (FlowKind.PRODUCT, FlowKind.ENERGY) for arrow in known.flowing(kind)]
    for operator in known.controls:
        arrows += [*known.commanding(operator), *known.reading(operator)]
    return shapes, arrows


class _Sheet:
    """A flowsheet with the answers that drawing it needs."""

    def __init__(self, plant: PlantDescription, sheet: Flowsheet) -> None:
        self.plant = plant
        self.flows = {flow.name: flow for flow in sheet.flows}
        self.streams = {name: flow for name, flow in self.flows.items() if flow.kind is not FlowKind.INFORMATION}
        self.controls = [o for o in sheet.operators if not self.streams.keys() & {*o.inputs, *o.outputs}]
        self.steps = [o for o in sheet.operators if o not in self.controls]
        self.labels = {c.name: c.label for c in plant.components}
        self.signals = {s.tag.name: s for s in plant.signals}

    def flow(self, flow: Flow) -> Shape:
        """What flows, with the instrument that shows it."""
        title = flow.label or flow.name
        shown = (self._instrument(flow.tag),) if flow.tag in self.signals else ()
        kind = flow.kind.value.lower()
        return Shape(kind, (*lines(title, title=True, rows=2), *shown), f"{title} ({kind})", _ICONS[flow.kind])

    def operator(self, operator: ProcessOperator) -> Shape:
        """A step of the process, with the equipment that is its alone."""
        title, where = operator.label or operator.name, self.labels.get(operator.resource, "")
        parts = [Line(text, bubble=part) for part, text in self._equipment(operator)]
        shown = (*lines(title, title=True), *lines(operator.resource, rows=1), *parts)
        return Shape("operator", shown, f"{title}, carried out by {operator.resource}: {where}")

    def control(self, operator: ProcessOperator) -> Shape:
        """A step that handles information only: controllers, setpoints, what it reads elsewhere, and what it sets."""
        title = operator.label or operator.name
        read, written = self._tags(operator.inputs), self._tags(operator.outputs)
        loops = [loop for loop in self.plant.loops if loop.manipulated_variable in written]
        who = [Line(loop.setpoint, bubble=loop.controller) for loop in loops]
        told = [tag for tag in read if not self._shown_at(tag) and tag not in {loop.setpoint for loop in loops}]
        shown = (*lines(title, title=True), *(who or lines(operator.resource, rows=1)), *map(Line, told))
        commands = lines(f"sets {', '.join(written)}", rows=14) if written else ()
        return Shape("control", (*shown, *commands), f"{title}, carried out by {operator.resource}")

    def flowing(self, kind: FlowKind) -> Iterator[Arrow]:
        """What flows out of operators and into them: where it runs in a circle, what goes in leads back."""
        ends = [(f"operator {o.name}", f"flow {flow}", flow) for o in self.steps for flow in o.outputs]
        ends += [(f"flow {flow}", f"operator {o.name}", flow) for o in self.steps for flow in o.inputs]
        for source, target, flow in ends:
            if flow in self.streams and self.streams[flow].kind is kind:
                yield Arrow(source, target, kind.value.lower(), self.streams[flow].label or flow)

    def commanding(self, operator: ProcessOperator) -> Iterator[Arrow]:
        """What a controller commands, to the steps that have the actuators."""
        told: dict[str, list[str]] = defaultdict(list)
        for tag in self._tags(operator.outputs):
            for target in self._obeying(tag):
                told[target].append(tag)
        for target, tags in told.items():
            tip = f"{operator.label} commands {', '.join(tags)}"
            yield Arrow(f"operator {operator.name}", f"operator {target}", "information", tip)

    def reading(self, operator: ProcessOperator) -> Iterator[Arrow]:
        """What a controller reads, from where it is shown."""
        for tag in self._tags(operator.inputs):
            for place in self._shown_at(tag):
                yield Arrow(place, f"operator {operator.name}", "information", f"{operator.label} reads {tag}")

    def _tags(self, flows: tuple[str, ...]) -> list[str]:
        return [tag for flow in flows if (tag := self.flows[flow].tag) in self.signals and tag is not None]

    def _instrument(self, tag: str | None) -> Line:
        signal = self.signals[tag or ""]
        unit = "" if signal.tag.unit == "1" else f" [{signal.tag.unit}]"
        return Line(signal.tag.name + unit, bubble=signal.component)

    def _shown_at(self, tag: str) -> list[str]:
        """Boxes in which ``tag`` stands."""
        flows = [f"flow {flow.name}" for flow in self.streams.values() if flow.tag == tag]
        if flows or self.signals[tag].tag.role in (Role.SP, Role.MV):
            return flows
        sensor = self.signals[tag].component
        return [f"operator {o.name}" for o in self.steps if sensor in dict(self._equipment(o))]

    def _obeying(self, tag: str) -> tuple[str, ...]:
        """Steps whose equipment has the actuator that follows ``tag``."""
        actuator = self.signals[tag].component
        return tuple(o.name for o in self.steps if o.resource in self._around(actuator))

    def _equipment(self, operator: ProcessOperator) -> list[tuple[str, str]]:
        """Actuators of a step with their command, and instruments with their tag that stand at no flow.

        Nothing where several steps share the equipment: which is whose the tables do not say.
        """
        if sum(o.resource == operator.resource for o in self.steps) > 1:
            return []
        kinds = {c.name: c.kind for c in self.plant.components if operator.resource in self._around(c.name)}
        at_flows = {flow.tag for flow in self.streams.values()}
        driven = {s.component: s.tag.name for s in self.plant.signals if s.relation is Relation.DRIVES}
        found = [(name, driven.get(name, "")) for name, kind in kinds.items() if kind is ComponentKind.ACTUATOR]
        measured = [s for s in self.plant.signals if s.relation is Relation.MEASURES and s.component in kinds]
        return found + [(s.component, s.tag.name) for s in measured if s.tag.name not in at_flows]

    def _around(self, component: str) -> set[str]:
        """``component`` and everything that it is a part of."""
        above = {c.name: c.part_of for c in self.plant.components}
        found: set[str] = set()
        here: str | None = component
        while here is not None and here not in found:
            found.add(here)
            here = above.get(here)
        return found
