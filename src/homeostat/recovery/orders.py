"""Orders: setpoints that somebody has moved away from what their state asks for, which no improvement takes back."""

import math
from collections.abc import Mapping
from typing import Final

from homeostat.domain.plant.limits import Owner
from homeostat.domain.plant.state_machine import State
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import ActionSet
from homeostat.domain.verdict import Finding
from homeostat.guard.requests.permissives import refusal

ORDER: Final = "CHK-ORDER"
"""Name of the refusal of an improvement that takes an order back."""
SAME: Final = 1e-6
"""Setpoints that differ by no more than this share of their range are the same [1]."""


def taken_back(state: State, values: Mapping[str, float], tags: Mapping[str, Tag], actions: ActionSet) -> list[Finding]:
    """One refusal for each order that ``actions`` would take back.

    An order is a value that ``state``, in which the plant is, does not ask for: it states another one, or none. What
    it leaves open between two ends is anybody's to choose.
    """
    asked = {r.tag: r for r in state.setpoints}
    found = []
    for command in actions.commands:
        now, tag, own = values.get(command.tag, math.nan), tags[command.tag], asked.get(command.tag)
        if math.isnan(now) or (own is not None and own.high > own.low):
            continue
        near = SAME * tag.range.span
        ordered = own is None or own.design is None or abs(now - own.design) > near
        if ordered and (command.value is None or abs(command.value - now) > near):
            to = "automatic" if command.value is None else f"{command.value:g}"
            text = (
                f"{command.tag} stands at {now:g} {tag.unit} by an order and would go to {to}; nothing is wrong, so "
                "propose what leaves it"
            )
            found.append(refusal(ORDER, text, Owner.PLANNING))
    return found
