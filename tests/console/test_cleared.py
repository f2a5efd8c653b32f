"""An episode ends when no symptom and no hypothesis is left, and one of an older record stays as it was."""

from __future__ import annotations

from homeostat.console.card.episode import last_episode
from homeostat.console.situation import situation
from homeostat.console.trial.trials import _diagnosis
from homeostat.domain.diagnosis import FaultState, Hypothesis, Symptom
from homeostat.domain.events.foresight import Foreseen
from homeostat.domain.events.recovery import Diagnosed, Doubted, FaultsEnded, NoActionTaken, Noticed, SymptomsCleared
from homeostat.journal import Event
from homeostat.journal.memory import Entry

COLD = Symptom("S-COLD", 100.0, -0.6, 0.5, 1.2)
LIKELY = (Hypothesis((), 0.6), Hypothesis((FaultState("fouling", 0.2, 90.0),), 0.4))
SEEN: tuple[tuple[float, Event], ...] = (
    (100.0, Noticed(("S-COLD",))),
    (102.0, Doubted((COLD,), LIKELY, explained=False)),
    (103.0, Foreseen("", 102.0, 900.0, 12)),
    (104.0, NoActionTaken("normal", 0.1)),
)
CLEARED = (400.0, SymptomsCleared(("S-COLD",), 340.0))


def entries(*told: tuple[float, Event]) -> list[Entry]:
    return [Entry(at_s, event) for at_s, event in told]


def test_symptoms_that_cleared_unexplained_end_their_episode() -> None:
    episode = last_episode(entries(*SEEN, CLEARED))
    assert episode is not None and episode.over_s == 400.0


def test_while_they_stand_it_lasts_as_it_does_in_a_record_that_is_older() -> None:
    episode = last_episode(entries(*SEEN))
    assert episode is not None and episode.over_s is None


def test_symptoms_that_come_back_begin_another_episode() -> None:
    episode = last_episode(entries(*SEEN, CLEARED, (900.0, Noticed(("S-COLD",)))))
    assert episode is not None and episode.over_s is None and episode.entries[0].at_s == 900.0


def test_that_something_may_come_back_opens_no_episode() -> None:
    over = (500.0, FaultsEnded((FaultState("fouling", 0.2, 90.0),), 450.0))
    known = (102.0, Diagnosed((COLD,), LIKELY[1:]))
    episode = last_episode(entries(SEEN[0], known, over, (500.0, Doubted((), LIKELY, explained=False))))
    assert episode is not None and episode.over_s == 500.0


def test_nothing_is_foreseen_any_more_once_they_have_cleared() -> None:
    assert situation(entries(*SEEN)).outlook is not None
    assert situation(entries(*SEEN, CLEARED)).outlook is None


def test_what_if_is_asked_of_a_doubt_with_nothing_held_to_be_wrong() -> None:
    doubt = _diagnosis(entries(*SEEN), 200.0)
    assert doubt.doubts and not doubt.faulty and doubt.symptoms == (COLD,)
    assert _diagnosis(entries(*SEEN, CLEARED), 500.0).hypotheses == ()
