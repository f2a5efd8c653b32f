"""What every reprompting agent must do. A test class inherits this and says which agent it is about."""

from __future__ import annotations

import asyncio
import math

import pytest

from homeostat.agents.roles import Reprompting
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.plant.limits import Owner
from homeostat.domain.recovery import RecoveryPath
from homeostat.domain.verdict import Finding, Revise
from tests.agents.stuck_valve import now


def finding(margin: float, owner: Owner = Owner.ACTION, name: str = "ACC-T-HIGH", unit: str = "K") -> Finding:
    """A finding of one criterion."""
    return Finding(name, owner, margin, unit, 0.0, 0, f"{name} by {margin}")


def advise(reprompting: Reprompting, path: RecoveryPath, verdict: Revise, before: Advice | None = None) -> Advice:
    """The advice after one attempt on ``path``."""
    attempt = Attempt(1, path, None, verdict)
    return asyncio.run(reprompting.advise(now(), attempt, before or Advice()))


VERDICTS = [
    Revise((finding(-0.1),)),
    Revise((finding(-0.1), finding(2.0, name="ACC-OTHER"))),
    Revise((finding(-50.0),)),
    Revise((finding(-math.inf),)),
    Revise((finding(-0.1, Owner.PLANNING),)),
]


class RepromptingContract:
    """Inherit, and provide the fixtures ``reprompting`` and ``path``."""

    @pytest.mark.parametrize("verdict", VERDICTS)
    def test_the_advice_names_what_was_violated(
        self, reprompting: Reprompting, path: RecoveryPath, verdict: Revise
    ) -> None:
        advice = advise(reprompting, path, verdict)
        assert advice.findings == verdict.violated

    @pytest.mark.parametrize("verdict", VERDICTS)
    def test_a_kept_path_is_the_one_that_was_tried(
        self, reprompting: Reprompting, path: RecoveryPath, verdict: Revise
    ) -> None:
        advice = advise(reprompting, path, verdict)
        assert advice.keep_path in (None, path)
        assert all(math.isfinite(margin) for _, margin in advice.required)

    @pytest.mark.parametrize("verdict", VERDICTS)
    def test_refused_paths_stay_refused(self, reprompting: Reprompting, path: RecoveryPath, verdict: Revise) -> None:
        before = Advice(refused_paths=(("a", "b"),))
        after = advise(reprompting, path, verdict, before)
        assert set(after.refused_paths) <= {("a", "b"), path.commanded}
