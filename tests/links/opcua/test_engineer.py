"""The engineer's port of a served plant: orders in one line each, and what cannot be done is told and harms nothing."""

from __future__ import annotations

import json
import socket

import pytest

from tests.equipment.opcua.served import Served
from tests.links.opcua.waiting import sample


def said(served: Served, line: str) -> str:
    """What the engineer's port answers to ``line``, as text."""
    with socket.create_connection(("127.0.0.1", served.engineer), 30.0) as connection:
        connection.sendall(line.encode() + b"\n")
        return connection.makefile().readline()


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("", "says nothing that can be done"),
        ("nonsense", "says nothing that can be done"),
        ("clamp L.sp", "too many words or too few"),
        ("clamp L.sp 3 2", "low < high"),
        ("operate L.sp much", "could not convert"),
        ("operate L 3", "cannot be commanded"),
        ("operate L.sp automatic", "has no automatic mode"),
        ("release L", "cannot be done"),
        ("fault fouling 0.5", "the plant has no faults"),
        ("quality T Nonsense", "is no status of OPC UA"),
        ("quality T9 BadSensorFailure", "no node 'T9'"),
        ("text Guard/Alarm", "no reading"),
        ("stall inf", "must be from 0 to 600"),
        ("pace -1", "must be from 0 to 1000"),
        ("clock nan", "must be from"),
        ("step 0", "must be from 1"),
    ],
)
def test_what_cannot_be_done_is_told_and_the_plant_goes_on(served: Served, line: str, why: str) -> None:
    answer = json.loads(said(served, line))
    assert why in answer["error"] and "\n" not in answer["error"] and answer.keys() == {"error"}
    with served.link() as link:
        assert not sample(link).bad


def test_an_operator_takes_a_block_and_leaves_it(served: Served) -> None:
    with served.link() as link:
        served.ask("operate L.sp 9 0.5")
        assert served.ask("status")["L.sp/Mode"] == 0
        assert sample(link, lambda s: s.values["L.sp"] == 9.0).accepted["L.sp"] == 9.0
        served.ask("release L.sp")
        assert served.ask("status")["L.sp/Mode"] == 1
        served.ask("operate cool.man 0.5")
        assert sample(link, lambda s: s.accepted["cool.man"] == 0.5).values["cool.man"] == pytest.approx(0.5)
        served.ask("release cool.man")
        assert sample(link, lambda s: s.accepted["cool.man"] is None)


def test_a_plant_begins_again_and_goes_at_another_pace(served: Served) -> None:
    with served.link() as link:
        before_s = sample(link).at_s
        served.ask("pace 50")
        assert served.ask("begin") == 1.0
        assert sample(link, lambda s: s.at_s > before_s + 60.0, within_s=20.0)
        served.ask(f"pace {served.scale}")
