"""What every monitoring agent must do. A test class inherits this and says which agent it is about."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from homeostat.agents.roles import Monitoring
from homeostat.domain.recovery import ActionSet
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import FallbackNeeded, NoActionNeeded, Released, Resolution

OUTCOMES: list[Resolution] = [
    Released(ActionSet((), "x"), 100.0),
    NoActionNeeded(100.0, 0.5),
    FallbackNeeded("no plan", 100.0),
]


class MonitoringContract:
    """Inherit, and provide the fixtures ``monitoring`` and ``snapshots``: a stretch that ends faulty."""

    def reported(self, monitoring: Monitoring, snapshots: Sequence[Snapshot]) -> list[float]:
        """The times at which something needed to be explained."""
        return [s.at_s for s in snapshots if monitoring.notices(s)]

    def test_a_fault_is_noticed_once_it_is_there(self, monitoring: Monitoring, snapshots: Sequence[Snapshot]) -> None:
        noticed = self.reported(monitoring, snapshots)
        assert noticed and noticed == sorted(set(noticed))
        assert isinstance(monitoring.notices(snapshots[-1]), bool)

    def test_a_diagnosis_is_of_the_present_and_complete(
        self, monitoring: Monitoring, snapshots: Sequence[Snapshot]
    ) -> None:
        for snapshot in snapshots:
            if not monitoring.notices(snapshot):
                continue
            diagnosis = monitoring.diagnose()
            assert diagnosis.at_s == snapshot.at_s
            if diagnosis.faulty:
                weights = [h.probability for h in diagnosis.hypotheses]
                assert any(h.faults for h in diagnosis.hypotheses)
                assert all(0.0 < w <= 1.0 for w in weights) and 0.0 < sum(weights) <= 1.0 + 1e-9
                return
        raise AssertionError("the fault was never diagnosed")

    @pytest.mark.parametrize("outcome", OUTCOMES)
    def test_every_outcome_is_taken_note_of(
        self, monitoring: Monitoring, snapshots: Sequence[Snapshot], outcome: Resolution
    ) -> None:
        self.reported(monitoring, snapshots)
        monitoring.follow(outcome)
        monitoring.follow(outcome)
        assert isinstance(monitoring.symptoms, tuple)
