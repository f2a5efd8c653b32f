"""Setpoints that were recorded elsewhere, judged in the same situation on this project's reactor by its own checks.

The same situation is: the same fault of nominal size with the same onset, on a plant of our own, watched and diagnosed
by our monitoring and left alone until the recorded second. Noise, feed mixing and level control are not the same.
"""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.recorded_calls import RecordedCall, Setpoints
from homeostat.agents.checks import command_findings, judge
from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.monitoring.monitoring import TwinMonitoring
from homeostat.agents.simulation import plausible
from homeostat.domain.diagnosis import Diagnosis, FaultState
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Finding, NoActionNeeded
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import Scenario, scenario
from homeostat.links.simulated import SimulatedLink
from homeostat.links.truth.process import TrueProcess
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.process.types import Vec
from homeostat.twin.twin import Twin

ENDS_S = 7000
"""End of production in the published runs; our plants are followed as far [s]."""
START = "normal"
"""State of the machine in which the plant is when the fault begins."""


@dataclass(frozen=True)
class Course:
    """True temperature [K] and level [L] of a plant, one row per second."""

    temperature: Vec
    level: Vec

    @property
    def outside_s(self) -> int:
        """Seconds outside the limits of temperature and level."""
        return int(((self.temperature > 313.0) | (self.level > 11.0) | (self.level < 2.0)).sum())

    def until(self, seconds: int) -> Course:
        """The seconds after the first row, ``seconds`` of them."""
        return Course(self.temperature[1 : seconds + 1], self.level[1 : seconds + 1])


@dataclass(frozen=True)
class Situation:
    """Our plant, watched and left alone until a recorded second."""

    setting: Scenario
    twin: Twin
    snapshot: Snapshot
    diagnosis: Diagnosis
    unprepared: str
    """What the twin finds most probable from the last readings alone, without earlier diagnoses."""


@dataclass(frozen=True)
class Ours:
    """Setpoints under this project's checks, and what they do on this project's plant."""

    target: str
    violated: tuple[Finding, ...]
    """The findings that refuse them; empty where they are accepted."""
    worst: Finding
    """The finding with the least margin, in scales of its unit."""
    soon: Course
    """Over the horizon that the checks judge."""
    late: Course
    """To the end of production, with nothing else done."""


def watch(link: SimulatedLink, monitoring: TwinMonitoring, until_s: int) -> tuple[Snapshot, tuple[FaultState, ...]]:
    """Watch and diagnose as the loop does, but leave the plant alone; the last snapshot and what is believed then."""
    known: tuple[FaultState, ...] = ()
    while not link.ended:
        snapshot = link.advance()
        if monitoring.notices(snapshot):
            diagnosis = monitoring.diagnose()
            if diagnosis.faulty:
                known = next(h.faults for h in diagnosis.hypotheses if h.faults)
                monitoring.follow(NoActionNeeded(snapshot.at_s, 0.0))
        if snapshot.at_s >= until_s:
            return snapshot, known
    raise ValueError(f"the plant ended before {until_s} s")


def opened(plant: Plant, setting: Scenario) -> tuple[SimulatedLink, TrueProcess]:
    """The plant before its first second; the same one each time."""
    process = open_process(plant, setting)
    return SimulatedLink(process, recipe=new_sequencer(plant).sample), process


def situation(plant: Plant, call: RecordedCall) -> Situation:
    """The situation of a recorded run: same fault, same onset, same second; the run's number is the seed."""
    d = plant.description
    setting = scenario(plant, call.fault, call.run, onset_s=call.onset_s, end_s=float(ENDS_S))
    link, _ = opened(plant, setting)
    twin = Twin(plant.model, d, plant.twin, call.run)
    monitoring = TwinMonitoring(
        twin, Grounding(plant.graph, plant.namespace), d, plant.baselines, plant.started, plant.monitoring
    )
    snapshot, known = watch(link, monitoring, call.time_s)
    every = [f.name for f in d.faults]
    diagnosis = Diagnosis(snapshot.at_s, monitoring.symptoms, twin.explain(every, known))
    return Situation(setting, twin, snapshot, diagnosis, twin.explain(every, ())[0].name)


def typed(plant: Plant, snapshot: Snapshot, wanted: Setpoints) -> ActionSet:
    """``wanted`` for the first reachable recovery target that admits it, or else for the first one."""
    d, tags = plant.description, plant.description.tags_by_name
    values = {"T1.sp": wanted.temperature, "L1.sp": wanted.level, "F1.sp": wanted.feed}
    commands = tuple(Command(tag, value, tags[tag].rate_limit) for tag, value in values.items())
    targets = dict.fromkeys(
        p[-1].target for p in d.machine.paths(START, snapshot.values, d.machine.recovery_event, blocked=())
    )
    options = [ActionSet(commands, target) for target in targets]
    return next((a for a in options if not command_findings(a, d.machine.state(a.target), tags)), options[0])


def idle() -> ActionSet:
    """No command: the plant is left alone."""
    return ActionSet((), START)


def ours(plant: Plant, where: Situation, actions: ActionSet) -> Ours:
    """Roll ``actions`` out on the twin and judge them; and see what they do on the plant itself."""
    d = plant.description
    rollout = where.twin.roll_out(actions, plausible(where.diagnosis))
    verdict = judge(actions, rollout, d.limits, d.machine.state(actions.target), d.tags_by_name)
    worst = min(verdict.findings, key=lambda f: f.relative(d.scales))
    start = round(where.snapshot.at_s)
    truth = execute(*opened(plant, where.setting), actions, start)
    soon, late = truth.until(plant.twin.horizon_s), truth.until(ENDS_S - start)
    return Ours(actions.target, tuple(f for f in verdict.findings if not f.satisfied), worst, soon, late)


def execute(link: SimulatedLink, process: TrueProcess, actions: ActionSet, start_s: int) -> Course:
    """Leave the plant alone until ``start_s``, command what was recorded, go on to the end; true values from then."""
    while link.advance().at_s < start_s:
        pass
    process.command(actions.commands)
    while not link.ended:
        link.advance()
    signals = process.truth().signals  # its first row is the end of the first second
    return Course(signals["T1"][0, start_s - 1 :], signals["L1"][0, start_s - 1 :])
