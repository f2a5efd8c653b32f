"""What ``homeostat status`` shows of who vouches for a plant's configuration, also of an older service."""

from __future__ import annotations

from typing import Any

import pytest

from homeostat.cli.commands.status import lines

TOLD: dict[str, Any] = {
    "plant": "CSTR",
    "configuration": "0123456789abcdef",
    "writes_nothing": "",
    "now_s": None,
    "state": None,
    "mode": {"actual": "observe", "requested": "observe", "by": "", "why": ""},
    "latched": "",
    "link": {"trouble": "", "clock_s": 0.0, "missed": 0},
    "thinking": {"process": None, "reason": ""},
    "ticks": {"number": 0, "without": 0, "longest_s": 0.0},
    "alarms": [],
    "offered": {},
    "out_of_service": [],
    "readings": {},
}


@pytest.mark.parametrize(
    ("signed", "shown"),
    [({}, "0123456789ab"), ({"signed": ""}, "UNSIGNED"), ({"signed": "signed by 'Ada'"}, "signed by 'Ada'")],
)
def test_who_signed_is_said_where_the_service_says_it(signed: dict[str, str], shown: str) -> None:
    assert next(iter(lines({**TOLD, **signed}))).endswith(shown)


def test_why_nothing_is_written_is_said_where_nothing_may_be() -> None:
    refused = list(lines({**TOLD, "signed": "", "writes_nothing": "nobody signed"}))
    assert "writes    nothing: nobody signed" in refused
    assert not any(line.startswith("writes") for line in lines({**TOLD, "signed": ""}))
