"""A check of a mapping against plant and server: every tag in one line, and whether it is as it must be."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from asyncua.client.client import Client

from homeostat.domain.plant.rules import GuardRules
from homeostat.links.errors import LinkError
from homeostat.links.opcua.agreement import disagreements
from homeostat.links.opcua.commissioning.browse import ServerNode, described
from homeostat.links.opcua.connection.session import refuse_other_namespaces
from homeostat.links.opcua.mapping import LinkMapping, TagNodes, Writing
from homeostat.links.opcua.writing.kinds import FRACTIONS, NUMBERS, TEXTS, WHOLE, fits

_SHOWN = {
    "counter": NUMBERS, "time": NUMBERS, "permit": {"Boolean"}, "acknowledged": {"Boolean"}, "alarm": TEXTS,
    "heartbeat": NUMBERS, "lease": NUMBERS - {"Boolean"}, "hold": WHOLE.keys(),
    "rate": FRACTIONS, "mode": WHOLE.keys() - {"Boolean"}, "apply": WHOLE.keys(),
}  # fmt: skip
"""Entry of a mapping -> types that its node may have; a value is written as the type that the node has."""
UNCOUNTED = (
    "with no guard.time either a sample is taken once a tick by our clock, a plant's side that stands is noticed by "
    "readings alone, and no sample that is lost is noticed; state one of the two"
)
"""What is lost where nothing tells when a sample is new."""
SLACK = 1e-6
"""Share of a range by which two statements of it may differ [1]."""


@dataclass(frozen=True, slots=True)
class Checked:
    """One line of the check."""

    subject: str
    """A tag, or an entry of the handshake."""
    problems: tuple[str, ...]
    """What is wrong; empty where nothing is."""
    text: str
    """What it is where nothing is wrong."""

    def __str__(self) -> str:
        """The line."""
        return f"{self.subject}: {'; '.join(self.problems) or self.text}"


async def check(client: Client, mapping: LinkMapping, rules: GuardRules) -> list[Checked]:
    """Every line of the check of ``mapping`` against the plant behind ``rules`` and the server of ``client``."""
    wrong = disagreements(mapping, rules)
    handshake = {name: node for name, node in mapping.guard.model_dump().items() if node is not None}
    wanted = list(dict.fromkeys((*handshake.values(), *_addresses(mapping))))
    nodes = dict(zip(wanted, await described(client, wanted), strict=True))
    lines = [_of_namespaces(mapping, await client.get_namespace_array())]
    lines += [_of_handshake(name, nodes[node]) for name, node in handshake.items()]
    lines += [
        Checked(f"guard.{name}", (f"is not stated, so {lost}",), "")
        for name, lost in (
            ("counter", UNCOUNTED if "time" not in handshake else "samples are told apart by guard.time alone"),
            ("heartbeat", "the plant does not notice when we are dead"),
        )
        if name not in handshake
    ]
    lines += [_of_tag(tag, tag_nodes, nodes, rules, wrong.get(tag)) for tag, tag_nodes in mapping.tags.items()]
    watched = {name for limit in rules.limits.hard for name in limit.formula.tags if name in rules.tags}
    for tag in rules.tags:
        if tag not in mapping.tags:
            needed = tag in watched or tag in rules.writables
            why = "a hard limit reads it" if tag in watched else "the plant's tables command it"
            lines.append(Checked(tag, (f"has no node, and {why}",) if needed else (), "has no node, and is not read"))
    return lines


def _of_namespaces(mapping: LinkMapping, found: list[str]) -> Checked:
    """Whether addresses are still of the namespaces that whoever wrote them meant."""
    subject, stated = "connection.namespaces", mapping.connection.namespaces
    if not stated and mapping.numbers:
        there = ", ".join(f'{n} = "{found[n]}"' for n in sorted(mapping.numbers) if n < len(found))
        lost = "is not stated, so that nobody notices when the server numbers its namespaces anew"
        return Checked(subject, (f"{lost}; they are {there or 'none of those in the addresses'} now",), "")
    try:
        refuse_other_namespaces(stated, found)
    except LinkError as wrong:
        return Checked(subject, (str(wrong),), "")
    return Checked(subject, (), ", ".join(f"{number} is {uri}" for number, uri in stated.items()) or "none is used")


def _addresses(mapping: LinkMapping) -> Iterator[str]:
    for tag in mapping.tags.values():
        yield tag.node
        if tag.write is not None:
            parts = tag.write
            yield from filter(None, (parts.node, parts.rate, parts.feedback, parts.mode, parts.requested, parts.apply))


def _of_handshake(name: str, node: ServerNode) -> Checked:
    problems = [] if node.kind else [f"{node.address} holds nothing: {node.status or 'no value'}"]
    if node.kind and (wrong := _not_one_of(name, node)):
        problems.append(f"{node.address} {wrong}")
    if name in ("heartbeat", "lease", "hold", "alarm") and not node.writable:
        problems.append(f"{node.address} cannot be written by us")
    return Checked(f"guard.{name}", tuple(problems), f"{node.address} {node.kind}")


def _not_one_of(entry: str, node: ServerNode) -> str:
    """That ``node`` is none for ``entry`` of a mapping; empty where it is one."""
    allowed = _SHOWN[entry]
    return "" if node.kind in allowed else f"holds {node.kind or 'nothing'}, not {' or '.join(sorted(allowed))}"


def _of_tag(
    tag: str, nodes: TagNodes, found: Mapping[str, ServerNode], rules: GuardRules, disagreement: str | None
) -> Checked:
    """The line of ``tag``; ``disagreement``: what the mapping says of it otherwise than the plant's tables."""
    problems = [] if disagreement is None else [disagreement]
    if tag not in rules.tags:
        return Checked(tag, tuple(problems), "")
    of_plant, shown = rules.tags[tag], found[nodes.node]
    if shown.status:
        problems.append(f"{shown.address} is {shown.status}")
    elif shown.kind not in NUMBERS:
        problems.append(f"{shown.address} holds {shown.kind or 'nothing'}, not a number")
    unit = nodes.unit or of_plant.unit
    if shown.unit and shown.unit != unit:
        problems.append(f"{shown.address} is in {shown.unit}, and the mapping says {unit}")
    if shown.low is not None and shown.high is not None:
        low, high = sorted((nodes.of_node(shown.low), nodes.of_node(shown.high)))
        slack = SLACK * of_plant.range.span
        if abs(low - of_plant.range.low) > slack or abs(high - of_plant.range.high) > slack:
            problems.append(
                f"its range at the server is {low:g} to {high:g} {of_plant.unit}, and "
                f"{of_plant.range.low:g} to {of_plant.range.high:g} {of_plant.unit} in the plant's tables"
            )
    text = f"{shown.address} {shown.kind} {unit}"
    if nodes.write is not None:
        problems += _of_write(nodes.write, found)
        text += f", written at {nodes.write.node}"
    elif tag in rules.writables:
        problems.append("the plant's tables command it, and the mapping has no way to write it")
    return Checked(tag, tuple(problems), text)


def _of_write(write: Writing, found: Mapping[str, ServerNode]) -> Iterator[str]:
    """What is wrong with the nodes by which a tag is commanded."""
    for what, address in (("target", write.node), ("rate", write.rate), ("mode", write.mode), ("apply", write.apply)):
        if address is None:
            continue
        node = found[address]
        if not node.writable:
            yield f"its {what} {address} cannot be written by us"
        if what == "target" and node.kind != write.kind:
            yield f"its {what} {address} holds {node.kind or 'nothing'}, and the mapping says {write.kind}"
        elif what != "target" and (wrong := _not_one_of(what, node)):
            yield f"its {what} {address} {wrong}"
        if what == "mode" and node.kind in WHOLE and not fits(node.kind, write.automatic, write.remote):
            yield f"its mode {address} holds {node.kind}, which has no {write.automatic} or no {write.remote}"
    for what, address in (("feedback", write.feedback), ("requested", write.requested)):
        if address is not None and found[address].kind not in NUMBERS:
            yield f"its {what} {address} holds {found[address].kind or 'nothing'}, not a number"
