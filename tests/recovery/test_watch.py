"""Watch: one diagnosis at a time, and whose question an answer that comes late belongs to."""

from __future__ import annotations

import asyncio
import threading

import pytest

from homeostat.domain.diagnosis import Diagnosis
from homeostat.recovery.look.watch import Watch
from tests.agents.scripted import ScriptedMonitoring, diagnosis

HANGS_S = 30.0


class Held(ScriptedMonitoring):
    """Monitoring whose first diagnosis takes until the test lets it go; it notices how many think at a time."""

    def __init__(self) -> None:
        super().__init__(answer=self._held)
        self.let_go = threading.Event()
        self.thinking = self.most = 0

    def _held(self, at_s: float) -> Diagnosis:
        self.thinking += 1
        self.most = max(self.most, self.thinking)
        self.let_go.wait(HANGS_S)
        self.thinking -= 1
        return diagnosis(float(len(self.diagnosed)))


async def late(watch: Watch) -> None:
    with pytest.raises(TimeoutError):
        await watch.diagnose(False, 0.01)


def test_who_asks_again_while_it_thinks_gets_the_same_answer() -> None:
    monitoring = Held()

    async def ask() -> Diagnosis:
        watch = Watch(monitoring)
        await late(watch)
        monitoring.let_go.set()
        return await watch.diagnose(False, HANGS_S)

    assert asyncio.run(ask()).at_s == 1.0 and len(monitoring.diagnosed) == 1


def test_what_was_forgotten_while_it_thinks_is_waited_for_and_asked_anew() -> None:
    monitoring = Held()

    async def ask() -> Diagnosis:
        watch = Watch(monitoring)
        await late(watch)
        watch.forget()
        asyncio.get_running_loop().call_later(0.01, monitoring.let_go.set)
        return await watch.diagnose(True, HANGS_S)

    assert asyncio.run(ask()).at_s == 2.0 and monitoring.deviations == [False, True] and monitoring.most == 1


def test_a_diagnosis_is_taken_once() -> None:
    monitoring = Held()
    monitoring.let_go.set()

    async def ask() -> list[float]:
        watch = Watch(monitoring)
        return [(await watch.diagnose(False, HANGS_S)).at_s for _ in range(2)]

    assert asyncio.run(ask()) == [1.0, 2.0]


def test_a_bug_in_a_diagnosis_belongs_to_who_asked_and_the_next_question_is_a_new_one() -> None:
    monitoring = ScriptedMonitoring(bug=RuntimeError("a bug"))

    async def ask() -> None:
        watch = Watch(monitoring)
        for _ in range(2):
            with pytest.raises(RuntimeError, match="a bug"):
                await watch.diagnose(False, HANGS_S)

    asyncio.run(ask())
    assert len(monitoring.diagnosed) == 2
