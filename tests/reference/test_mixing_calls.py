"""Answers recorded on the published module, said on ours: what was right there passes, what was wrong there does not.

The answers that are said here stand here; that they are those of the records is compared where the records are.
"""

from __future__ import annotations

import functools
from collections import Counter

import pytest

from benchmarks.mixing_calls import BYPASSED, FAULTS, FOLDER, Answer, answers, route
from benchmarks.mixing_replay import Judgement, rows
from benchmarks.mixing_replay import judged as say

RECORDED = pytest.mark.reference(
    "the recorded answers of others' models (the other tests of this module have some of them)", FOLDER
)


def planned(fault: str, state: str, target: str, correct: bool) -> Answer:
    """A plan in ``state``."""
    return Answer("planning", fault, state, target, (), correct)


def switched(fault: str, state: str, target: str, on: str, correct: bool) -> Answer:
    """Actuators for ``target``: those of ``on``."""
    return Answer("action", fault, state, target, tuple(f"{name}.cmd" for name in on.split()), correct)


WRONG_PLANS = tuple(
    planned(*names, correct=False)
    for names in (
        ("clogging_fault", "filling_B203", "emptying_B201"),
        ("leak", "filling_B201", "filling_B201"),
        ("leak", "filling_B203", "emptying_B201"),
        ("pump_degradation", "filling_B203", "emptying_B201"),
        ("pump_failure", "filling_B201", "filling_B201"),
        ("pump_failure", "filling_B203", "emptying_B201"),
        ("sensor_fault", "filling_B202", "emptying_B201"),
        ("sensor_fault", "filling_B202", "emptying_B203"),
    )
)
"""Every wrong plan of both studies."""
WRONG_ACTUATORS = tuple(
    switched(*names, correct=False)
    for names in (
        ("clogging_fault", "bypass_emptying_B203", "emptying_B204", "P101 VI204 VO204"),
        ("leak", "idle", "filling_B201", "P101 VI201 VI204"),
        ("normal", "idle", "filling_B201", "P101 VI201 VI204"),
        ("pump_degradation", "idle", "filling_B201", "P101 VI204 VO201"),
        ("pump_failure", "idle", "filling_B201", "VI201 VI204"),
        ("sensor_fault", "idle", "filling_B201", "VI204 VO201"),
    )
)
"""Some of 21: one of each fault."""
RIGHT_STEPS = (
    ("clogging_fault", "bypass_emptying_B201", "bypass_emptying_B202", "P102 VI204 VO202"),
    ("leak", "filling_B202", "filling_B203", "VI203"),
    ("pump_degradation", "bypass_emptying_B203", "emptying_B204", "VO204"),
    ("pump_failure", "filling_B201", "filling_B202", "VI202"),
    ("sensor_fault", "filling_B203", "emptying_B201", "P101 VI204 VO201"),
)
"""Some of 42 right plans, each with the right actuators."""


def right(fault: str, state: str, target: str, on: str) -> tuple[Answer, Answer]:
    """The plan and the actuators of a right step."""
    return planned(fault, state, target, correct=True), switched(fault, state, target, on, correct=True)


@functools.cache
def judged(answer: Answer) -> Judgement:
    """What becomes of an answer; each is said once."""
    return say(answer)


@functools.cache
def recorded() -> Counter[Answer]:
    return answers()


def of(agent: str, correct: bool) -> list[Answer]:
    return sorted(a for a in recorded() if a.agent == agent and a.correct is correct)


@RECORDED
def test_every_record_is_read_and_every_name_is_known() -> None:
    assert sum(n for a, n in recorded().items() if a.agent == "planning") == 688
    assert sum(n for a, n in recorded().items() if a.agent == "action") == 838
    assert {a.fault for a in recorded()} == set(FAULTS)
    assert {a.state for a in recorded()} <= {s for fault in FAULTS for s in route(fault)}


@RECORDED
def test_the_answers_of_this_module_are_those_of_the_records() -> None:
    wrong, plans, actuators = (of("action", False), of("planning", True), of("action", True))
    on_the_way = [a for a in actuators if a.on_the_way]
    assert tuple(of("planning", False)) == WRONG_PLANS
    assert (len(wrong), len(plans), len(on_the_way)) == (21, 42, 42)
    assert tuple(wrong[::4]) == WRONG_ACTUATORS
    numbers = (0, 11, 23, 31, 40)
    assert [(plans[n], on_the_way[n]) for n in numbers] == [right(*step) for step in RIGHT_STEPS]


@RECORDED
def test_the_key_is_the_published_rule() -> None:
    """Right is what follows on the route; a plan that skips, stays, or takes the wrong line is wrong."""
    for answer in recorded():
        if answer.agent == "planning":
            assert answer.correct == answer.on_the_way, answer


def test_the_answers_of_this_module_follow_the_published_rule() -> None:
    plans = [*WRONG_PLANS, *(right(*step)[0] for step in RIGHT_STEPS)]
    assert all(answer.correct == answer.on_the_way for answer in plans)
    assert len(WRONG_PLANS) == 8 and {a.fault for a in WRONG_PLANS} > set(BYPASSED)


@pytest.mark.wide
def test_every_wrong_plan_is_refused() -> None:
    found = {answer: judged(answer) for answer in WRONG_PLANS}
    assert not [a for a, j in found.items() if j.accepted]
    physical = {a.fault: j.findings for a, j in found.items() if j.causes == ("rollout",)}
    assert set(physical) == {"clogging_fault", "pump_degradation"}, "the graph takes the main line away for the others"
    assert all("LIM-P101-IDLE" in names for names in physical.values())


@pytest.mark.parametrize(
    "wrong",
    [
        pytest.param(a, id=a.fault, marks=[pytest.mark.slow] if a.fault == "clogging_fault" else [])
        for a in WRONG_ACTUATORS
    ],
)
def test_actuators_too_many_are_refused(wrong: Answer) -> None:
    judgement = judged(wrong)
    assert judgement.asked and not judgement.accepted and "state" in judgement.causes


@pytest.mark.slow
@pytest.mark.parametrize(
    "step",
    [RIGHT_STEPS[3], *(pytest.param(step, marks=pytest.mark.wide) for step in RIGHT_STEPS if step != RIGHT_STEPS[3])],
    ids=lambda step: step[0],
)
def test_right_plans_and_actuators_are_accepted(step: tuple[str, str, str, str]) -> None:
    """The plan is said by the key on the way to the actuators: what approves these has approved it as well."""
    _, actuators = right(*step)
    assert judged(actuators).accepted


@pytest.mark.wide
def test_the_table_counts_answers_not_kinds_of_them() -> None:
    accepted, refused = right(*RIGHT_STEPS[3])[0], WRONG_PLANS[0]
    assert judged(accepted).accepted
    lines = rows([(refused, 3, judged(refused)), (accepted, 7, judged(accepted))])
    assert [line[:2] for line in lines] == [("planning", "right"), ("planning", "wrong")]
    assert [line[3] for line in lines] == [7, 3] and [bool(line[4]) for line in lines] == [True, False]
