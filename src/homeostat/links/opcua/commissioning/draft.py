"""A draft of a mapping, from what a server has: a person checks every line of it before anything is written."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from homeostat.domain.plant.rules import GuardRules
from homeostat.links.opcua.commissioning.browse import ServerNode

_GUARD: Final = ("counter", "time", "heartbeat", "lease", "permit", "hold", "alarm", "acknowledged")
_BLOCK: Final = {"feedback": "working", "mode": "mode", "requested": "requested", "apply": "apply"}
"""What is said of writing a tag -> last part of the node's name."""
MOST_LEFT: Final = 200
"""Most nodes without a tag that are listed."""
UNCOUNTED: Final = (
    "# STATE guard.counter OR guard.time. No node was found that counts the plant's samples or has its time. Without",
    "# one, a sample is taken once a tick by our clock, a plant's side that stands is noticed by readings alone, and",
    "# no sample that is lost is noticed.",
)
"""Said where nothing in a draft tells when a sample is new."""


@dataclass(frozen=True, slots=True)
class Draft:
    """A drafted mapping."""

    text: str
    """The file."""
    tags: int
    """How many tags have a node."""
    missing: tuple[str, ...]
    """Tags of the plant that have none."""


def draft(url: str, nodes: Sequence[ServerNode], rules: GuardRules | None, namespaces: Sequence[str] = ()) -> Draft:
    """A mapping of the plant behind ``rules`` to ``nodes`` of the server at ``url``, which has these ``namespaces``.

    Without a plant, every number is a tag of its own name. What nothing was found for is said in comments.
    """
    by_name = {_plain(_last(node)): node for node in nodes}
    by_path = {_plain(_path(node)): node for node in nodes}
    names = list(rules.tags) if rules else [_last(node) for node in nodes if node.kind not in ("", "String")]
    found = {tag: node for tag in names if (node := by_path.get(_plain(tag)) or by_name.get(_plain(tag)))}
    lines = [
        f"# Drafted from {url}. Check every line before anything is written: 'homeostat link check' helps.",
        "",
        "[connection]",
        f"url = {json.dumps(url)}",
    ]
    numbers = sorted({int(number[1]) for node in nodes if (number := re.match(r"ns=(\d+);", node.address))})
    if said := [f"{number} = {json.dumps(namespaces[number])}" for number in numbers if 0 < number < len(namespaces)]:
        lines += ["", "[connection.namespaces]", *said]
    used = {node.address for node in found.values()}
    guard = {word: by_path.get(f"guard{word}") or by_path.get(f"plant{word}") for word in _GUARD}
    if any(guard.values()):
        lines += ["", "[guard]", *(f"{word} = {json.dumps(node.address)}" for word, node in guard.items() if node)]
        used |= {node.address for node in guard.values() if node}
    if not (guard["counter"] or guard["time"]):
        lines += ["", *UNCOUNTED]
    for tag, node in found.items():
        lines += ["", *_tag(tag, node, rules, by_path, used)]
    missing = tuple(tag for tag in names if tag not in found)
    lines += [f"\n# No node was found for {tag!r}." for tag in missing]
    left = [node for node in nodes if node.address not in used]
    lines += ["", *(f"# No tag has the node {node.address} ({node.kind or 'nothing'})." for node in left[:MOST_LEFT])]
    return Draft("\n".join(lines).rstrip() + "\n", len(found), missing)


def _tag(
    tag: str, node: ServerNode, rules: GuardRules | None, by_path: Mapping[str, ServerNode], used: set[str]
) -> Iterator[str]:
    """The lines of one tag; addresses that they name are added to ``used``."""
    yield f"[tags.{json.dumps(tag)}]"
    yield f"node = {json.dumps(node.address)}"
    if node.unit:
        yield f"unit = {json.dumps(node.unit)}"
        if rules and (unit := rules.tags[tag].unit) != node.unit:
            yield f"# STATE scale AND offset: the tag is in {unit}, and nothing is attached without them."
    rule = rules.writables.get(tag) if rules else None
    target = by_path.get(_plain(f"{tag}target")) or (node if node.writable else None)
    if rule is None or target is None:
        return
    yield f"[tags.{json.dumps(tag)}.write]"
    said = {"node": target}
    said |= {key: part for key, word in _BLOCK.items() if (part := by_path.get(_plain(tag) + word))}
    if rule.ramped_by.value == "plant" and (rate := by_path.get(f"{_plain(tag)}rate")):
        said["rate"] = rate
    yield from (f"{key} = {json.dumps(part.address)}" for key, part in said.items())
    yield f"kind = {json.dumps(target.kind or 'Double')}"
    yield f"ramp = {json.dumps(rule.ramped_by.value)}"
    used |= {part.address for part in said.values()}


def _path(node: ServerNode) -> str:
    """The readable part of a node's address; its browse name where that is a number."""
    found = re.search(r"(?:^|;)s=(.*)$", node.address)
    return found[1] if found else node.name


def _last(node: ServerNode) -> str:
    return node.name or _path(node)


def _plain(name: str) -> str:
    """``name`` as it is compared: letters and figures alone."""
    return re.sub(r"[^a-z0-9]", "", name.lower())
