"""Samples of a served plant, however its counter and its batches come: none is lost, none is told twice."""

from __future__ import annotations

import itertools
import time

import pytest

from homeostat.domain.snapshot import Snapshot
from homeostat.links.opcua.link import OpcuaLink
from homeostat.links.opcua.mapping import mapping_of
from homeostat.links.opcua.security.security import Security
from tests.equipment.opcua.served import Served
from tests.equipment.opcua.tank import RULES, tank_content
from tests.links.opcua.waiting import sample

pytestmark = pytest.mark.slow


def linked(served: Served, publish_s: float, *left_out: str) -> OpcuaLink:
    content = tank_content(served.port, publish_s=publish_s)
    for name in left_out:
        del content["guard"][name]
    return OpcuaLink(mapping_of(content, "tank"), RULES, Security(served.pki), pace=served.scale)


def read_for(link: OpcuaLink, seconds: float) -> list[Snapshot]:
    found, end = [sample(link)], time.monotonic() + seconds
    while time.monotonic() < end:
        if (seen := link.source.advance()) is not None:
            found.append(seen)
    return found


def test_several_samples_in_one_answer_are_read_one_by_one(served: Served) -> None:
    with linked(served, 0.5) as link:
        found = read_for(link, 4.0)
        times = [seen.at_s for seen in found]
        assert len(found) >= 10 and link.source.missed == 0
        assert all(b - a == 1.0 for a, b in itertools.pairwise(times))
        assert len({seen.values["T"] for seen in found}) > 0.9 * len(found), "each is of its own time"


@pytest.mark.parametrize("left_out", [("counter", "time"), ("time",)], ids=["neither", "counter alone"])
def test_without_the_plants_time_ours_goes_on_as_fast_as_it_does(served: Served, left_out: tuple[str, ...]) -> None:
    with linked(served, 0.05, *left_out) as link:
        begin = time.monotonic()
        found = read_for(link, 4.0)
        passed_s = (time.monotonic() - begin) * served.scale
        assert 0.6 * passed_s <= len(found) <= passed_s + 3
        assert found[-1].at_s - found[0].at_s <= passed_s + 2.0
