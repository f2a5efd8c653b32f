"""Answers of an action model, spelled out: what a model would send, and what is taken for it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from decimal import Decimal

from pydantic import BaseModel

from homeostat.agents.language.answers import commands_in
from homeostat.domain.plant.state_machine import State
from homeostat.domain.recovery import ActionSet
from tests.twin.followed import reactor

TAGS = reactor().description.tags_by_name
STATES = tuple(s for s in reactor().description.machine.states if s.recovery_target)


def values_of(state: State, tag: str) -> list[str]:
    """Every whole multiple of the tag's increment that ``state`` admits, as decimals."""
    admitted = next(r for r in state.setpoints if r.tag == tag)
    increment = TAGS[tag].increment
    assert increment is not None
    step = Decimal(str(increment))
    first = math.ceil(Decimal(str(admitted.low)) / step)
    last = math.floor(Decimal(str(admitted.high)) / step)
    return [str(k * step) for k in range(first, last + 1)]


def text(state: State, changed: Mapping[str, str] | None = None, reasoning: str = "because") -> str:
    """An answer that is fine, but for the spellings ``changed`` of some commands."""
    spelled = {r.tag: values_of(state, r.tag)[0] for r in state.open_setpoints} | dict(changed or {})
    inner = ", ".join(f"{json.dumps(tag)}: {value}" for tag, value in spelled.items())
    return f'{{"reasoning": {json.dumps(reasoning)}, "commands": {{{inner}}}}}'


def commands(answer: BaseModel, state: State) -> dict[str, float | None]:
    """Tag -> value that an answer is taken for."""
    return {c.tag: c.value for c in commands_in(state, answer, TAGS)}


def taken(answer: BaseModel, state: State) -> ActionSet:
    """What an answer for one state is taken for."""
    return ActionSet(commands_in(state, answer, TAGS), state.name)
