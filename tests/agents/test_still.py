"""An instrument that has noise and stands still: asked about at once, forgotten once it moves, and nothing else is."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from homeostat.agents.monitoring.followed import Followed
from homeostat.agents.monitoring.monitoring import TwinMonitoring
from homeostat.agents.monitoring.still import MOVING, Picture, Still, repeats
from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import NoActionNeeded, Released
from homeostat.twin.history import History
from homeostat.twin.isolation.ended import Ended
from homeostat.twin.isolation.prechecks import What, flat_lines
from homeostat.twin.twin import Twin
from tests.agents.scripted import NoGraph
from tests.agents.test_monitoring import RELEASED
from tests.twin.followed import LEARN_S, disturbed, reactor

D = reactor().description
RULE = D.qualities["L1"]
LONGEST_S = RULE.frozen_s or math.nan
NOISE = np.random.default_rng(7).normal(0.0, 0.01, 4000)


def shown(at_s: float, level: float, **taken_s: float) -> Snapshot:
    return Snapshot(at_s, {"L1": level, "T1": 310.0 + float(NOISE[int(at_s)])}, taken_s=taken_s)


def found() -> Mapping[str, float]:
    return {"L1": 100.0}


def watched(levels: list[float], stuck: Callable[[], Mapping[str, float]] = found) -> tuple[Still, list[float]]:
    """What watches ``levels``, one a second from 100 s on, and when the level was said to stand still."""
    still, said = Still(D, stuck), []
    for k, level in enumerate(levels):
        still.take(shown(100.0 + k, level))
        still.judge(100.0 + k)
        said += [100.0 + k] if still.symptoms else []
    return still, said


def moving(count: int) -> list[float]:
    return [10.0 + float(n) for n in NOISE[:count]]


def test_it_is_said_as_soon_as_its_rule_says_so_and_with_its_name() -> None:
    still, said = watched([*moving(20), *[10.0] * 30])
    assert said[0] == 120.0 + LONGEST_S
    (symptom,) = still.symptoms
    assert (symptom.rule, symptom.threshold) == (repeats("L1"), LONGEST_S) and symptom.severity >= 1.0


def test_it_is_none_where_the_readings_of_the_last_minutes_do_not_show_it() -> None:
    """A tank that is empty shows nothing but zeros; nor is that asked each second."""
    asked: list[int] = []

    def not_stuck() -> Mapping[str, float]:
        asked.append(1)
        return {}

    _, said = watched([*moving(20), *[0.0] * 100], not_stuck)
    assert said == [] and 2 <= len(asked) <= 15


def test_it_is_over_with_the_first_reading_that_moves_and_known_to_be_after_some() -> None:
    still, said = watched([*moving(20), *[10.0] * 30, *moving(MOVING - 1)])
    assert said[-1] == 149.0 and still.symptoms == ()
    assert still.moves_since("L1", 120.0) is None and still.stands("L1", 120.0)
    still.take(shown(200.0, 10.5))
    assert still.moves_since("L1", 120.0) == 150.0 and not still.stands("L1", 120.0)
    assert still.moves_since("L1", 160.0) is None, "of something that began later that says nothing"


def test_one_that_sticks_again_and_again_is_believed_to_move_after_longer_and_longer() -> None:
    again = [*[10.0] * 15, *moving(MOVING)]
    still, _ = watched([*moving(20), *again, *again, *again])
    assert still.moves_since("L1", 100.0) is None and still.stands("L1", 100.0)
    still, _ = watched([*moving(20), *again, *moving(400), *[10.0] * 15, *moving(MOVING)])
    assert still.moves_since("L1", 100.0) is not None, "what was long ago is not held against it"


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_reading_that_is_none_neither_begins_nor_ends_it(value: float) -> None:
    still, _ = watched([*moving(20), *[10.0] * 30, value, value])
    assert [s.rule for s in still.symptoms] == [repeats("L1")]
    assert watched([value] * 50)[1] == [] and watched([])[1] == []


def test_a_reading_that_is_marked_bad_says_nothing() -> None:
    still = Still(D, found)
    for k in range(60):
        still.take(Snapshot(100.0 + k, {"L1": 10.0}, frozenset({"L1"})))
        still.judge(100.0 + k)
    assert still.symptoms == ()


def test_what_the_guard_has_called_frozen_stands_still_from_then_on() -> None:
    still, _ = watched(moving(20))
    still.take(replace(shown(120.0, 10.0), bad=frozenset({"L1"}), frozen_s={"L1": 110.0}))
    still.judge(120.0)
    (symptom,) = still.symptoms
    assert symptom.rule == repeats("L1") and still.stands("L1", 110.0)
    for k, level in enumerate(moving(MOVING)):
        still.take(shown(121.0 + k, level))
    assert still.symptoms == () and still.moves_since("L1", 110.0) == 121.0


def test_an_analyser_between_two_samples_makes_no_old_picture() -> None:
    sampled = replace(D, qualities={tag: replace(rule, every_s=30.0) for tag, rule in D.qualities.items()})
    picture, every = Picture(sampled), Picture(D)
    seen = [shown(100.0 + k, 10.0, T1=1.0) for k in range(3)]
    still = [replace(each, values={**each.values, "T1": 310.0}) for each in seen]
    assert [picture.repeats(each) for each in still] == [False, False, False]
    assert [every.repeats(each) for each in still] == [False, True, True]


def test_one_that_comes_seldom_or_has_fallen_silent_repeats_nothing() -> None:
    """The link shows its last value again, with the time at which that was taken."""
    still = Still(D, found)
    for k, level in enumerate(moving(200)):
        taken_s = 100.0 + 30.0 * (k // 30)
        still.take(shown(100.0 + k, level if k % 30 == 0 else 10.0, L1=taken_s))
        still.judge(100.0 + k)
        assert still.symptoms == ()


def test_two_equal_readings_with_a_gap_between_are_no_instrument_that_stands_still() -> None:
    still = Still(D, found)
    for at_s, level in ((100.0, 10.0), (101.0, 10.1), (131.0, 10.1), (161.0, 10.1)):
        still.take(shown(at_s, level))
        still.judge(at_s)
    assert still.symptoms == ()


def test_what_has_no_noise_or_no_time_in_the_tables_is_not_watched() -> None:
    lax = replace(D, qualities={"L1": replace(RULE, frozen_s=None), "T1": replace(D.qualities["T1"], noise=None)})
    still = Still(lax, found)
    for k in range(200):
        still.take(Snapshot(100.0 + k, {"L1": 10.0, "T1": 310.0}))
        still.judge(100.0 + k)
    assert still.symptoms == ()


def test_a_picture_in_which_anything_measured_moves_is_no_old_one() -> None:
    """All that has noise at rest may be stuck at once: a flow without it moves."""
    picture, noisy = Picture(D), {tag: 1.0 for tag, rule in D.qualities.items() if rule.frozen_s}
    assert not picture.repeats(Snapshot(1.0, noisy | {"F1": 0.02}))
    assert picture.repeats(Snapshot(2.0, noisy | {"F1": 0.02}))
    assert not picture.repeats(Snapshot(3.0, noisy | {"F1": 0.03}))
    assert not Picture(D).repeats(Snapshot(1.0, {})), "nothing was seen yet"


def test_old_pictures_count_for_no_instrument() -> None:
    still = Still(D, found)
    for k in range(60):
        still.passed_over(shown(100.0 + k, 10.0))
    still.take(shown(161.0, 10.0))
    still.judge(161.0)
    assert still.symptoms == ()


# --- a reactor of which an instrument sticks ------------------------------------------------------------------------


class Seen:
    """Monitoring with a twin that is shown a true reactor as recovery is: as the instruments say."""

    def __init__(self) -> None:
        plant = reactor()
        self.twin = Twin(plant.model, plant.description, plant.twin, 401)
        rules = replace(plant.description, features=(), symptom_rules=())
        self.monitoring = TwinMonitoring(self.twin, NoGraph(), rules, {}, plant.started, plant.monitoring)  # type: ignore[arg-type]

    def watch(self, snapshots: tuple[Snapshot, ...]) -> list[float]:
        """When it asks; each time it is asked for its diagnosis, and the plant is left alone."""
        asked = []
        for snapshot in snapshots:
            noticed = self.monitoring.notices(snapshot)
            if snapshot.at_s == 1400.0:
                self.twin.calibrate(LEARN_S)
            if noticed:
                asked.append(snapshot.at_s)
                told = self.monitoring.diagnose()
                self.told.append((snapshot.at_s, told.hypotheses[0].name if told.faulty else "none", told.ended_s))
                if told.faulty:
                    self.monitoring.follow(NoActionNeeded(snapshot.at_s, 0.1))
        return asked

    @functools.cached_property
    def told(self) -> list[tuple[float, str, float | None]]:
        return []


@pytest.mark.parametrize("tag", ["L1", "T1", "V2.pos"])
def test_it_is_named_as_soon_as_its_rule_says_so_without_any_feature(tag: str) -> None:
    seen = Seen()
    asked = seen.watch(disturbed(401, 1900, f"{tag} frozen from 1850", mismatch="plant"))
    rule = D.qualities[tag]
    assert asked and 0.0 <= asked[0] - 1850.0 - (rule.frozen_s or 0.0) <= 6.0, (
        "it is coarse, and repeats itself by luck"
    )
    assert seen.told[0][1] == f"{tag}_frozen"


def test_when_it_moves_again_it_is_over_and_said_once() -> None:
    seen = Seen()
    seen.watch(disturbed(401, 2400, "L1 frozen from 1850 to 1900", mismatch="plant"))
    over = [(at_s, since_s) for at_s, _, since_s in seen.told if since_s is not None]
    assert len(over) == 1 and over[0][0] < 1930.0 and over[0][1] == pytest.approx(1901.0, abs=1.0)
    assert [name for at_s, name, _ in seen.told if at_s > over[0][0]].count("L1_frozen") == 0


def test_two_are_named_together_and_each_is_over_by_itself() -> None:
    seen = Seen()
    seen.watch(disturbed(401, 2100, "L1 frozen from 1850 to 1950", "T3 frozen from 1900", mismatch="plant"))
    names = [name for _, name, _ in seen.told]
    assert names[0] == "L1_frozen" and {*names[1].split("+")} == {"L1_frozen", "T3_frozen"}
    assert names[-1] == "T3_frozen" and all(since_s is None for *_, since_s in seen.told)


@pytest.mark.parametrize("over", [True, False])
def test_what_was_known_beside_one_that_is_stuck_may_end(monkeypatch: pytest.MonkeyPatch, over: bool) -> None:
    """Nobody asked as long as an instrument stood still, and a leak that was mended never ended."""
    seen, asked = Seen(), list[tuple[object, ...]]()

    def ended(self: Twin, known: object, from_s: float, beside: object = ()) -> Ended | None:
        asked.append((known, beside))
        return Ended(1840.0, True) if over else None

    seen.watch(disturbed(401, 1900, "T3 frozen from 1650", mismatch="plant"))
    (stuck,), leak = seen.monitoring._known, FaultState("leak", 0.005, 1700.0)
    seen.monitoring._known = (stuck, leak)
    seen.monitoring._said = (Hypothesis((stuck, leak), 0.7), Hypothesis((stuck,), 0.2))
    monkeypatch.setattr(Twin, "ended", ended)
    told = seen.monitoring.diagnose()
    assert asked == [([(leak,)], (stuck,))]
    assert told.faulty and told.hypotheses[0].name == "T3_frozen" and told.ended_s is None
    if over:
        assert seen.monitoring._known == (told.hypotheses[0].faults[0],)


def test_a_healthy_reactor_has_none() -> None:
    assert Seen().watch(disturbed(402, 2400)) == []


def test_one_that_sticks_is_seen_also_in_the_transient_of_a_release() -> None:
    seen = Seen()
    snapshots = disturbed(401, 1900, "L1 frozen from 1850", mismatch="plant")
    assert seen.watch(snapshots[:1840]) == []
    seen.monitoring.follow(Released(RELEASED, 1840.0))
    assert seen.watch(snapshots[1840:])[0] <= 1866.0


def test_an_instrument_that_was_stuck_most_of_the_time_is_no_coarse_one() -> None:
    history = History(D.variables, reactor().model.inputs)
    often = [f"L1 frozen from {1600 + 60 * k} to {1645 + 60 * k}" for k in range(5)]
    for snapshot in disturbed(401, 1920, *often, "L1 frozen from 1900"):
        history.append(snapshot)
    assert [(f.tag, f.what) for f in flat_lines(history.window(320), D)] == [("L1", What.FROZEN)]


def test_where_the_level_is_follows_from_what_flows_and_not_from_a_reading_that_stands_still() -> None:
    """Its loop is held by the stuck reading, and the level has run away for longer than a forecast looks back."""
    seen = disturbed(401, 2900, "L1 frozen from 1850")
    plant = reactor()
    twin = Twin(plant.model, plant.description, plant.twin, 401)
    for snapshot in seen:
        twin.observe(snapshot)
        if snapshot.at_s == 1400.0:
            twin.calibrate(LEARN_S)
    known = twin.explain([], (FaultState("L1_frozen", 1.0, 1850.0),), since_s=1860.0, news=True)
    (errors,) = twin.instrument_errors(known[:1])
    fed = [s.values["F1"] - s.values["F2"] for s in seen[1850:]]
    assert known[0].name == "L1_frozen"
    assert errors["L1"] == pytest.approx(-sum(fed), abs=0.35 + 0.25 * abs(sum(fed)))


def test_nothing_is_followed_without_a_position() -> None:
    assert not Followed(D, []).disobeyed("S-V1-OFF")
