"""Doubts: told once; one alarm of what nothing explains, which escalates at most once and returns when all is clear."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import pytest

from homeostat.domain.alarm import Priority
from homeostat.domain.diagnosis import SOMETHING_ELSE, Diagnosis, FaultState, Hypothesis, Symptom
from homeostat.domain.events.recovery import Diagnosed, Doubted, SymptomsCleared
from homeostat.domain.observation import Settled, Trouble
from homeostat.recovery.look.doubts import AGAIN_S, GONE_S, explained
from tests.agents.scripted import diagnosis
from tests.recovery.desk import DOOMED, FINE, Recovery, Watching, ticks

ALARM = "recovery:unexplained"
HOT, WET = Symptom("S-HOT", 10.0, 2.0, 1.0, 2.0), Symptom("S-WET", 12.0, 2.0, 1.0, 2.0)


def doubt(at_s: float, nothing: float = 0.6, symptoms: tuple[Symptom, ...] = (HOT,), fault: str = "jam") -> Diagnosis:
    """Nothing is likelier than not, and may not be so."""
    other = Hypothesis((FaultState(fault, 1.0, at_s),), 1.0 - nothing)
    return Diagnosis(at_s, symptoms, (Hypothesis((), nothing), other), doubts=True)


def lost(at_s: float) -> Diagnosis:
    """Nothing that can be named fits."""
    jam = Hypothesis((FaultState("jam", 1.0, at_s),), 0.5)
    return Diagnosis(at_s, (HOT,), (jam, Hypothesis((FaultState(SOMETHING_ELSE, 1.0, at_s),), 0.5)))


def recovery(
    *looks_s: float, last: int, answer: Callable[[float], Diagnosis] = doubt, gone_s: float = 1e9, hot: float = FINE,
    shows: Callable[[float], Sequence[str]] | None = None,
) -> Recovery:  # fmt: skip
    """Looks at those times, at symptoms that are gone from ``gone_s`` on [s]."""
    there = shows or (lambda at_s: ("S-HOT",) if 10.0 <= at_s < gone_s else ())
    return Recovery(ticks(1, last, hot), Watching(*looks_s, answer=answer, shows=there))


def raised(done: Recovery) -> list[tuple[float, Priority]]:
    return [(at_s, m.priority) for at_s, m in done.sent(Trouble) if m.name == ALARM]


def returned(done: Recovery) -> list[float]:
    return [at_s for at_s, m in done.sent(Settled) if m.name == ALARM]


# --- what is told ------------------------------------------------------------------------------------------------


def test_a_doubt_is_recorded_once_however_often_it_is_looked_at() -> None:
    done = recovery(10.0, 40.0, 100.0, 220.0, last=230).run()
    (told,) = done.trace.of(Doubted)
    assert told.symptoms == (HOT,) and not told.explained and done.trace.of(Diagnosed) == ()
    assert [h.name for h in told.hypotheses] == ["none", "jam"]


def test_another_symptom_and_another_cause_are_told_and_fewer_symptoms_are_not() -> None:
    says = {
        10.0: doubt(10.0),
        20.0: doubt(20.0, symptoms=(HOT, WET)),
        30.0: doubt(30.0, symptoms=(WET,)),
        40.0: doubt(40.0, fault="leak"),
        50.0: doubt(50.0),
    }
    done = recovery(*says, last=60, answer=lambda at_s: says[at_s]).run()
    assert done.when(Doubted) == [10.0, 20.0, 40.0]


def test_what_is_known_to_be_wrong_is_reported_and_not_doubted() -> None:
    done = recovery(10.0, last=20, answer=diagnosis).run()
    assert done.trace.of(Doubted) == () and done.trace.of(Diagnosed)


# --- the alarm ---------------------------------------------------------------------------------------------------


def test_the_second_look_that_explains_nothing_calls_a_person_once() -> None:
    done = recovery(10.0, 40.0, 100.0, 220.0, last=230).run()
    assert raised(done) == [(40.0, Priority.LOW)]
    ((_, trouble),) = [m for m in done.sent(Trouble) if m[1].name == ALARM]
    assert trouble.cause == (
        "nothing explains S-HOT since 10 s; it may be 60 % nothing, 40 % jam; "
        "the plant is left as it is and looked at again; no hard limit is in sight"
    )


def test_one_look_calls_nobody() -> None:
    assert raised(recovery(10.0, last=60).run()) == []


def test_what_is_measured_is_explanation_enough() -> None:
    """An operator's setpoint, or a feed that is colder: symptoms, and nothing is wrong for sure."""
    done = recovery(10.0, 40.0, 100.0, last=120, answer=lambda at_s: doubt(at_s, 0.95)).run()
    assert raised(done) == []
    (told,) = done.trace.of(Doubted)
    assert told.explained


