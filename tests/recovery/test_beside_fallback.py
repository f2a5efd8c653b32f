"""Beside the fallback: a limit that is violated at once whatever is done is no reason to stop the plant."""

from __future__ import annotations

import pytest

from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.recovery import Attempted, Compared, ReleasedActions
from homeostat.domain.request import RequestStatus
from homeostat.recovery.bounds import InterventionBounds
from homeostat.recovery.plant_rules import Bounds
from homeostat.recovery.release_check import ReleaseCheck
from tests.agents.scripted import ScriptedAction
from tests.recovery.desk import AT_ONCE, Recovery, ticks
from tests.recovery.line import GOOD, feed

HOT = 313.2
"""Above the limit of 313 K already, whatever is done [K]."""
LESS = feed(0.01, "reduced")
"""A third of the feed cools by 0.03 K/s, where none cools by 0.1 K/s."""


def line(*answers: object, bounds: Bounds = AT_ONCE, last: int = 20) -> Recovery:
    return Recovery(ticks(1, last, HOT), action=ScriptedAction(*answers), bounds=bounds)  # type: ignore[arg-type]


def test_what_does_as_well_as_the_fallback_is_released_instead() -> None:
    done = line(LESS).run()
    assert done.handed_over == [] and len(done.released) == 1
    refused, approved = [e.approved for e in done.trace.of(Attempted)][:2]
    assert (refused, approved) == (False, True)
    (compared,) = done.trace.of(Compared)[:1]
    assert compared.chosen


def test_its_certificate_says_that_it_counts_what_does_worse_than_the_fallback() -> None:
    """Every draw violates the limit here: that none does would be a lie."""
    (released,) = line(LESS).run().trace.of(ReleasedActions)
    certificate = released.certificate
    assert certificate is not None and certificate.beside and certificate.violations == 0
    assert "do worse than the fallback" in certificate.told
    (usual,) = (
        Recovery(ticks(1, 20, 305.0), action=ScriptedAction(GOOD), bounds=AT_ONCE).run().trace.of(ReleasedActions)
    )
    assert usual.certificate is not None and not usual.certificate.beside
    assert usual.certificate.told == "violate a hard limit"


def test_only_what_is_confirmed_ends_the_charge_of_the_checks_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    ended: list[Diagnosis] = []
    monkeypatch.setattr(ReleaseCheck, "confirmed", lambda self, diagnosis: ended.append(diagnosis))
    for status in (RequestStatus.REFUSED, RequestStatus.WITHDRAWN, RequestStatus.ADVISED):
        done = Recovery(ticks(1, 20, 305.0), action=ScriptedAction(GOOD), bounds=AT_ONCE)
        done.desk.answer = status
        assert done.run().released and not ended
    Recovery(ticks(1, 20, 305.0), action=ScriptedAction(GOOD), bounds=AT_ONCE).run()
    assert len(ended) == 1


def test_what_stays_longer_outside_is_not() -> None:
    done = line(GOOD).run()  # half feed holds the temperature
    assert done.handed_over and done.released == []


def test_the_plant_is_looked_at_again_soon_after_it() -> None:
    soon = Bounds(intervention=InterventionBounds(waits=0, back_s=7.0))
    done = line(LESS, LESS, bounds=soon, last=40).run()
    first = done.released[0]
    assert any(first + 7.0 <= at_s <= first + 9.0 for at_s in done.when(Compared))
