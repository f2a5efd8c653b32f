"""What a guard is attached to, and its parts, made once and shared by those who decide."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from homeostat.domain.mode import Mode
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.ports import GuardEvent, GuardTrace, Lease
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.restart.memory import Memory
from homeostat.guard.restart.recorder import Recorder
from homeostat.guard.sequence.recognition import Evidence
from homeostat.guard.sequence.sequencer import Sequencer
from homeostat.guard.sequence.service import Service
from homeostat.guard.settings import GuardSettings
from homeostat.guard.watch.alarms import Alarms
from homeostat.guard.watch.jumps import Jumps
from homeostat.guard.writing.bounded import bounded
from homeostat.guard.writing.tenure import Tenure
from homeostat.guard.writing.writer import Writer


@dataclass(frozen=True, slots=True)
class Parts:
    """What everybody in the guard works with."""

    rules: GuardRules
    """The plant's rules."""
    settings: GuardSettings
    """Times that the guard waits, and how often it tries."""
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
    jumps: Jumps
    """What readings have jumped by."""

    @classmethod
    def of(cls, rules: GuardRules, record: GuardTrace, lease: Lease | None, settings: GuardSettings) -> Parts:
        """New parts for a plant that nobody has watched yet."""
        recorder = Recorder(record, settings.sync_s)
        alarms, writer = Alarms(recorder.note), Writer(rules.writables, recorder, settings)
        sequencer = Sequencer(rules.machine, rules.limits, rules.nominal)
        service = Service(rules.writables, recorder.note)
        tenure = Tenure(bounded(lease, settings), writer, alarms, recorder.note, settings)
        return cls(rules, settings, recorder, alarms, sequencer, service, writer, tenure, Jumps(rules.qualities))

    def evidence(self, readings: Snapshot) -> Evidence:
        """What ``readings`` tell of where the plant stands."""
        return Evidence(readings, self.rules.writables, self.service.out)

    def note(self, event: GuardEvent, at_s: float) -> None:
        """Journal ``event``, which happened at process time ``at_s`` [s]."""
        self.recorder.note(event, at_s)


@dataclass(frozen=True, slots=True)
class Attachment:
    """What a guard is attached to, and in which mode it begins."""

    record: GuardTrace
    """Where its events go."""
    lease: Lease | None = None
    """The right to write; None where the plant is only observed."""
    mode: Mode = Mode.CLOSED_LOOP
    """Mode in which it begins."""
    keys: Mapping[str, bytes] = field(default_factory=dict)
    """Issuer -> the key of its seals."""
    memory: Memory | None = None
    """What a journal says of the guard before; None for a plant that nobody has watched yet."""
    goes_on: bool = True
    """Whether a restart goes on in the journalled mode, as in simulation; a real plant stands in observe first."""
