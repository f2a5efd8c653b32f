"""What is released carries a certificate; what violates a limit too often is not, however it was judged before."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import pytest

from homeostat.agents.roles import Approved
from homeostat.domain.cost import Cost
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Approve, Revise, Rollout, RolloutResult, circumstantial
from homeostat.guard.requests.seal import Sealer
from homeostat.process.batch import ProcessError
from homeostat.recovery.bounds import RiskBounds
from homeostat.recovery.release_check import FIRST, LATER, RISK, Checked, ReleaseCheck
from homeostat.twin.twin import Interruption
from tests.recovery.line import LIMITS, MACHINE, TAGS, LineTwin, feed

REDUCED = feed(0.01, "reduced")
PATH = RecoveryPath(MACHINE, (next(t for t in MACHINE.transitions if t.name == "reduce"),))
NOTHING = Diagnosis(10.0, (), (Hypothesis((), 1.0),))


class RiskyTwin(LineTwin):
    """Every so often a sampled member becomes too hot; what is judged never does."""

    def __init__(self, hot: Sequence[bool]) -> None:
        super().__init__(heating=0.0)
        self.hot, self.drawn = list(hot), list[str]()
        self.breaks = False

    def frozen(self) -> RiskyTwin:
        return self

    def sampled(self, hypotheses: Sequence[Hypothesis], count: int, name: str) -> int:
        self.drawn.append(name)
        return count

    def roll_out(
        self,
        actions: ActionSet,
        hypotheses: Sequence[Hypothesis],
        ended: Interruption | None = None,
        members: int | None = None,
    ) -> Rollout:
        made = super().roll_out(actions, hypotheses, ended, members)
        if members is None:
            return made
        if self.breaks:
            return replace(made, result=RolloutResult.BROKE_DOWN, note="member 3", weights=())
        signals = {tag: values.copy() for tag, values in made.trajectory.signals.items()}
        for member in range(members):
            if self.hot and self.hot.pop(0):
                signals["T"][member, -1] = 400.0
        return replace(made, trajectory=replace(made.trajectory, signals=signals))


def checked(twin: RiskyTwin, check: ReleaseCheck, at_s: float = 10.0, diagnosis: Diagnosis = NOTHING) -> Checked:
    from homeostat.domain.snapshot import Snapshot

    values = {"T": 300.0, "L": 8.0, "F": 0.01, "T.sp": 300.0, "F.sp": 0.01, "L.sp": 8.0, "V.man": math.nan}
    approval = Approve(REDUCED.digest, ())
    found = Approved(REDUCED, PATH, approval, "search", Cost((), 1.0))
    return check.check((Snapshot(at_s, values),), found, diagnosis)


def checking(twin: RiskyTwin, **risk: float) -> ReleaseCheck:
    bounds = RiskBounds(**{"required": 0.05, "level": 0.95, "most": 512, "batch": 32, **risk})  # type: ignore[arg-type]
    return ReleaseCheck(twin, LIMITS, TAGS, Sealer("check", b"key").seal, risk=bounds)  # type: ignore[arg-type]


def test_what_never_violates_a_limit_is_certified_as_soon_as_the_draws_suffice() -> None:
    twin = RiskyTwin([])
    found = checked(twin, checking(twin))
    assert isinstance(found.verdict, Approve) and found.request is not None
    certificate = found.verdict.certificate
    assert certificate is not None and certificate.violations == 0 and certificate.bound <= 0.05
    assert certificate.draws == 32 * len(twin.drawn) < 512, "it stops before all are drawn"
    assert certificate.level == pytest.approx(1.0 - 0.05 * FIRST)


def test_what_nothing_can_be_drawn_of_is_refused() -> None:
    """The last readings are no state of the model for one of the parameter sets."""

    class Breaking(RiskyTwin):
        def sampled(self, hypotheses: Sequence[Hypothesis], count: int, name: str) -> int:
            raise ProcessError("member 3 left the physical world")

    twin = Breaking([])
    found = checked(twin, checking(twin))
    assert isinstance(found.verdict, Revise) and found.request is None
    assert [f.criterion for f in found.verdict.violated] == ["CHK-ROLLOUT"]
    assert "member 3" in found.verdict.violated[0].message


def test_one_violation_takes_more_draws_and_many_end_them_early() -> None:
    rare = RiskyTwin([True])
    verdict = checked(rare, checking(rare)).verdict
    clean = RiskyTwin([])
    checked(clean, checking(clean))
    assert isinstance(verdict, Approve) and verdict.certificate is not None
    assert verdict.certificate.violations == 1 and len(rare.drawn) > len(clean.drawn)
    often = RiskyTwin([True, False] * 500)
    found = checked(often, checking(often))
    assert isinstance(found.verdict, Revise) and found.request is None and len(often.drawn) == 1
    names = [f.criterion for f in found.verdict.violated]
    assert names[0] == RISK and "LIM-HOT" in names, "the limit that is violated goes back to the proposer"
    assert "16 of 32 rollouts violate a hard limit" in found.verdict.violated[0].message


def test_what_the_draws_do_not_decide_is_refused() -> None:
    twin = RiskyTwin(([True] + [False] * 19) * 100)
    found = checked(twin, checking(twin))
    assert isinstance(found.verdict, Revise) and len(twin.drawn) == 512 // 32


def test_a_limit_that_was_violated_in_any_draw_goes_back_to_the_proposer() -> None:
    """The last of 512 draws are sound: what was too hot among the others is told all the same."""
    twin = RiskyTwin(([True] + [False] * 19) * 24)
    found = checked(twin, checking(twin))
    assert isinstance(found.verdict, Revise) and len(twin.drawn) == 512 // 32
    assert [f.criterion for f in found.verdict.violated] == [RISK, "LIM-HOT"]


def test_asking_again_is_no_second_chance_and_a_release_ends_that() -> None:
    twin = RiskyTwin([True] * 64)
    check = checking(twin)
    for _ in range(2):
        assert isinstance(checked(twin, check).verdict, Revise)
    twin.hot = []
    third = checked(twin, check).verdict
    check.confirmed(NOTHING)
    fourth = checked(twin, check).verdict
    assert isinstance(third, Approve) and isinstance(fourth, Approve)
    levels = [v.certificate.level for v in (third, fourth) if v.certificate is not None]
    assert levels[0] > levels[1] == pytest.approx(1.0 - 0.05 * FIRST)
    assert len(set(twin.drawn)) == len(twin.drawn), "every check draws afresh"


def test_what_passes_and_is_not_written_is_no_chance_for_a_later_one_and_ends_no_charge() -> None:
    """Refused by a person, withdrawn, advised: what is written is another check with an error of its own."""
    twin = RiskyTwin([])
    check = checking(twin)
    assert [level_of(checked(twin, check)) for _ in range(20)] == pytest.approx([1.0 - 0.05 * FIRST] * 20)
    twin.hot = [True] * 64
    assert isinstance(checked(twin, check).verdict, Revise)
    twin.hot = []
    assert [level_of(checked(twin, check)) for _ in range(3)] == pytest.approx([1.0 - 0.05 * LATER] * 3)
    check.confirmed(NOTHING)
    assert level_of(checked(twin, check)) == pytest.approx(1.0 - 0.05 * FIRST)


def test_a_check_that_breaks_down_after_some_draws_is_charged() -> None:
    twin = RiskyTwin([])
    check = checking(twin)
    twin.breaks = True
    assert isinstance(checked(twin, check).verdict, Revise)
    twin.breaks = False
    assert level_of(checked(twin, check)) == pytest.approx(1.0 - 0.05 * LATER)


def test_what_is_confirmed_of_a_sound_plant_says_nothing_of_a_fault() -> None:
    twin, faulty = RiskyTwin([]), Diagnosis(10.0, (), (Hypothesis((FaultState("leak", 1.0, 0.0),), 1.0),))
    check = checking(twin)
    twin.breaks = True
    checked(twin, check, diagnosis=faulty)
    twin.breaks = False
    check.confirmed(NOTHING)
    assert level_of(checked(twin, check, diagnosis=faulty)) == pytest.approx(1.0 - 0.05 * LATER)


def test_nothing_is_drawn_where_nothing_is_to_be_certified() -> None:
    twin = RiskyTwin([True] * 64)
    found = checked(twin, checking(twin, most=0))
    assert isinstance(found.verdict, Approve) and found.request is not None
    assert found.verdict.certificate is None and not twin.drawn


def level_of(found: Checked) -> float:
    """Confidence of what has passed."""
    assert isinstance(found.verdict, Approve) and found.verdict.certificate is not None
    return found.verdict.certificate.level


def level_after(refused_s: Sequence[float], now_s: float) -> float:
    """Confidence of a check at ``now_s`` after some that refused."""
    twin = RiskyTwin([])
    check = checking(twin, required=0.3, batch=16, most=10_000)
    for at_s in refused_s:
        twin.hot = [True] * 1000
        assert isinstance(checked(twin, check, at_s).verdict, Revise)
    twin.hot = []
    return level_of(checked(twin, check, now_s))


def test_what_was_refused_a_while_ago_is_forgotten() -> None:
    first, shared_s = 1.0 - 0.05 * FIRST, RiskBounds().shared_s
    assert level_after([10.0], 10.0 + shared_s) > first == level_after([10.0], 11.0 + shared_s)
    assert level_after([10.0, 600.0], 11.0 + shared_s) == level_after([600.0], 700.0)


def test_all_checks_together_err_no_more_than_one_may() -> None:
    errors = [1.0 - level_after([10.0] * k, 10.0) for k in range(40)]
    assert all(later < earlier for earlier, later in pairwise(errors)) and min(errors) > 1e-6
    assert sum(errors) < 0.05 < sum(errors) + 0.05 * LATER / 39.0 * 1.1, "and all of it is used in the end"


def asked_each_minute(until_s: float, good_from_s: float) -> list[float]:
    """When what is asked once a minute with the bounds of the package is released; it is safe from a time on.

    What passes is written each time.
    """
    twin, released = RiskyTwin([]), []
    check = checking(twin, **{f: getattr(RiskBounds(), f) for f in ("required", "level", "most", "batch")})
    for at_s in range(0, int(until_s), 60):
        twin.hot = [at_s < good_from_s] * 2000
        if isinstance(checked(twin, check, float(at_s)).verdict, Approve):
            released.append(float(at_s))
            check.confirmed(NOTHING)
    return released


def test_asked_for_hours_it_does_not_stay_shut() -> None:
    """After a few refusals no draws can show anything for a while; what is not asked in vain is no refusal."""
    released = asked_each_minute(4 * 3600.0, good_from_s=7200.0)
    assert released and 7200.0 <= released[0] <= 7200.0 + RiskBounds().shared_s


def test_a_check_that_could_show_nothing_says_when_it_can() -> None:
    twin = RiskyTwin([])
    check = checking(twin, required=0.01, most=1024, batch=128)
    for at_s in range(100, 108):
        twin.hot = [True] * 2000
        assert isinstance(checked(twin, check, float(at_s)).verdict, Revise)
    drawn, twin.hot = len(twin.drawn), []
    refused = checked(twin, check, 200.0).verdict
    assert isinstance(refused, Revise) and len(twin.drawn) == drawn, "nothing is drawn"
    said = "checks within 900 s were in vain; nothing can be shown before 1000 s"
    assert said in refused.violated[0].message and circumstantial(refused.violated)
    assert isinstance(checked(twin, check, 1010.0).verdict, Approve)


def test_a_fault_does_not_pay_for_what_was_asked_of_a_sound_plant() -> None:
    twin = RiskyTwin([])
    check = checking(twin, required=0.01, most=1024, batch=128)
    for _ in range(9):
        twin.hot = [True] * 2000
        checked(twin, check)
    twin.hot = []
    faulty = Diagnosis(10.0, (), (Hypothesis((FaultState("leak", 1.0, 0.0),), 1.0),))
    assert isinstance(checked(twin, check).verdict, Revise)
    assert isinstance(checked(twin, check, diagnosis=faulty).verdict, Approve)


def test_a_twin_that_leaves_the_physical_world_is_a_refusal() -> None:
    twin = RiskyTwin([])
    twin.breaks = True
    found = checked(twin, checking(twin))
    assert isinstance(found.verdict, Revise) and "CHK-ROLLOUT" in {f.criterion for f in found.verdict.violated}
