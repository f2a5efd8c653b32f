"""Recorded answers of the published module on ours: what was right there passes, what was wrong there does not."""

from __future__ import annotations

import functools
from collections import Counter

import pytest

from benchmarks.mixing_calls import BYPASSED, FAULTS, FOLDER, Answer, answers, route
from benchmarks.mixing_replay import judged, rows

pytestmark = pytest.mark.reference("the recorded answers of others' models", FOLDER)


@functools.cache
def recorded() -> Counter[Answer]:
    return answers()


def of(agent: str, correct: bool) -> list[Answer]:
    return sorted(a for a in recorded() if a.agent == agent and a.correct is correct)


def test_every_record_is_read_and_every_name_is_known() -> None:
    assert sum(n for a, n in recorded().items() if a.agent == "planning") == 688
    assert sum(n for a, n in recorded().items() if a.agent == "action") == 838
    assert {a.fault for a in recorded()} == set(FAULTS)
    assert {a.state for a in recorded()} <= {s for fault in FAULTS for s in route(fault)}


def test_the_key_is_the_published_rule() -> None:
    """Right is what follows on the route; a plan that skips, stays, or takes the wrong line is wrong."""
    for answer in recorded():
        if answer.agent == "planning":
            assert answer.correct == answer.on_the_way, answer
    assert len(of("planning", False)) == 8 and {a.fault for a in of("planning", False)} > set(BYPASSED)


def test_every_wrong_plan_is_refused() -> None:
    found = {answer: judged(answer) for answer in of("planning", False)}
    assert not [a for a, j in found.items() if j.accepted]
    physical = {a.fault: j.findings for a, j in found.items() if j.causes == ("rollout",)}
    assert set(physical) == {"clogging_fault", "pump_degradation"}, "the graph takes the main line away for the others"
    assert all("LIM-P101-IDLE" in names for names in physical.values())


@pytest.mark.parametrize("number", range(0, 24, 4))
def test_actuators_too_many_are_refused(number: int) -> None:
    wrong = of("action", False)
    judgement = judged(wrong[number % len(wrong)])
    assert judgement.asked and not judgement.accepted and "state" in judgement.causes


@pytest.mark.parametrize("number", [0, 11, 23, 31, 40])
def test_right_plans_and_actuators_are_accepted(number: int) -> None:
    plans, actuators = of("planning", True), [a for a in of("action", True) if a.on_the_way]
    for answer in (plans[number % len(plans)], actuators[number % len(actuators)]):
        assert judged(answer).accepted, answer


def test_the_table_counts_answers_not_kinds_of_them() -> None:
    some = [(a, recorded()[a], judged(a)) for a in (of("planning", False)[0], of("planning", True)[0])]
    lines = rows(some)
    assert [line[:2] for line in lines] == [("planning", "right"), ("planning", "wrong")]
    assert [line[3] for line in lines] == [some[1][1], some[0][1]] and [bool(line[4]) for line in lines] == [
        True,
        False,
    ]
