"""Whatever stands in the list says how likely it is to violate a limit, by the same draws; nothing waits for that."""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Sequence
from dataclasses import replace

import pytest

from homeostat.agents.certificates import interval
from homeostat.agents.simulation import TwinSimulation
from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.certificate import Certificate
from homeostat.domain.cost import Cost
from homeostat.domain.diagnosis import Diagnosis, Hypothesis
from homeostat.domain.events.recovery import Compared
from homeostat.domain.recovery import ActionSet
from homeostat.domain.request import Answer, Request, RequestStatus
from homeostat.domain.verdict import Rollout, RolloutResult
from homeostat.guard.requests.permissives import refusal
from homeostat.journal.memory import MemoryTrace
from homeostat.process.batch import ProcessError
from homeostat.recovery.alternatives import Alternatives
from homeostat.recovery.bounds import RiskBounds
from homeostat.recovery.certifying import Certifying
from homeostat.recovery.plant_rules import Bounds
from homeostat.recovery.scene import Scene
from homeostat.twin.twin import Interruption
from tests.recovery.desk import AT_ONCE, Graph, Recovery, ScriptedDesk, ticks
from tests.recovery.line import BAD, GOOD, LIMITS, TAGS, LineTwin, priced
from tests.recovery.rivals import LATENCY, by, doomed
from tests.safety.world import reading

LISTED = RiskBounds().listed
NOTHING = Diagnosis(10.0, (), (Hypothesis((), 1.0),))


class ListedTwin(LineTwin):
    """Notes how many draws are made for a list; what becomes of these may be something else than usual."""

    def __init__(self) -> None:
        super().__init__()
        self.drawn: list[tuple[str, int]] = []
        self.holds = threading.Event()
        self.raises: Exception | None = None
        self.holds.set()
        self.breaks: ActionSet | None = None
        self.hangs_after = math.inf

    def frozen(self) -> ListedTwin:
        return self

    def sampled(self, hypotheses: Sequence[Hypothesis], count: int, name: str) -> int:
        if name.startswith("list/"):
            self.drawn.append((name, count))
            self.holds.wait(10.0)
            if self.raises is not None:
                raise self.raises
        return count

    def roll_out(
        self,
        actions: ActionSet,
        hypotheses: Sequence[Hypothesis],
        ended: Interruption | None = None,
        members: int | None = None,
    ) -> Rollout:
        made = super().roll_out(actions, hypotheses, ended, members)
        if members == LISTED:
            self.hangs_after -= 1
            if self.hangs_after < 0:
                time.sleep(2.0)
        if members == LISTED and actions == self.breaks:
            return replace(made, result=RolloutResult.BROKE_DOWN, weights=())
        return made


def listed(done: Recovery) -> dict[AlternativeKind, Alternative]:
    (compared,) = done.trace.of(Compared)
    return {a.kind: a for a in compared.alternatives}


def test_each_alternative_has_a_certificate_by_the_same_draws() -> None:
    twin = ListedTwin()
    found = listed(doomed(GOOD, line=twin).run())
    assert twin.drawn == [("list/1", LISTED)], "asked once for all of them"
    runs_hot, good = found[AlternativeKind.LEAVE].certificate, found[AlternativeKind.RELEASE].certificate
    assert runs_hot == Certificate(LISTED, LISTED, 1.0, 0.95)
    assert good == Certificate(LISTED, 0, interval(LISTED, 0, 0.95, 0.01)[1], 0.95)
    falls = found[AlternativeKind.FALLBACK].certificate
    assert falls is not None and falls.violations == 0
    assert not found[AlternativeKind.LEAVE].admitted, "what may not be done has one as well"


