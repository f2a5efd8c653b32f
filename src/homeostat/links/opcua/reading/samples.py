"""From what nodes hold to a sample of the plant: units, quality with its reason, age, and what the plant works with."""

import math
from collections.abc import Mapping
from typing import Final

from homeostat.domain.plant.rules import GuardRules
from homeostat.links.opcua.connection.board import NodeReading
from homeostat.links.opcua.connection.session import status_name
from homeostat.links.opcua.mapping import LinkMapping, TagNodes
from homeostat.links.opcua.reading.node_sample import NodeSample

_SEVERITY_SHIFT: Final = 30
"""The two highest bits of a status are its severity."""


class Samples:
    """Makes samples of the tags that a mapping has."""

    def __init__(self, mapping: LinkMapping, rules: GuardRules, pace: float) -> None:
        """``pace``: process seconds per wall-clock second."""
        self._mapping, self._pace = mapping, pace
        self._automatic = {tag for tag, rule in rules.writables.items() if rule.automatic}

    def sample(self, at_s: float, readings: Mapping[str, NodeReading], now_s: float) -> NodeSample:
        """The sample at process time ``at_s`` [s]; ``now_s``: our monotonic clock [s]."""
        values: dict[str, float] = {}
        bad, uncertain = set(), set()
        reasons: dict[str, str] = {}
        taken_s: dict[str, float] = {}
        accepted: dict[str, float | None] = {}
        for tag, nodes in self._mapping.tags.items():
            reading = readings.get(nodes.node)
            values[tag], quality, reason = _judged(nodes, reading)
            if reason:
                reasons[tag] = reason
            if quality == 2:
                bad.add(tag)
            elif quality == 1:
                uncertain.add(tag)
            if reading is not None and nodes.stale_s is not None:
                age_s = (now_s - reading.changed_s) * self._pace
                if age_s > nodes.stale_s:
                    taken_s[tag] = at_s - age_s
            if nodes.write is not None:
                self._accept(tag, nodes, readings, values, accepted)
        bad -= {tag for tag in bad if accepted.get(tag, 0.0) is None}
        return NodeSample(
            at_s,
            values,
            frozenset(bad),
            frozenset(uncertain),
            reasons,
            taken_s,
            accepted=accepted,
            readings=readings,
        )

    def _accept(
        self,
        tag: str,
        nodes: TagNodes,
        readings: Mapping[str, NodeReading],
        values: dict[str, float],
        accepted: dict[str, float | None],
    ) -> None:
        """Take note of the target that the plant works with for ``tag``; of nothing where it does not say so."""
        assert nodes.write is not None
        write = nodes.write
        if write.mode is not None and tag in self._automatic:
            mode = readings.get(write.mode)
            if mode is None or mode.status >> _SEVERITY_SHIFT == 2 or not isinstance(mode.value, int):
                return
            if mode.value == write.automatic:
                values[tag], accepted[tag] = math.nan, None
                return
        shown = readings.get(write.feedback or write.node)
        if shown is not None and shown.status >> _SEVERITY_SHIFT == 0 and isinstance(shown.value, float | int):
            accepted[tag] = nodes.of_node(float(shown.value))


def _judged(nodes: TagNodes, reading: NodeReading | None) -> tuple[float, int, str]:
    """Value in the tag's unit, severity (0 good, 1 uncertain, 2 bad), and why it is not good.

    No number (NaN) is what a manual output on automatic has; whether another reading may be that, the guard knows.
    """
    if reading is None:
        return math.nan, 2, "the server has not shown its node"
    severity = reading.status >> _SEVERITY_SHIFT
    if isinstance(reading.value, str) or reading.value is None:
        what = "nothing" if reading.value is None else f"a text, {reading.value!r:.40}"
        return math.nan, 2, f"its node holds {what}" if severity < 2 else status_name(reading.status)
    value = nodes.of_node(float(reading.value))
    if severity >= 2:
        return value, 2, status_name(reading.status)
    if math.isinf(value):
        return value, 2, f"its node holds {reading.value!r}"
    if severity == 1:
        return value, 2 if nodes.uncertain == "bad" else 1, status_name(reading.status)
    return value, 0, ""
