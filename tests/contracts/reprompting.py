"""What every reprompting agent must do. A test class inherits this and says which agent it is about."""

from __future__ import annotations

import math

import pytest

from homeostat.agents.crew import Reprompting
from homeostat.domain.limits import Owner
from homeostat.domain.recovery import RecoveryPath
from homeostat.domain.verdict import Advice, Finding, Revise


def finding(margin: float, owner: Owner = Owner.ACTION, name: str = "ACC-T-HIGH", unit: str = "K") -> Finding:
    """A finding of one criterion."""
    return Finding(name, owner, margin, unit, 0.0, 0, f"{name} by {margin}")


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
        advice = reprompting.advise(path, verdict, Advice())
        assert advice.findings == verdict.violated

    @pytest.mark.parametrize("verdict", VERDICTS)
    def test_a_kept_path_is_the_one_that_was_tried(
        self, reprompting: Reprompting, path: RecoveryPath, verdict: Revise
    ) -> None:
        advice = reprompting.advise(path, verdict, Advice())
        assert advice.keep_path in (None, path)
        assert all(math.isfinite(margin) for _, margin in advice.required)

    @pytest.mark.parametrize("verdict", VERDICTS)
    def test_refused_paths_stay_refused(self, reprompting: Reprompting, path: RecoveryPath, verdict: Revise) -> None:
        before = Advice(refused_paths=(("a", "b"),))
        after = reprompting.advise(path, verdict, before)
        assert set(after.refused_paths) <= {("a", "b"), path.states}

    def test_a_margin_in_scales_keeps_its_sign(self, reprompting: Reprompting) -> None:
        for margin in (-2.0, -1e-9, 0.0, 1e-9, 3.0, -math.inf):
            relative = reprompting.relative(finding(margin))
            assert math.copysign(1.0, relative) == math.copysign(1.0, margin) and (relative == 0.0) == (margin == 0.0)
