"""Ten thousand random and adversarial requests straight to the guard: none is accepted that breaks a check."""

from __future__ import annotations

import math
import random

from tests.guard.adversary import attack
from tests.guard.vessel import RULES

COUNT = 10_000
CHECKS = (
    "CHK-FORM", "CHK-SEAL", "CHK-USED", "CHK-AGE", "CHK-EXPIRY", "CHK-EMPTY", "CHK-CONFIGURATION", "CHK-STATE",
    "CHK-TARGET", "CHK-OPEN", "CHK-WRITABLE", "CHK-ADMISSIBLE", "CHK-AUTOMATIC", "CHK-RANGE", "CHK-RATE", "CHK-SERVICE",
    "PRM-FEED", "LIM-FULL",
)  # fmt: skip


def restless(seed: int) -> tuple[random.Random, dict[str, float]]:
    return random.Random(seed), {"T": 305.0, "Tx": 305.0, "L": 8.0}


def test_no_request_is_accepted_that_breaks_a_check() -> None:
    draw, values = restless(7)

    def readings(now_s: float) -> dict[str, float]:
        """A vessel in its limits, now and then at their edge, sometimes with an instrument that fails for a moment."""
        wiggle = {tag: value + 0.1 * math.sin(7.0 * now_s) for tag, value in values.items()}
        match draw.random():
            case p if p < 0.02:
                wiggle[draw.choice(["T", "L"])] = math.nan
            case p if p < 0.06:
                wiggle["L"] = 12.0 + draw.choice([-0.05, 0.05, 0.2])
            case p if p < 0.1:
                wiggle["L"] = draw.uniform(10.5, 11.9)
        return wiggle

    accepted = {"T.sp": 310.0, "F.sp": 0.0, "V.man": None, "X.cmd": 1.0}
    report = attack(RULES, readings, "running", accepted, COUNT)
    assert report.wrongly == [] and report.altered == [], report
    assert report.unanswered == [], report
    assert report.accepted > 0.02 * COUNT, report
    assert [name for name in CHECKS if not report.refusals[name]] == [], report