def test_nobody_is_called_because_of_another_symptom_than_at_the_first_look() -> None:
    says = {10.0: doubt(10.0), 40.0: doubt(40.0, symptoms=(WET,))}
    done = recovery(*says, last=60, answer=lambda at_s: says[at_s], shows=lambda at_s: ("S-HOT", "S-WET")).run()
    assert raised(done) == []


def test_a_symptom_that_has_gone_while_it_was_looked_at_calls_nobody() -> None:
    done = recovery(10.0, 40.0, last=60, gone_s=35.0).run()
    assert raised(done) == []


@pytest.mark.parametrize(("rise", "called_s"), [(0.15, 40.0), (0.5, 10.0)], ids=["minutes away", "seconds away"])
def test_where_a_hard_limit_is_in_sight_it_is_urgent_and_says_how_soon(rise: float, called_s: float) -> None:
    """What may be wrong heats the line, which is left alone as long as nothing is likelier.

    A second look is waited for unless the limit may not wait for it.
    """
    done = recovery(10.0, 40.0, last=50, hot=FINE)
    quiet = done.twin.roll_out

    def hotter(actions, hypotheses, ended=None, members=None):  # type: ignore[no-untyped-def]
        done.twin.heating = rise if any(h.faults for h in hypotheses) else 0.1
        return quiet(actions, hypotheses, ended, members)

    done.twin.roll_out = hotter  # type: ignore[method-assign]
    done.twin.frozen = lambda: done.twin  # type: ignore[method-assign]
    done.run()
    assert raised(done) == [(called_s, Priority.HIGH)] and done.released == [] and done.handed_over == []
    cause = next(m.cause for _, m in done.sent(Trouble) if m.name == ALARM)
    assert "if one of these is wrong and nothing is done, " in cause and cause.endswith(" s at the soonest")


def test_an_alarm_becomes_urgent_once_and_stays_so() -> None:
    """At 100 s the line is hot enough for a limit to come into sight, and at 220 s it is not any more."""
    plant = (*ticks(1, 90), *ticks(91, 200, DOOMED), *ticks(201, 400))
    done = recovery(10.0, 40.0, 100.0, 220.0, 300.0, last=1)
    done.run(*plant[1:])
    assert [priority for _, priority in raised(done)] == [Priority.LOW, Priority.HIGH]


def test_where_nothing_that_can_be_named_fits_a_person_is_called_although_there_is_a_diagnosis() -> None:
    done = recovery(10.0, 40.0, last=50, answer=lost).run()
    assert [at_s for at_s, _ in raised(done)] == [40.0]


def test_it_is_over_when_it_is_explained() -> None:
    done = recovery(10.0, 40.0, 70.0, last=80, answer=lambda at_s: doubt(at_s) if at_s < 70.0 else diagnosis(at_s))
    done.run()
    assert [at_s for at_s, _ in raised(done)] == [40.0]
    before, over = returned(done)
    assert before == 40.0 and 70.0 <= over <= 80.0, "the first is of what whoever thought before may have left"


def test_it_is_over_once_the_symptoms_are_gone_for_a_while() -> None:
    done = recovery(10.0, 40.0, last=300, gone_s=100.0).run()
    assert returned(done)[-1] == 100.0 + GONE_S
    (cleared,) = done.trace.of(SymptomsCleared)
    assert cleared.symptoms == ("S-HOT",) and cleared.since_s == 100.0
    assert done.when(SymptomsCleared) == [100.0 + GONE_S]


