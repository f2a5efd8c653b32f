"""Whatever stands in the list says how likely it is to violate a limit, by the same draws; nothing waits for that."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import replace

import pytest

from homeostat.agents.certificates import interval
from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.certificate import Certificate
from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.events.recovery import Compared
from homeostat.domain.recovery import ActionSet
from homeostat.domain.request import Answer, Request, RequestStatus
from homeostat.domain.verdict import Rollout, RolloutResult
from homeostat.guard.requests.permissives import refusal
from homeostat.process.batch import ProcessError
from homeostat.recovery.bounds import RiskBounds
from homeostat.recovery.plant_rules import Bounds
from homeostat.twin.twin import Interruption
from tests.recovery.desk import Recovery
from tests.recovery.line import GOOD, LineTwin
from tests.recovery.rivals import LATENCY, by, doomed

LISTED = RiskBounds().listed


class ListedTwin(LineTwin):
    """Notes how many draws are made for a list; what becomes of these may be something else than usual."""

    def __init__(self) -> None:
        super().__init__()
        self.drawn: list[tuple[str, int]] = []
        self.holds, self.raises = threading.Event(), False
        self.holds.set()
        self.breaks: ActionSet | None = None

    def frozen(self) -> ListedTwin:
        return self

    def sampled(self, hypotheses: Sequence[Hypothesis], count: int, name: str) -> int:
        if name.startswith("list/"):
            self.drawn.append((name, count))
            self.holds.wait(10.0)
            if self.raises:
                raise ProcessError("a draw cannot be where the plant is")
        return count

    def roll_out(
        self,
        actions: ActionSet,
        hypotheses: Sequence[Hypothesis],
        ended: Interruption | None = None,
        members: int | None = None,
    ) -> Rollout:
        made = super().roll_out(actions, hypotheses, ended, members)
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


def test_draws_that_cannot_be_made_cost_no_release() -> None:
    twin = ListedTwin()
    twin.raises = True
    done = doomed(GOOD, line=twin).run()
    assert by(done) == [("scripted", GOOD.digest)]
    assert all(a.certificate is None for a in listed(done).values())
