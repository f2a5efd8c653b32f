"""Recovery that fails is an alarm each time, which ends with the failure: it begins again at once."""

from __future__ import annotations

from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.observation import Message, Settled, Trouble
from homeostat.domain.ports import GuardEvent
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.requests.seal import Sealer
from homeostat.guard.watch.alarms import Alarms, Troubles
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.plants.wired.assembly import Arrangement, Outside, recovery_beside
from tests.agents.scripted import ScriptedMonitoring
from tests.recovery.guarded import observation
from tests.twin.followed import reactor


class Failing(ScriptedMonitoring):
    """Monitoring with a bug."""

    def notices(self, snapshot: Snapshot) -> bool:
        raise RuntimeError(f"a bug at {snapshot.at_s:.0f} s")


def test_people_are_called_each_time_that_recovery_fails() -> None:
    said: list[Message] = []
    outside = Outside(said.append, DeclaredClock(0.0), MemoryTrace(), Sealer("check", b"key"))
    exchange, worker = recovery_beside(reactor(), outside, 1, Arrangement(given=lambda usual: Failing()))
    worker.start()
    for at_s in (1.0, 2.0, 3.0):
        exchange.publish(observation(at_s))
    assert worker.join(60.0)
    events: list[GuardEvent] = []
    alarms = Alarms(lambda event, at_s: events.append(event))
    troubles = Troubles(alarms)
    for message in said:
        if isinstance(message, Trouble):
            troubles.begin(message, 1.0)
        elif isinstance(message, Settled):
            troubles.end(message, 1.0)
    told = [e.cause for e in events if isinstance(e, AlarmRaised) and e.alarm == "recovery:failed"]
    assert [cause.partition(":")[0] for cause in told] == [f"recovery failed ({n} of 3)" for n in (1, 2, 3)]
    assert alarms.lasts("recovery:lost") and not alarms.lasts("recovery:failed")
    assert alarms.acknowledge("recovery:failed", "ann", 2.0) and not alarms.lists("recovery:failed")
