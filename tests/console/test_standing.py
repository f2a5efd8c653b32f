"""Where proposals stand, after every order of events that can occur: only what holds is shown as proposed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.console.card.course import standings
from homeostat.console.card.standing import Standing, Stands, current, fallen
from homeostat.console.opened import OpenedRun
from homeostat.console.view import seen
from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.cost import Cost
from homeostat.domain.events.guard import GuardStarted, RequestAnswered, StateEntered, ThinkingEnded
from homeostat.domain.events.people import ModeEntered
from homeostat.domain.events.recovery import (
    Attempted,
    Compared,
    Concluded,
    Diagnosed,
    FaultsEnded,
    GaveUp,
    LaterStep,
    NoActionTaken,
    Noticed,
    Probed,
    ReleasedActions,
    ReleaseRefused,
    Waited,
)
from homeostat.domain.events.trips import FallbackActivated, Latched, LatchReset
from homeostat.domain.events.writes import Cause, WriteIntended
from homeostat.domain.recovery import Command
from homeostat.domain.verdict import Finding, Owner
from homeostat.journal import Event, RunFinished
from homeostat.journal.memory import Entry

HOT = Finding("LIM", Owner.PLANNING, -1.0, "K", 3.0, 0, "it gets too hot")


def tried(digest: str, approved: bool = True, what: AlternativeKind = AlternativeKind.RELEASE) -> Attempted:
    seconds = 60.0 if what is AlternativeKind.WAIT else 0.0
    findings = () if approved else (HOT,)
    return Attempted(1, "search", ("s", "t"), (), digest, approved, findings, 3, None, False, what, seconds)


def said(status: str, digest: str = "a", check: str = "", reason: str = "", request: str = "") -> RequestAnswered:
    return RequestAnswered(request or f"r{digest}", "search", digest, status, check, reason)


def released(digest: str = "a") -> ReleasedActions:
    return ReleasedActions("search", (), digest, "t", 0.3)


WAIT = Alternative(AlternativeKind.WAIT, "t > u", Cost((), 0.0), "", "recovery", "w", seconds=60.0)
A, B, W = Compared("EUR", (), "a"), Compared("EUR", (), "b"), Compared("EUR", (WAIT,), "w")
NOTHING = Compared("EUR", (), "")
STEPS = replace(tried("a"), then=(LaterStep("fill", "L1 >= 2", "u", ()),))
TA, TB, TW = tried("a"), tried("b"), tried("rest", what=AlternativeKind.WAIT)
LOOKED_ON = Probed(("warm", "dirty"), "", (), 60.0, 1.0, 0.2, 0.01)
TESTED = replace(LOOKED_ON, state="u", commands=(Command("F", 1.0, None),))
WAITED = Waited("recovery", 60.0, "t > u")
OFFERED, ADVISED, ACCEPTED, CONFIRMED = (said(s) for s in ("offered", "advised", "accepted", "confirmed"))
NO = said("refused", check="CHK-PERSON", reason="Bo: too hot")
EXPIRED = said("refused", check="CHK-EXPIRY", reason="the seal is void")
LATE = said("withdrawn", check="CHK-WITHDRAWN", reason="nobody answered within 300 s")
TRIPPED = said("withdrawn", check="CHK-OVERTAKEN", reason="a trip")
BUSY = said("refused", check="CHK-RATE", reason="too fast")
AGAIN_OFFERED = said("offered", request="r2")
STARTED = WriteIntended(7, 1, Cause.PERSON, "Ada", (), "", "t")
SENT = WriteIntended(7, 1, Cause.REQUEST, "ra", (), "a", "t")
ACTED, LATCHED = FallbackActivated("isolate", (), "too hot"), Latched("too hot")
RESET = LatchReset(("Ada",), "it is well", "s")
GONE = ThinkingEnded(7, "thinking has ended")
AGAIN = GuardStarted("p", "c", "approve", "plant", True)
LEFT, OVER, LOOK, ENDED = NoActionTaken("s", 0.1), FaultsEnded((), 0.0), Noticed(()), RunFinished("released")
S = Stands

# What happened; then digest and standing of what is shown as proposed or in force, or what fell last, and words of it.
TABLE: list[tuple[str, tuple[Event, ...], tuple[str, Stands] | None, tuple[str, Stands] | None, str]] = [
    ("nothing", (LOOK,), None, None, ""),
    ("refused by its checks", (tried("a", False),), None, None, ""),
    ("tried", (TA,), ("a", S.TRIED), None, "being tried"),
    ("two tried", (TA, TB), ("b", S.TRIED), None, ""),
    ("tried, then refused by its checks", (TA, tried("a", False)), None, ("a", S.REFUSED), "its checks: it gets too"),
    ("chosen", (TA, TB, A), ("a", S.CHOSEN), None, "have not answered"),
    ("nothing chosen", (TA, TB, NOTHING), None, ("b", S.OVERTAKEN), "nothing was chosen"),
    ("chosen, and the release check says no", (TA, A, ReleaseRefused("search", "a", (HOT,))), None,
     ("a", S.REFUSED), "refused by the release check on fresh readings: it gets too hot"),
    ("refused, and the next is chosen", (TA, A, BUSY, TB, B), ("b", S.CHOSEN), None, ""),
    ("refused by the guard", (TA, A, BUSY), None, ("a", S.REFUSED), "refused by the guard: too fast"),
    ("refused, and another is tried", (TA, A, BUSY, TB), ("b", S.TRIED), None, ""),
    ("refused, and nobody has another", (TA, A, BUSY, GaveUp("search", "x"), NOTHING), None, ("a", S.REFUSED), ""),
    ("on the way", (TA, A, said("received"), said("verified")), ("a", S.CHOSEN), None, ""),
    ("offered", (TA, A, said("received"), OFFERED), ("a", S.OFFERED), None, "waits for a person's yes"),
    ("offered, and looked at again", (TA, A, OFFERED, LOOK, TB, B), ("a", S.OFFERED), None, ""),
    ("offered, and a person says no", (TA, A, OFFERED, NO), None, ("a", S.REFUSED), "refused by Bo: too hot"),
    ("offered, and nobody says anything", (TA, A, OFFERED, LATE), None, ("a", S.VOID), "void: nobody answered"),
    ("offered, and expired", (TA, A, OFFERED, EXPIRED), None, ("a", S.VOID), "void"),
    ("offered, and a trip", (TA, A, OFFERED, TRIPPED, ACTED, LATCHED), None, ("a", S.OVERTAKEN), "a trip"),
    ("offered, and the fallback", (TA, A, OFFERED, ACTED, TRIPPED, LATCHED), None, ("a", S.OVERTAKEN), "isolate"),
    ("chosen, and the process that thinks dies", (TA, A, GONE), None, ("a", S.VOID), "void: thinking has ended"),
    ("it waits, and the same", (TW, W, WAITED, GONE), None, ("w", S.VOID), "void: thinking has ended"),
    ("offered, and the same", (TA, A, OFFERED, GONE), ("a", S.OFFERED), None, "waits for a person's yes"),
    ("advised, and the same", (TA, A, ADVISED, GONE), ("a", S.ADVISED), None, ""),
    ("offered, and the guard begins again", (TA, A, OFFERED, AGAIN), None, ("a", S.VOID), "the guard began again"),
    ("offered, and the run ends", (TA, A, OFFERED, ENDED), None, ("a", S.VOID), "the run has ended"),
    ("offered twice, one of them late", (TA, A, OFFERED, said("offered", request="r2"), LATE),
     ("a", S.OFFERED), None, ""),
    ("offered twice, one of them written", (TA, A, OFFERED, AGAIN_OFFERED, ACCEPTED), ("a", S.WRITTEN), None, ""),
    ("the same, and not held", (TA, A, OFFERED, AGAIN_OFFERED, ACCEPTED, said("failed", reason="it moved")),
     ("a", S.OFFERED), None, ""),
    ("the same, and the other one is refused", (TA, A, OFFERED, AGAIN_OFFERED, ACCEPTED, said("refused", request="r2")),
     ("a", S.WRITTEN), None, ""),
    ("asked for again while it is written", (TA, A, ACCEPTED, LOOK, TA, A, said("refused", request="r2")),
     ("a", S.WRITTEN), None, "being written"),
    ("approved", (TA, A, OFFERED, ACCEPTED), ("a", S.WRITTEN), None, "being written"),
    ("not held", (TA, A, ACCEPTED, said("failed", reason="it moved")), None, ("a", S.FAILED), "it moved"),
    ("released", (TA, A, ACCEPTED, CONFIRMED, released()), ("a", S.RELEASED), None, "the plant holds it"),
    ("released, in an older record", (TA, A, released()), ("a", S.RELEASED), None, ""),
    ("released, and the run ends", (TA, A, CONFIRMED, LOOK, LEFT, OVER, ENDED), ("a", S.RELEASED), None, ""),
    ("released, and the mode changes", (TA, A, CONFIRMED, ModeEntered("observe", "Ada")), ("a", S.RELEASED), None, ""),
    ("released, and a person orders a start", (TA, A, SENT, CONFIRMED, STARTED), None,
     ("a", S.OVERTAKEN), "Ada ordered a start"),
    ("chosen, and a person orders a start", (TA, A, STARTED), None, ("a", S.OVERTAKEN), "Ada ordered a start"),
    ("released, and nobody writes what follows", (STEPS, A, CONFIRMED, ModeEntered("advise", "Ada")), ("a", S.RELEASED),
     None, "released, and what was still to follow is not written: the mode went to 'advise'"),
    ("released, and a person decides on what follows", (STEPS, A, CONFIRMED, ModeEntered("approve", "Ada")),
     ("a", S.RELEASED), None, "the plant holds it"),
    ("released, and another is tried", (TA, A, CONFIRMED, LOOK, TB), ("a", S.RELEASED), None, ""),
    ("released, and another is chosen", (TA, A, CONFIRMED, LOOK, TB, B), ("b", S.CHOSEN), None, ""),
    ("released, and another is refused", (TA, A, CONFIRMED, TB, B, said("refused", "b", reason="no")),
     ("a", S.RELEASED),
     ("b", S.REFUSED), ""),
    ("released, and another is not chosen", (TA, A, CONFIRMED, TB, NOTHING), ("a", S.RELEASED), None, ""),
    ("released, and another one too", (TA, A, CONFIRMED, TB, B, said("confirmed", "b"), released("b")),
     ("b", S.RELEASED), None, ""),
    ("released, and another is written in vain", (TA, A, CONFIRMED, TB, B, said("failed", "b", reason="stuck")), None,
     ("b", S.FAILED), "stuck"),
    ("released, and the fallback acts", (TA, A, CONFIRMED, ACTED, LATCHED), None, ("a", S.OVERTAKEN), "isolate"),
    ("the same, told late by recovery", (TA, A, CONFIRMED, ACTED, released()), None, ("a", S.OVERTAKEN), "isolate"),
    ("the same again, in force", (TA, A, CONFIRMED, TA, A, said("refused")), ("a", S.RELEASED), ("a", S.REFUSED), ""),
    ("fallback, and recovery thinks on", (TA, ACTED, LATCHED, TB, B), None, ("a", S.OVERTAKEN), ""),
    ("fallback, reset, and something new", (TA, ACTED, LATCHED, RESET, TB, B), ("b", S.CHOSEN), None, ""),
    ("advised", (TA, A, ADVISED), ("a", S.ADVISED), None, "nobody writes"),
    ("advised, looked at again", (TA, A, ADVISED, LOOK, TA), ("a", S.ADVISED), None, ""),
    ("advised, and another mode", (TA, A, ADVISED, ModeEntered("approve", "Ada")), None, ("a", S.VOID), "'approve'"),
    ("advised, and left alone", (TA, A, ADVISED, LOOK, LEFT), None, ("a", S.OVERTAKEN), "left as it is"),
    ("advised, and over", (TA, A, ADVISED, OVER), None, ("a", S.OVERTAKEN), "is over"),
    ("advised, and something else", (TA, A, ADVISED, LOOK, TB, B), ("b", S.CHOSEN), None, ""),
    ("tried, and looked at again", (TA, LOOK), None, ("a", S.OVERTAKEN), "looked at again"),
    ("chosen, and the plant goes on", (TA, A, StateEntered("x")), None, ("a", S.VOID), "went on to 'x'"),
    ("chosen, and the state is told again", (TA, A, StateEntered("s")), ("a", S.CHOSEN), None, ""),
    ("chosen, and nothing came of it", (TA, A, Concluded("it is late")), None, ("a", S.VOID), "it is late"),
    ("a wait is tried", (TW,), ("wait 60", S.TRIED), None, ""),
    ("a wait is chosen", (TA, TW, W), ("w", S.CHOSEN), None, ""),
    ("a wait is decided", (TA, TW, W, WAITED), ("w", S.WAITED), None, "looked at again at 70 s; to 'u' is expected"),
    ("a wait to learn", (TW, W, LOOKED_ON), ("w", S.WAITED), None, "'warm' is to be told from 'dirty' by then"),
    ("a wait to learn, and a look", (TW, W, LOOKED_ON, LOOK, Diagnosed((), ())), None, ("w", S.OVERTAKEN), ""),
    ("a test move", (TA, A, TESTED), ("a", S.CHOSEN), None, ""),
    ("a wait, and nothing new meanwhile", (TW, W, WAITED, LOOK, Concluded("no news")), ("w", S.WAITED), None, ""),
    ("a wait, and a diagnosis", (TW, W, WAITED, LOOK, Diagnosed((), ())), None, ("w", S.OVERTAKEN), "at again"),
    ("a wait after a release", (TA, A, CONFIRMED, TW, W, WAITED), ("w", S.WAITED), None, ""),
    ("a wait, and the fallback", (TW, W, WAITED, ACTED), None, ("w", S.OVERTAKEN), "isolate"),
    ("a stranger's request", (TA, A, RequestAnswered("x", "", "", "refused", "CHK-SEAL", "no")),
     ("a", S.CHOSEN), None, ""),
]  # fmt: skip


def after(events: Sequence[Event], at_s: float = 10.0) -> tuple[Standing, ...]:
    return standings(Entry(at_s, event) for event in events)


@pytest.mark.parametrize("row", TABLE, ids=[row[0] for row in TABLE])
def test_what_is_shown_is_what_holds(
    row: tuple[str, tuple[Event, ...], tuple[str, Stands] | None, tuple[str, Stands] | None, str],
) -> None:
    _, events, holds, fell, words = row
    stood = after(events)
    shown = [None if one is None else (one.digest, one.stands) for one in (current(stood), fallen(stood))]
    assert shown == [holds, fell]
    one = current(stood) or fallen(stood)
    assert words in ("" if one is None else one.words)
    judged = [s.judged.event for s in stood if s.judged is not None]
    assert all(isinstance(event, Attempted) and event.approved for event in judged)


def test_a_wait_is_over_when_its_time_is() -> None:
    entries = [Entry(10.0, e) for e in (TW, W, WAITED)]
    assert (now := current(standings([*entries, Entry(69.0, LOOK)]))) and now.stands is S.WAITED
    assert now.judged is not None and now.judged.event == TW, "and not what has the digest of what goes on meanwhile"
    assert current(standings([*entries, Entry(70.0, LOOK)])) is None
    assert current(standings([*entries, Entry(71.0, Concluded("nothing is wrong"))])) is None


EVENTS = (
    TA, TB, TW, tried("a", False), A, B, W, NOTHING, WAITED, OFFERED, said("offered", "b"), ADVISED,
    ACCEPTED, CONFIRMED,
    said("confirmed", "b"), NO, EXPIRED, LATE, TRIPPED, BUSY, said("failed"), released(), released("b"), ACTED, LATCHED,
    AGAIN_OFFERED, STARTED, SENT,
    RESET, AGAIN, GONE, LEFT, OVER,
    LOOK, Diagnosed((), ()), Concluded("x"), ModeEntered("approve", "Ada"), StateEntered("x"),
    ReleaseRefused("search", "a", (HOT,)), GaveUp("search", "x"), ENDED,
)  # fmt: skip


@settings(max_examples=400, deadline=None)
@given(st.lists(st.sampled_from(EVENTS), max_size=14))
def test_after_any_events_nothing_that_fell_is_proposed(events: list[Event]) -> None:
    stood = after(events)
    now, fell = current(stood), fallen(stood)
    assert now is None or now.stands.holds
    assert fell is None or (not fell.stands.holds and (now is None or now.stands is S.RELEASED))
    assert len([one for one in stood if one.stands is S.RELEASED]) <= 1, "one thing is in force"
    for ending in (NO, EXPIRED, LATE, TRIPPED, BUSY, said("failed")):
        ended = [one for one in after([*events, said("withdrawn", request="r2"), ending]) if one.digest == "a"]
        assert not any(one.stands in (S.OFFERED, S.WRITTEN, S.CHOSEN, S.TRIED, S.ADVISED) for one in ended)
    assert current(after([*events, ACTED])) is None, "a fallback overtakes everything"
    assert not [o for o in after([*events, AGAIN]) if o.stands not in (S.RELEASED,) and o.stands.holds]


def test_in_a_run_the_card_shows_what_holds_and_what_was_released_at_last(recovered: OpenedRun) -> None:
    shown = set()
    for entry in recovered.entries:
        card = seen(recovered, entry.at_s).card
        if card is None:
            continue
        assert card.proposal is None or card.proposal.stands.holds
        assert card.fallen is None or not card.fallen.stands.holds
        shown |= {card.proposal.stands} if card.proposal else set()
    assert {S.CHOSEN, S.RELEASED} <= shown or {S.OFFERED, S.RELEASED} <= shown or {S.WRITTEN, S.RELEASED} <= shown