def test_what_is_compared_again_is_not_drawn_for_again() -> None:
    """The guard refuses for the moment: the list is the same."""
    twin = ListedTwin()
    done = doomed(GOOD, line=twin)
    ask, left = done.desk.ask, [1]

    async def without_a_lease(request: Request, within_s: float) -> Answer:
        answer = await ask(request, within_s)
        if not left[0]:
            return answer
        left[0] -= 1
        return replace(answer, status=RequestStatus.REFUSED, finding=refusal("CHK-LEASE", "the lease is over"))

    done.desk.ask = without_a_lease  # type: ignore[method-assign]
    done.run()
    first, second = done.trace.of(Compared)
    assert first == second and len(twin.drawn) == 1 and by(done) == [("scripted", GOOD.digest)]


@pytest.mark.parametrize("risk", [RiskBounds(listed=0), RiskBounds(most=0)])
def test_nothing_is_drawn_where_nothing_is_to_be_certified(risk: RiskBounds) -> None:
    twin = ListedTwin()
    done = doomed(GOOD, line=twin, bounds=Bounds(risk=risk)).run()
    assert by(done) == [("scripted", GOOD.digest)] and twin.drawn == []
    assert all(a.certificate is None for a in listed(done).values())


def test_a_release_does_not_wait_for_what_people_are_to_read() -> None:
    twin = ListedTwin()
    twin.holds.clear()
    try:
        done = doomed(GOOD, line=twin, bounds=LATENCY).run()
    finally:
        twin.holds.set()
    assert by(done) == [("scripted", GOOD.digest)] and done.handed_over == []
    assert all(a.certificate is None for a in listed(done).values())


def test_what_the_twin_cannot_roll_out_has_no_certificate_and_the_rest_has() -> None:
    twin = ListedTwin()
    twin.breaks = GOOD
    found = listed(doomed(GOOD, line=twin).run())
    assert found[AlternativeKind.RELEASE].certificate is None
    assert found[AlternativeKind.LEAVE].certificate is not None


def test_what_is_in_when_time_is_over_stands_in_the_list() -> None:
    twin = ListedTwin()
    twin.hangs_after = 1
    found = listed(doomed(GOOD, line=twin, bounds=LATENCY).run())
    assert found[AlternativeKind.LEAVE].certificate is not None, "it was counted first"
    assert found[AlternativeKind.RELEASE].certificate is None


def test_draws_that_cannot_be_made_cost_no_release() -> None:
    twin = ListedTwin()
    twin.raises = ProcessError("a draw cannot be where the plant is")
    done = doomed(GOOD, line=twin).run()
    assert by(done) == [("scripted", GOOD.digest)] and done.alarms == []
    assert all(a.certificate is None for a in listed(done).values())


@pytest.mark.parametrize("bug", [MemoryError("no room"), ZeroDivisionError("a mean of nothing")])
def test_what_people_are_only_to_read_ends_no_recovery(bug: Exception) -> None:
    twin = ListedTwin()
    twin.raises = bug
    done = doomed(GOOD, line=twin).run()
    assert by(done) == [("scripted", GOOD.digest)] and done.handed_over == []
    assert all(a.certificate is None for a in listed(done).values())
    assert done.alarms == [("recovery:certificates", f"risks of what could be done are not known: {bug!r}")]


def test_a_fallback_that_is_to_act_waits_for_no_certificate() -> None:
    twin = ListedTwin()
    done = doomed(BAD, line=twin, bounds=AT_ONCE).run()
    assert len(done.handed_over) == 1 and twin.drawn == []


def test_nothing_is_drawn_when_time_is_over() -> None:
    twin = ListedTwin()
    twin.observe(reading(50.0))
    simulation = TwinSimulation(twin, TAGS, LIMITS)  # type: ignore[arg-type]
    alternatives = Alternatives([(Alternative(AlternativeKind.LEAVE, "running", Cost((), 1.0)), None)], priced(LIMITS))

    async def late() -> None:
        scene = Scene(ScriptedDesk(ticks(1, 2)), simulation, Graph(), MemoryTrace())  # type: ignore[arg-type]
        scene.take(ticks(1, 2))
        await Certifying(scene, simulation, RiskBounds()).add_to(alternatives, NOTHING, -1.0)

    asyncio.run(late())
    assert twin.drawn == [] and alternatives.event("").alternatives[0].certificate is None
