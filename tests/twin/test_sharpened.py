"""Sharpened parameters hold beside the faults that they were learned beside, and are forgotten with them."""

from homeostat.domain.diagnosis import FaultState, Hypothesis
from tests.twin.followed import follow, readings

LEAK = FaultState("leak", 0.004, 1500.0)


def test_what_was_learned_beside_a_fault_is_forgotten_with_it() -> None:
    """They make up for what the twin does not have of a plant that leaks, and without it would be a leak themselves."""
    twin = follow(readings(3, 2200, (LEAK,)), 3)
    healthy = twin._posterior
    twin.recalibrate(300.0, [Hypothesis((LEAK,), 1.0)])
    sharpened = twin._posterior
    assert sharpened is not healthy
    twin.believe((LEAK,))
    assert twin._posterior is sharpened
    twin.believe(())
    assert twin._posterior is healthy
