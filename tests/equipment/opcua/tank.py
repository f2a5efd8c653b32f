"""The scripted tank as its tables would have it, and the mapping that its server needs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.rules import GuardRules, WriteRule
from homeostat.domain.plant.state_machine import State, StateMachine
from homeostat.domain.plant.tag import Range, Role, Tag
from homeostat.links.opcua.mapping import LinkMapping, mapping_of
from homeostat.stl.formula import parse
from tests.equipment.links.scripted import PlantScript
from tests.links.tank import script

TAGS = {
    "L": Tag("L", Role.PV, "L", Range(0.0, 14.0), 0.2),
    "T": Tag("T", Role.PV, "K", Range(250.0, 400.0), 1.0),
    "L.sp": Tag("L.sp", Role.SP, "L", Range(2.0, 12.0), 0.2, rate_limit=2.0),
    "cool.man": Tag("cool.man", Role.MV, "1", Range(0.0, 1.0), 0.05),
}
WRITABLES = {
    "L.sp": WriteRule("L.sp", 0.05, 3.0),
    "cool.man": WriteRule("cool.man", 0.005, 3.0, automatic=True),
}
MACHINE = StateMachine(
    "tank", (State("running", "Running", 0, True, True, parse("L >= 0", TAGS), frozenset(), ()),), ()
)
RULES = GuardRules("tank", TAGS, MACHINE, Limits((), ()), {}, {}, WRITABLES, ())


def never_ending() -> PlantScript:
    """The tank, with some noise, for longer than any test."""
    return replace(script(noise=0.01), end_s=1e9)


def tank_content(port: int, two_step: bool = False, **connection: object) -> dict[str, Any]:
    """The mapping file of the served tank, as TOML reads it."""
    url = f"opc.tcp://127.0.0.1:{port}/homeostat/"
    guard = {
        "counter": "Plant/Counter", "time": "Plant/Time", "heartbeat": "Guard/Heartbeat", "lease": "Guard/Lease",
        "permit": "Guard/Permit", "hold": "Guard/Hold", "alarm": "Guard/Alarm", "acknowledged": "Guard/Acknowledged",
    }  # fmt: skip
    tags: dict[str, dict[str, Any]] = {tag: {"node": f"ns=2;s={tag}"} for tag in TAGS}
    for tag in WRITABLES:
        parts = {"node": "Target", "feedback": "Working", "mode": "Mode", "rate": "Rate"}
        if two_step:
            parts |= {"requested": "Requested", "apply": "Apply"}
        tags[tag]["write"] = {key: f"ns=2;s={tag}/{part}" for key, part in parts.items()} | {"ramp": "plant"}
    return {
        "connection": {"url": url, "publish_s": 0.05, "answer_s": 2.0, "dead_s": 2.0, "retry_s": 0.2, **connection},
        "guard": {key: f"ns=2;s={node}" for key, node in guard.items()},
        "tags": tags,
    }


def tank_mapping(port: int, two_step: bool = False, **connection: object) -> LinkMapping:
    """The mapping of the served tank."""
    return mapping_of(tank_content(port, two_step, **connection), "tank")
