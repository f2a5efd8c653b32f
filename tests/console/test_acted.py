"""A fallback that acted: each time by itself, with what the plant was read to hold of it."""

from __future__ import annotations

import pytest

from homeostat.console.card.card import Card
from homeostat.console.card.episode import card
from homeostat.console.card.explanation import explained
from homeostat.console.opened import KnownPlant
from homeostat.console.view import recorded
from homeostat.domain.events.trips import FallbackActivated, FallbackStands, LatchReset
from homeostat.journal import Event
from homeostat.journal.memory import Entry
from homeostat.plants.plant import load_plant

PLANT = KnownPlant("CSTR", load_plant("cstr").description)
ACTED, OTHER = FallbackActivated("isolate", (), "too hot"), FallbackActivated("drain", (), "too hot")
STANDS, RESET = FallbackStands("isolate"), LatchReset(("Ada",), "it is well", "s")


def shown(*events: Event) -> Card:
    """The card after ``events``, one each 10 s."""
    found = card(recorded([Entry(10.0 * n, event) for n, event in enumerate(events, 1)]), PLANT, None, 1000.0)
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("events", "stand"),
    [
        pytest.param((ACTED,), [False], id="it acted"),
        pytest.param((ACTED, STANDS), [True], id="it stands"),
        pytest.param((ACTED, STANDS, RESET, ACTED), [False, True], id="it acts once more, and is not read yet"),
        pytest.param((ACTED, STANDS, RESET, ACTED, STANDS), [True, True], id="it acts once more, and stands"),
        pytest.param((ACTED, OTHER, FallbackStands("drain")), [True, False], id="another one stands"),
        pytest.param((ACTED, STANDS, OTHER), [False, True], id="another one follows it"),
    ],
)
def test_what_the_plant_was_read_to_hold_is_said_of_each_time(events: tuple[Event, ...], stand: list[bool]) -> None:
    assert [one.stands for one in shown(*events).acted] == stand
    said = next(p.text for p in explained(shown(*events)) if p.heading == "What acted")
    assert said.count("was not read to hold it yet") == stand.count(False)
