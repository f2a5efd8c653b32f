"""How old the page is: a service that says nothing, nothing new, or nonsense leaves no reading fresh."""

from __future__ import annotations

import json
import math
import threading
from collections.abc import Mapping
from typing import Any

import pytest

from homeostat.console.readings import Gathered
from homeostat.console.watched import OLD_S, ServiceSilent, Watched

UP = {"link": {"trouble": ""}, "thinking": {"process": 7, "reason": ""}}


class Service:
    """What a service answers, and a clock that is set by hand."""

    def __init__(self) -> None:
        self.now, self.answer = 100.0, dict[str, Any]()
        self.silent = ""
        self.gathered = Gathered(["T", "V"])
        self.watched = Watched(self.ask, self.gathered, lambda: self.now)

    def ask(self) -> Mapping[str, Any]:
        if self.silent:
            raise ServiceSilent(self.silent)
        return self.answer

    def says(self, at_s: float, age_s: float, **more: Any) -> None:
        values = {"T": 300.0 + at_s, "V": None}
        self.answer = {**UP, "sample": {"at_s": at_s, "age_s": age_s, "values": values}, **more}
        self.watched.look()


def test_fresh_readings_are_gathered_with_their_age() -> None:
    service = Service()
    assert service.watched.fresh.old and "not asked yet" in service.watched.fresh.trouble
    for second in range(3):
        service.says(float(second), 0.4)
    fresh = service.watched.fresh
    assert (fresh.age_s, fresh.old, fresh.trouble, fresh.thinking) == (0.4, False, "", "")
    readings = service.gathered.readings()
    assert readings is not None and readings.at(2.0) == (
        2.0,
        {"T": 302.0, "V": pytest.approx(float("nan"), nan_ok=True)},
    )


def test_a_service_that_falls_silent_makes_its_readings_old() -> None:
    service = Service()
    service.says(1.0, 0.0)
    service.silent = "no service runs in 'live'"
    service.watched.look()
    assert not service.watched.fresh.old
    service.now += OLD_S + 0.1
    fresh = service.watched.fresh
    assert fresh.old and fresh.age_s == pytest.approx(OLD_S + 0.1) and fresh.trouble == "no service runs in 'live'"
    service.silent = ""
    service.says(9.0, 0.2)
    assert not service.watched.fresh.old


def test_a_service_that_answers_without_new_samples_is_no_better() -> None:
    service = Service()
    service.says(1.0, OLD_S + 3.0, link={"trouble": "refused"})
    assert service.watched.fresh.old and service.watched.fresh.trouble == "no connection to the plant: refused"
    service.says(1.0, OLD_S + 3.0)
    assert service.watched.fresh.trouble == "no sample comes from the plant"


def test_before_the_first_sample_everything_is_old() -> None:
    service = Service()
    service.answer = {**UP, "sample": None}
    service.watched.look()
    assert service.watched.fresh.old and service.watched.fresh.age_s is None


def sampled(at_s: Any, age_s: Any, value: Any) -> dict[str, Any]:
    return {"sample": {"at_s": at_s, "age_s": age_s, "values": {"T": value}}}


@pytest.mark.parametrize(
    "nonsense",
    [{"sample": {}}, {"sample": 3}, sampled("soon", 0.0, 1.0), sampled(1.0, "soon", 1.0), sampled(1.0, math.nan, 1.0),
     sampled(math.inf, 0.0, 1.0), sampled(10**400, 0.0, 1.0), sampled(1.0, 0.0, 10**400), {"link": "up"},
     {"sample": None, "thinking": 3}],
)  # fmt: skip
def test_an_answer_that_cannot_be_read_is_said_and_ends_nothing(nonsense: dict[str, Any]) -> None:
    service = Service()
    service.answer = {**UP, **nonsense}
    service.watched.look()
    assert service.watched.fresh.old and "cannot be read" in service.watched.fresh.trouble
    service.says(4.0, 0.1)
    assert not service.watched.fresh.old


def test_a_plant_that_nobody_thinks_about_is_said() -> None:
    service = Service()
    service.says(1.0, 0.0, thinking={"process": None, "reason": "it was killed"})
    assert service.watched.fresh.thinking == "it was killed"


def test_whatever_a_service_says_it_is_asked_again() -> None:
    answers = [b"[" * 100_000, b'{"sample": 1e999}', json.dumps({**UP, **sampled(3.0, 0.1, 2.0)}).encode()]
    enough = threading.Event()

    def ask() -> Mapping[str, Any]:
        if len(answers) == 1:
            enough.set()
        found: Mapping[str, Any] = json.loads(answers.pop(0) if len(answers) > 1 else answers[0])
        return found

    gathered = Gathered(["T"])
    watched = Watched(ask, gathered)
    watched.begin()
    assert enough.wait(20.0), "nobody asks any more"
    for _ in range(100):
        if not watched.fresh.old:
            break
        enough.clear()
        assert enough.wait(20.0)
    readings = gathered.readings()
    assert readings is not None and readings.at(3.0) == (3.0, {"T": 2.0})
