"""What the plant does (VDI 3682), how noisy its sensors are, and what engineering says about its states."""

from collections.abc import Mapping

from pyoxigraph import NamedNode

from homeostat.domain.plant.flowsheet import Flow, FlowKind, Flowsheet, ProcessOperator
from homeostat.knowledge.description.entry import Entry, entries, unique
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.store.store import GraphStore


def flowsheet(store: GraphStore, system: NamedNode) -> Flowsheet:
    """The process operators and what flows between them; GraphError names the first thing that is wrong."""
    rows = entries(store, "plant_flows", "flow", system)
    flows: dict[str, Flow] = {}
    for row in rows:
        flow = _flow(row)
        if flows.setdefault(row.name, flow) != flow:
            raise GraphError(Code.DUPLICATE_ID, row.thing, "is stated more than once; kind, tag or label differs")
    operators = tuple(
        ProcessOperator(
            name=entry.name,
            label=entry.words("label"),
            resource=entry.reference("resource", Code.UNKNOWN_COMPONENT),
            inputs=_flows_of(entry.name, "input", rows),
            outputs=_flows_of(entry.name, "output", rows),
        )
        for entry in unique(entries(store, "plant_operators", "operator", system))
    )
    return Flowsheet(operators, tuple(flows.values()))


def sensor_noise(store: GraphStore, system: NamedNode) -> Mapping[str, tuple[float, str]]:
    """Tag -> standard deviation of its sensor's noise, and the unit that it is in: ``1`` where it is relative."""
    rows = unique(entries(store, "plant_sensor_noise", "noise of tag", system))
    return {row.name: (row.number("noise"), row.text("unit")) for row in rows}


def remarks(store: GraphStore, system: NamedNode) -> Mapping[str, str]:
    """State or transition -> what engineering says about it."""
    return {row.name: row.words("comment") for row in entries(store, "plant_remarks", "remark on", system)}


def _flow(row: Entry) -> Flow:
    tag = row.optional_reference("tag", Code.UNKNOWN_TAG)
    return Flow(row.name, row.words("label"), row.word("kind", FlowKind), tag)


def _flows_of(operator: str, direction: str, rows: tuple[Entry, ...]) -> tuple[str, ...]:
    at = [row for row in rows if row.text("operator_name") == operator and row.text("direction") == direction]
    return tuple(dict.fromkeys(row.name for row in at))
