"""The guard's parts, made once and shared by those who decide."""

from __future__ import annotations

from dataclasses import dataclass

from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.ports import GuardEvent, Lease, Record
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.restart.recorder import Recorder
from homeostat.guard.sequence.recognition import Evidence
from homeostat.guard.sequence.sequencer import Sequencer
from homeostat.guard.sequence.service import Service
from homeostat.guard.settings import GuardSettings
from homeostat.guard.watch.alarms import Alarms
from homeostat.guard.writing.bounded import bounded
from homeostat.guard.writing.tenure import Tenure
from homeostat.guard.writing.writer import Writer


@dataclass(frozen=True, slots=True)
class Parts:
    """What everybody in the guard works with."""

    rules: GuardRules
    """The plant's rules."""
    settings: GuardSettings
    """How patient the guard is."""
    recorder: Recorder
    """Journals."""
    alarms: Alarms
    """Standing alarms."""
    sequencer: Sequencer
    """State of the machine and the steps that wait."""
    service: Service
    """Which tags are the guard's."""
    writer: Writer
    """The only way to the plant."""
    tenure: Tenure
    """The right to write."""

    @classmethod
    def of(cls, rules: GuardRules, record: Record, lease: Lease | None, settings: GuardSettings) -> Parts:
        """New parts for a plant that nobody has watched yet."""
        recorder = Recorder(record, settings.sync_s)
        alarms, writer = Alarms(recorder.note), Writer(rules.writables, recorder, settings)
        sequencer = Sequencer(rules.machine, rules.limits, rules.nominal)
        service = Service(rules.writables, recorder.note)
        tenure = Tenure(bounded(lease, settings), writer, alarms, recorder.note, settings)
        return cls(rules, settings, recorder, alarms, sequencer, service, writer, tenure)

    def evidence(self, readings: Snapshot) -> Evidence:
        """What ``readings`` tell of where the plant stands."""
        return Evidence(readings, self.rules.writables, self.service.out)

    def note(self, event: GuardEvent, at_s: float) -> None:
        """Journal ``event``, which happened at process time ``at_s`` [s]."""
        self.recorder.note(event, at_s)
