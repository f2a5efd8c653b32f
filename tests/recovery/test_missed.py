"""A wish that is missed for long asks for something better, also where nothing is wrong; nothing else of it changes."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.deviations import Missed
from homeostat.domain.events.recovery import Attempted, Compared
from homeostat.domain.observation import FallBack, Observation
from homeostat.domain.plant.limits import Criterion, Limits
from homeostat.domain.recovery import ActionSet
from homeostat.domain.snapshot import Snapshot
from homeostat.recovery.look.missed import MissedCriteria
from homeostat.recovery.orders import ORDER, taken_back
from tests.agents.scripted import ScriptedAction, diagnosis
from tests.recovery.desk import DEAR, FINE, FREE, NEXT, Recovery, nothing, tick, ticks, watching
from tests.recovery.line import GOOD, HALF, feed
from tests.safety.world import CALM, HOT, RUNNING, TAGS, command, criterion

OVER_S = 20.0
WISH = replace(criterion("ACC-SOFT", "T <= 306"), asks_after_s=OVER_S)
"""Warmer than 306 K for 20 s is to be bettered."""
ASKING = Limits((HOT,), (CALM, WISH))
WARM = 307.0
"""A kelvin beyond the wish, and six from the limit [K]."""


def line(*hot: float, **changed: Any) -> Recovery:
    """A line in which nothing is wrong at ``hot`` [K], a stretch of 40 s each; the feed could be halved."""
    seen = [t for k, each in enumerate(hot) for t in ticks(40 * k + 1, 40 * k + 40, each)]
    made = {"limits": ASKING, "rows": (*DEAR, *FREE), "improves": True, "heating": 0.01, **changed}
    return Recovery(seen, watching(answer=nothing), **made).run()


def test_what_is_missed_for_so_long_is_bettered_once() -> None:
    asked = line(WARM, action=ScriptedAction(GOOD))
    assert asked.when(Missed)[0] == 21.0 and asked.released[0] == 21.0
    assert asked.trace.of(Missed)[0] == Missed("ACC-SOFT", -1.0, "K", OVER_S)
    assert not asked.sent(FallBack)


UNTIMED = Limits((HOT,), (CALM, replace(WISH, asks_after_s=None)))


@pytest.mark.parametrize(("hot", "limits"), [(FINE, ASKING), (WARM, UNTIMED)])
def test_what_holds_and_what_states_no_time_asks_nobody(hot: float, limits: Limits) -> None:
    quiet = line(hot, limits=limits, rows=FREE)
    assert quiet.when(Missed) == [] and quiet.released == [] and quiet.desk.thoughts == 0


def test_what_costs_as_much_is_left_and_asked_about_after_as_long_again() -> None:
    """Nothing is gained by what leaves the line as warm as it is."""
    left = line(WARM, WARM, action=ScriptedAction(*[feed(0.03, "reduced")] * 12))
    assert left.released == [] and not left.sent(FallBack)
    assert left.when(Missed)[:2] == [21.0, 42.0]


def test_a_wish_that_costs_less_than_any_release_is_not_thought_about() -> None:
    cheap = line(WARM, rows=FREE)
    assert cheap.released == [] and cheap.when(Missed) and not cheap.trace.of(Compared)


def test_nobody_is_asked_whose_business_it_is_not_to_improve() -> None:
    assert line(WARM, improves=False).released == []


def test_nothing_falls_back_for_a_wish() -> None:
    """The line heats through its limit within the rollout; nobody notices anything, and nothing is proposed."""
    doomed = line(WARM, heating=0.1, action=ScriptedAction(*[feed(0.03, "reduced")] * 12))
    assert doomed.when(Missed) and not doomed.sent(FallBack)


def test_a_wish_beside_a_fault_changes_nothing_of_what_must_be_done() -> None:
    seen = ticks(1, 40, WARM)
    recovered = Recovery(seen, watching(10.0, answer=diagnosis), limits=ASKING, rows=(*DEAR, *FREE), heating=0.1).run()
    assert recovered.released[0] == 10.0


# --- what counts as missed -------------------------------------------------------------------------------------------


def first(seen: list[Observation], of: Criterion = WISH) -> float:
    """When it is missed for so long that it asks [s]; infinite for never."""
    mean = MissedCriteria((of,))
    return next((t.now_s for t in seen if mean.follow(t) is not None), math.inf)


def warm(first_s: int, last_s: int, hot: float = WARM, **changed: Any) -> list[Observation]:
    return list(ticks(first_s, last_s, hot, **changed))


def unsure(seen: list[Observation]) -> list[Observation]:
    return [replace(t, sample=Snapshot(t.now_s, t.sample.values, bad=frozenset({"T"}))) for t in seen if t.sample]


def test_the_mean_counts_and_not_each_reading() -> None:
    noisy = [tick(float(at_s), WARM + (2.0 if at_s % 2 else -1.9)) for at_s in range(1, 40)]
    assert first(noisy) == 21.0
    assert first([*warm(1, 20), *warm(21, 40, FINE)]) == math.inf, "what has come back is not asked about"
    # By hand: of the 21 readings of the last 20 s at least 11 must be at 307 K where the rest is at 305 K.
    assert first([*warm(1, 20, 305.0), *warm(21, 60)]) == 31.0


@pytest.mark.parametrize("between", [
    [tick(15.0, WARM, then=NEXT)], [replace(tick(15.0, WARM), entered=(("reduced", 15.0),))],
    [tick(15.0, WARM, latched="tripped")],
], ids=["on its way", "another state", "latched"])  # fmt: skip
def test_where_the_plant_is_moved_the_time_begins_anew(between: list[Observation]) -> None:
    assert first([*warm(1, 14), *between, *warm(16, 60)]) in (35.0, 36.0)


def test_bad_readings_say_nothing_and_half_of_them_must_be_good() -> None:
    assert first(unsure(warm(1, 80))) == math.inf
    assert first([*warm(1, 12), *unsure(warm(13, 20)), *warm(21, 40)]) == 21.0
    assert first([*warm(1, 4), *unsure(warm(5, 20)), *warm(21, 26)]) == math.inf
    assert first([replace(t, sample=None) for t in warm(1, 80)]) == math.inf


# --- what an improvement leaves alone --------------------------------------------------------------------------------

STANDS = {"T.sp": 310.0, "F.sp": 0.03, "L.sp": 10.0, "V.man": math.nan}
FIXED = replace(RUNNING, setpoints=tuple(replace(r, low=r.design, high=r.design) for r in RUNNING.setpoints[:2]))
"""A state that leaves no choice of temperature and feed, and does not ask for a level."""


@pytest.mark.parametrize(("now", "wanted", "tags"), [
    ({}, (("T.sp", 310.0), ("F.sp", 0.03)), []),
    ({}, (("T.sp", 305.0), ("F.sp", 0.0)), []),  # what stands as the state has it was nobody's order
    ({"F.sp": 0.02}, (("T.sp", 305.0), ("F.sp", 0.03)), ["F.sp"]),
    ({"F.sp": 0.02}, (("T.sp", 305.0), ("F.sp", 0.02)), []),
    ({}, (("L.sp", 9.0),), ["L.sp"]),
    ({}, (("V.man", 0.5),), []),
    ({"V.man": 0.5}, (("V.man", None),), ["V.man"]),
])  # fmt: skip
def test_what_was_ordered_is_not_taken_back(
    now: dict[str, float], wanted: tuple[tuple[str, float | None], ...], tags: list[str]
) -> None:
    actions = ActionSet(tuple(command(tag, value) for tag, value in wanted), "running")
    found = taken_back(FIXED, {**STANDS, **now}, TAGS, actions)
    assert [f.message.split()[0] for f in found] == tags and all(f.criterion == ORDER for f in found)
    assert not any(f.satisfied for f in found)


def test_what_a_state_leaves_open_is_no_order() -> None:
    assert taken_back(RUNNING, {**STANDS, "T.sp": 300.0}, TAGS, ActionSet((command("T.sp", 305.0),), "running")) == []


def test_an_improvement_that_would_take_an_order_back_is_refused() -> None:
    """The line runs at two thirds of its feed although its state asks for all of it: half would be better."""
    machine = Recovery(()).machine
    states = tuple(
        replace(s, setpoints=tuple(replace(r, low=0.03, high=0.03) if r.tag == "F.sp" else r for r in s.setpoints))
        if s.name == "running" else s
        for s in machine.states
    )  # fmt: skip
    ordered = replace(machine, states=states)
    seen = ticks(1, 40, WARM, feed=0.02)
    made = {"limits": ASKING, "rows": (*DEAR, *FREE), "improves": True, "heating": 0.01, "machine": ordered}
    refused = Recovery(seen, watching(answer=nothing), ScriptedAction(*[feed(HALF, "reduced")] * 12), **made).run()
    assert refused.released == [] and refused.when(Missed)
    assert any(f.criterion == ORDER for e in refused.trace.of(Attempted) for f in e.findings)
