"""Level, time left, what is waited for: in every mode, before and after a fallback, with a limit ahead and without."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import pytest

from homeostat.console.outlook import Outlook, Until, changes_s, outlook
from homeostat.console.situation import Situation, situation
from homeostat.domain.alarm import Priority
from homeostat.domain.events.foresight import Foreseen, Reached
from homeostat.domain.events.guard import Armed, GuardStarted, RequestAnswered
from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.recovery import Compared, FaultsEnded, Noticed, ReleasedActions
from homeostat.domain.events.trips import FallbackActivated, Latched, TripLifted
from homeostat.domain.events.writes import LeaseLost
from homeostat.journal import Event, RunFinished
from homeostat.journal.memory import Entry
from homeostat.plants.plant import load_plant

PLANT = load_plant("cstr").description
MODES = ("observe", "advise", "approve", "closed-loop")
SILENT = ("observe", "advise")
LIMIT = "LIM-T-HIGH"
NOTICED = Noticed(("S-HOT",))


def foreseen(probability: float | None, digest: str = "", from_s: float = 10.0, members: int = 36) -> Foreseen:
    """A hard limit is reached from 50 s to 100 s after ``from_s`` [s], in half of the members by 70 s; or none is."""
    first = None if probability is None else Reached("", 30, probability, 50.0, 70.0, 100.0)
    reached = () if first is None else (Reached(LIMIT, 30, first.probability, 50.0, 70.0, 100.0),)
    note = "" if members else "it diverged"
    return Foreseen(digest, from_s, 900.0, members, first=first, reached=reached, note=note)


def answered(status: str, digest: str = "d") -> RequestAnswered:
    return RequestAnswered("r", "search", digest, status, void_s=500.0 if status == "offered" else None)


AHEAD, CLEAR, ARMED = foreseen(0.9), foreseen(None), Armed(("isolate", "drain"), 45.0)
DISARMED = Armed(("isolate", "drain"), None)
CHOSEN = Compared("EUR", (), "d")
RELEASED = ReleasedActions("search", (), "d", "reduced_load", 0.3)
ACTED = FallbackActivated("isolate", (), "too hot")
LATCHED = Latched("too hot")
CRITICAL = AlarmRaised(f"trip:{LIMIT}", "too hot", Priority.CRITICAL)
WANTED = AlarmRaised("fallback wanted", "nothing is left", Priority.CRITICAL)


def stands(mode: str, events: Sequence[Event]) -> Situation:
    """Where a run stands after ``events`` that come at 10 s."""
    started = GuardStarted("cstr", "c", mode, "plant", False)
    return situation([Entry(0.0, started), *(Entry(10.0, event) for event in events)])


def ahead(mode: str, *events: Event, at_s: float = 20.0, beyond: tuple[str, ...] = (), wrong: bool = True) -> Outlook:
    """What comes next at ``at_s`` [s]."""
    return outlook(stands(mode, events), at_s, beyond, wrong, PLANT)


PERSON = "a person at the plant: in mode {!r} nothing is written"
ADVISED = "a person at the plant: in mode {!r} what is advised is not written"
THINKS = "recovery: it is working on an answer"
WATCHED = "nothing: the plant is watched"
N, U, C, L, F, P, B, A, E = (
    Until.NOTHING, Until.UNKNOWN, Until.CLEAR, Until.LIMIT, Until.FALLBACK, Until.PASSED, Until.BEYOND, Until.ACTED,
    Until.ENDED,
)  # fmt: skip

# What happened, when it is looked at [s], limits that readings violate, whether an episode lasts; then for each mode:
# level, what the time that is left ends with, what is waited for.
SAME = "the same in every mode"
TABLE: list[tuple[str, tuple[Event, ...], float, tuple[str, ...], bool, dict[str, tuple[str, Until, str]]]] = [
    ("quiet", (), 20.0, (), False, {SAME: ("normal", N, WATCHED)}),
    ("noticed", (NOTICED,), 20.0, (), True, {SAME: ("medium", U, THINKS)}),
    ("noticed long ago", (NOTICED,), 99.0, (), True, {SAME: ("medium", U, WATCHED)}),
    ("no limit ahead", (NOTICED, CLEAR), 99.0, (), True, {SAME: ("medium", C, WATCHED)}),
    ("the twin cannot say", (NOTICED, foreseen(None, members=0)), 20.0, (), True, {SAME: ("high", U, THINKS)}),
    ("it looked ahead too long ago", (NOTICED, CLEAR), 990.0, (), True, {SAME: ("medium", U, WATCHED)}),
    ("a limit ahead, thinking", (NOTICED, AHEAD), 20.0, (), True, {SAME: ("high", L, THINKS)}),
    ("the same without an episode", (AHEAD,), 20.0, (), False, {
        "observe": ("high", L, PERSON), "advise": ("high", L, PERSON),
        "approve": ("high", L, "the guard: a fallback acts at the limit"),
        "closed-loop": ("high", L, "the guard: a fallback acts at the limit"),
    }),
    ("decided, not yet with the guard", (NOTICED, AHEAD, CHOSEN), 20.0, (), True, {
        "observe": ("high", L, "the guard: check what was decided, and advise it"),
        "advise": ("high", L, "the guard: check what was decided, and advise it"),
        "approve": ("high", L, "the guard: check what was decided, and ask a person"),
        "closed-loop": ("high", L, "the guard: check what was decided, and write it"),
    }),
    ("armed with a time to act by", (NOTICED, AHEAD, ARMED), 20.0, (), True, {
        "observe": ("high", L, THINKS), "advise": ("high", L, THINKS), "approve": ("high", F, THINKS),
        "closed-loop": ("high", F, THINKS),
    }),
    ("nobody thinks any more", (NOTICED, AHEAD, ARMED), 75.0, (), True, {
        "observe": ("high", L, PERSON), "advise": ("high", L, PERSON),
        "approve": ("high", F, "the fallback: 'isolate' acts unless something better is found"),
        "closed-loop": ("high", F, "the fallback: 'isolate' acts unless something better is found"),
    }),
    ("expected by now", (NOTICED, AHEAD), 85.0, (), True, {
        "observe": ("critical", L, PERSON), "advise": ("critical", L, PERSON),
        "approve": ("critical", L, "the guard: a fallback acts at the limit"),
        "closed-loop": ("critical", L, "the guard: a fallback acts at the limit"),
    }),
    ("expected by now by few", (NOTICED, foreseen(0.1), answered("advised")), 85.0, (), True, {
        "observe": ("high", L, ADVISED), "advise": ("high", L, ADVISED),
    }),
    ("advised", (NOTICED, AHEAD, ARMED, CHOSEN, answered("advised"), DISARMED), 20.0, (), True, {
        "observe": ("high", L, ADVISED), "advise": ("high", L, ADVISED),
    }),
    ("advised, and the time is over", (NOTICED, AHEAD, CHOSEN, answered("advised")), 120.0, (), True, {
        "observe": ("high", P, ADVISED), "advise": ("high", P, ADVISED),
    }),
    ("advised, and the limit is violated", (NOTICED, AHEAD, CHOSEN, answered("advised")), 40.0, (LIMIT,), True, {
        "observe": ("critical", B, PERSON), "advise": ("critical", B, PERSON),
    }),
    ("tripped, where nobody writes", (NOTICED, AHEAD, CRITICAL, WANTED), 99.0, (LIMIT,), True, {
        "observe": ("critical", B, PERSON), "advise": ("critical", B, PERSON),
    }),
    ("offered", (NOTICED, AHEAD, ARMED, CHOSEN, answered("offered")), 20.0, (), True, {
        "approve": ("high", F, "a person: approve or reject the proposal"),
    }),
    ("offered without a limit ahead", (NOTICED, CLEAR, CHOSEN, answered("offered")), 20.0, (), True, {
        "approve": ("medium", C, "a person: approve or reject the proposal"),
    }),
    ("recovery gave up", (AHEAD, ARMED, WANTED), 20.0, (), True, {
        "approve": ("critical", F, "a person: have the fallback act, or act at the plant; nothing is proposed"),
    }),
    ("accepted", (NOTICED, AHEAD, ARMED, CHOSEN, answered("accepted")), 20.0, (), True, {
        "approve": ("high", F, "the plant: take what is being written"),
        "closed-loop": ("high", F, "the plant: take what is being written"),
    }),
    ("refused by the guard", (NOTICED, AHEAD, ARMED, CHOSEN, answered("refused")), 20.0, (), True, {
        SAME: ("high", L, THINKS), "approve": ("high", F, THINKS), "closed-loop": ("high", F, THINKS),
    }),
    ("released", (NOTICED, AHEAD, ARMED, foreseen(None, "d"), answered("confirmed"), RELEASED), 20.0, (), True, {
        "approve": ("medium", C, "the effect of what was released"),
        "closed-loop": ("medium", C, "the effect of what was released"),
    }),
    ("released, and not foreseen", (NOTICED, AHEAD, ARMED, answered("confirmed"), RELEASED), 20.0, (), True, {
        "approve": ("medium", U, "the effect of what was released"),
        "closed-loop": ("medium", U, "the effect of what was released"),
    }),
    ("released, and a limit ahead", (NOTICED, AHEAD, foreseen(0.2, "d"), RELEASED), 20.0, (), True, {
        "approve": ("high", L, "the guard: a fallback acts at the limit"),
        "closed-loop": ("high", L, "the guard: a fallback acts at the limit"),
    }),
    ("violated, not yet a trip", (NOTICED, AHEAD, ARMED), 20.0, (LIMIT,), True, {
        "observe": ("critical", B, PERSON), "advise": ("critical", B, PERSON),
        "approve": ("critical", B, "the guard: a fallback acts where the limit stays violated"),
        "closed-loop": ("critical", B, "the guard: a fallback acts where the limit stays violated"),
    }),
    ("a reading that is explained", (NOTICED, CLEAR, TripLifted(LIMIT, "T2 <= 1", 99.0)), 20.0, (LIMIT,), True, {
        SAME: ("medium", C, THINKS),
    }),
    ("the fallback acted", (NOTICED, AHEAD, ARMED, ACTED, LATCHED, CRITICAL), 20.0, (), True, {
        "approve": ("critical", A, "a person: reset the latch"),
        "closed-loop": ("critical", A, "a person: reset the latch"),
    }),
    ("it acted, and the limit is violated", (NOTICED, AHEAD, ACTED, LATCHED), 20.0, (LIMIT,), True, {
        "approve": ("critical", B, "a person: reset the latch"),
        "closed-loop": ("critical", B, "a person: reset the latch"),
    }),
    ("the plant takes no commands", (NOTICED, AHEAD, ARMED, LeaseLost("taken")), 20.0, (), True, {
        "approve": ("high", F, "a person at the plant: it takes no commands"),
        "closed-loop": ("high", F, "a person at the plant: it takes no commands"),
    }),
    ("over", (NOTICED, AHEAD, answered("advised"), FaultsEnded((), 9.0)), 99.0, (), False, {
        SAME: ("normal", N, WATCHED),
    }),
    ("the run has ended", (NOTICED, AHEAD, ARMED, RunFinished("recovered", "", 1.0)), 20.0, (LIMIT,), True, {
        SAME: ("critical", E, "nothing: the run has ended"),
    }),
]  # fmt: skip
CASES = [
    pytest.param(mode, events, (at_s, beyond, wrong), said, id=f"{what}, {mode}")
    for what, events, at_s, beyond, wrong, by_mode in TABLE
    for mode in MODES
    if (said := by_mode.get(mode, by_mode.get(SAME))) is not None
]


@pytest.mark.parametrize(("mode", "events", "seen", "said"), CASES)
def test_what_comes_next(
    mode: str,
    events: tuple[Event, ...],
    seen: tuple[float, tuple[str, ...], bool],
    said: tuple[str, Until, str],
) -> None:
    at_s, beyond, wrong = seen
    found = ahead(mode, *events, at_s=at_s, beyond=beyond, wrong=wrong)
    level, until, waiting = said
    assert (found.level, found.left.until, found.waiting) == (level, until, waiting.format(mode))


@pytest.mark.parametrize(("mode", "events", "seen", "said"), CASES)
def test_no_fallback_is_said_to_act_where_nobody_writes_and_a_limit_ahead_is_the_headline(
    mode: str, events: tuple[Event, ...], seen: tuple[float, tuple[str, ...], bool], said: tuple[str, Until, str]
) -> None:
    at_s, beyond, wrong = seen
    now = stands(mode, events)
    found = outlook(now, at_s, beyond, wrong, PLANT)
    words = f"{found.left.title} {found.left.text} {found.waiting}"
    if mode in SILENT:
        assert "fallback" not in words and found.left.until is not F
    if now.outlook is not None and now.outlook.first is not None and not now.finished:
        assert found.left.until in (L, F, P, B) and found.level in ("high", "critical")
        assert "Highest reactor temperature" in found.left.title or found.left.until is F


def test_what_comes_first_is_the_headline() -> None:
    left = ahead("closed-loop", NOTICED, AHEAD, ARMED).left
    assert (left.until, left.from_s, left.to_s) == (F, 45.0, 45.0)
    assert left.text == "Then fallback ‘isolate’ acts, at 45 s, unless something is released before."
    later = ahead("closed-loop", NOTICED, AHEAD, Armed(("isolate",), 95.0)).left
    assert (later.until, later.from_s, later.to_s) == (L, 60.0, 110.0)
    assert later.text == "At the limit fallback ‘isolate’ acts."


def test_noise_alone_is_no_emergency() -> None:
    found = ahead("closed-loop", beyond=(LIMIT,), wrong=False)
    assert (found.level, found.left.until) == ("high", B)


def test_what_was_foreseen_from_readings_of_before_a_release_says_nothing_of_after_it() -> None:
    now = situation([Entry(10.0, RELEASED), Entry(11.0, foreseen(0.9, from_s=10.5))])
    assert now.outlook is None
    assert situation([Entry(20.0, foreseen(0.9, from_s=20.0))], now).outlook is not None


@pytest.mark.parametrize(("mode", "events", "seen", "said"), CASES)
def test_between_events_nothing_changes_but_when_it_is_said_to(
    mode: str, events: tuple[Event, ...], seen: tuple[float, tuple[str, ...], bool], said: tuple[str, Until, str]
) -> None:
    _, beyond, wrong = seen
    now = stands(mode, events)
    times = sorted({10.0, 2000.0, *changes_s(now, PLANT)})
    for from_s, to_s in itertools.pairwise(times):
        inside = [from_s + share * (to_s - from_s) for share in (0.001, 0.5, 0.999)]
        assert len({outlook(now, at_s, beyond, wrong, PLANT) for at_s in inside}) == 1, (from_s, to_s)