def test_what_is_held_to_be_wrong_does_not_clear_with_its_symptoms() -> None:
    done = recovery(10.0, last=300, gone_s=100.0, answer=diagnosis)
    done.run()
    assert done.trace.of(SymptomsCleared) == ()


def test_where_something_has_ended_the_doubt_that_it_comes_back_is_told() -> None:
    ended = Diagnosis(
        50.0, (), doubt(50.0, 0.55).hypotheses, (FaultState("jam", 1.0, 10.0),), 45.0, doubts=True
    )  # fmt: skip
    done = recovery(10.0, 50.0, last=300, gone_s=45.0, answer=lambda at_s: diagnosis(at_s) if at_s < 50.0 else ended)
    done.run()
    assert done.when(Doubted) == [50.0] and done.trace.of(SymptomsCleared) == ()


# --- who wants to raise a storm ----------------------------------------------------------------------------------


def flapping(period_s: int, last: int) -> Recovery:
    """A symptom that comes and goes, and is looked at each time that it comes and again before it goes."""
    half = period_s // 2
    looks = [float(s) for start in range(10, last - period_s, period_s) for s in (start, start + half // 2)]

    def shows(at_s: float) -> Sequence[str]:
        return ("S-HOT",) if at_s >= 10.0 and (at_s - 10.0) % period_s < half else ()

    return recovery(*looks, last=last, shows=shows).run()


def test_a_symptom_that_comes_and_goes_quickly_is_one_alarm() -> None:
    done = flapping(60, 3600)
    assert len(raised(done)) == 1 and len(done.trace.of(Doubted)) == 1


@pytest.mark.parametrize("period_s", [130, 200, 400])
def test_one_that_goes_for_longer_is_a_few_alarms_in_an_hour(period_s: int) -> None:
    done = flapping(period_s, 3600)
    times = [at_s for at_s, _ in raised(done)]
    assert 1 <= len(times) <= 6
    assert all(after - before >= GONE_S for before, after in pairwise(times))
    assert all(b - a >= GONE_S for a, b in pairwise(done.when(Doubted)))


def test_a_situation_of_another_day_is_told_from_its_beginning() -> None:
    again = 10.0 + 2.0 * AGAIN_S
    there = lambda at_s: ("S-HOT",) if at_s < 50.0 or at_s > again else ()  # noqa: E731
    looks = (10.0, 40.0, again + 10.0, again + 40.0)
    done = recovery(*looks, last=int(again) + 60, shows=lambda at_s: there(at_s) if at_s >= 10.0 else ()).run()
    assert [at_s for at_s, _ in raised(done)] == [40.0, again + 40.0]
    assert done.when(Doubted) == [10.0, again + 10.0]


def test_whoever_begins_to_think_takes_back_what_somebody_left_behind() -> None:
    done = recovery(last=100, gone_s=0.0).run()
    assert len(returned(done)) == 1 and raised(done) == []


@pytest.mark.parametrize(
    ("shares", "enough"),
    [
        ({"none": 0.94, SOMETHING_ELSE: 0.06}, True),
        ({"none": 0.6, "jam": 0.4}, False),
        ({"none": 0.45, "jam": 0.3, "leak": 0.25}, True),
        ({"jam": 0.45, "leak": 0.45, SOMETHING_ELSE: 0.1}, True),
        ({"jam": 0.5, SOMETHING_ELSE: 0.5}, False),
        ({"none": 0.5, SOMETHING_ELSE: 0.5}, False),
        ({}, False),
    ],
)
def test_what_is_an_explanation(shares: dict[str, float], enough: bool) -> None:
    held = tuple(
        Hypothesis(() if name == "none" else (FaultState(name, 1.0, 0.0),), share) for name, share in shares.items()
    )
    assert explained(Diagnosis(0.0, (HOT,), held)) is enough


def test_actions_are_what_they_were() -> None:
    """A doubt changes nothing of what is written: a line that would trip is acted on as before."""
    done = Recovery(ticks(1, 30, DOOMED), Watching(10.0, answer=doubt))
    assert done.run().released == [10.0]
