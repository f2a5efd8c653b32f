"""A run that is kept: scored, drawn, and closed with a manifest, or closed as interrupted."""

import sys
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from importlib.metadata import version

from homeostat.agents.roles import AskingProtocol
from homeostat.domain.plant.timing import TICK_S
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.operation import Operation, Thinking
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.recorded.plant import place
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import Scenario, ScenarioError
from homeostat.evaluate.score.step_scores import score_steps
from homeostat.journal import RunFinished, RunStarted, Setting, Subscriber, Summary
from homeostat.journal.beside.files import RESULT
from homeostat.journal.events import BEGINS_IN, DISTURBANCE, SETPOINT, TICK
from homeostat.plants.plant import Plant
from homeostat.plants.truth import NONE
from homeostat.plants.wired.assembly import Language
from homeostat.process.batch import ProcessError
from homeostat.process.seeds import NAMING
from homeostat.record.directory import FIGURE, TRAJECTORY, RunDirectory
from homeostat.record.figure.figure import draw

LIBRARIES = ("numpy", "numba", "pyoxigraph")
"""Libraries that what is computed depends on."""
BROKEN = "broken"
"""Outcome in the trace of a run whose simulated plant left the physical world."""
INTERRUPTED = "interrupted"
"""Outcome in the trace of a run that was stopped from outside."""


def record_run(
    plant: Plant,
    scenario: Scenario,
    directory: RunDirectory,
    thinking: Thinking,
    proposer: str,
    subscriber: Subscriber = lambda event, at_s: None,
    watcher: Callable[[Snapshot], None] = lambda snapshot: None,
    proposing: Proposing | None = None,
    operation: Operation | None = None,
    kept: Callable[[Run], bool] = lambda run: True,
) -> Run:
    """Run ``scenario``, keep everything in ``directory`` and close it; ``subscriber`` and ``watcher`` follow the run.

    ``proposer`` is what was asked for; ``proposing`` and ``operation`` are as in
    :func:`homeostat.evaluate.runner.run`; ``kept`` says whether anybody will look at the run: if not, there is neither
    trajectory nor figure. Where the disk is full, the run goes on to its end, and ``directory.missing`` says what its
    record lacks. A KeyboardInterrupt closes the directory with what was recorded so far and goes on; any other
    exception leaves it without manifest, which verifies as incomplete.

    Raises ScenarioError where the simulated plant leaves the physical world; the directory is closed, and says so.
    """
    trace, seen = directory.trace, _LastTime(watcher)
    trace.subscribe(subscriber)
    proposing, operation = proposing or Proposing(), operation or Operation()
    conditions, language = proposing.conditions, proposing.language
    chosen = (*conditions.settings, *operation.settings, *proposing.settings)
    started = None if operation.past else run_started(plant, scenario, thinking, proposer, chosen, language)
    try:
        done = run(
            plant,
            scenario,
            trace,
            thinking.clock(),
            proposing,
            operation,
            watcher=seen,
            archive=directory,
            started=started,
        )
        stepwise = language is not None and conditions.protocol is AskingProtocol.PER_STEP
        done = replace(done, steps=score_steps(plant, scenario, done.transcript) if stepwise else None)
        directory.record(RunFinished(done.outcome.value, done.reason, done.wall_s), scenario.end_s)
        store(directory, done, whole=kept(done))
    except ProcessError as broke:
        directory.record(RunFinished(BROKEN, str(broke)), seen.at_s)
        directory.close(Summary(scenario.seed, BROKEN, plant.configuration))
        remedy = "disturb it less, or let its equations hold where it came to ('homeostat plant check --deep')"
        raise ScenarioError(f"{broke}: nothing can be simulated from there on; {remedy}") from None
    except KeyboardInterrupt:
        directory.record(RunFinished(INTERRUPTED, "stopped from outside"), seen.at_s)
        directory.close(Summary(scenario.seed, INTERRUPTED, plant.configuration))
        raise
    directory.close(Summary(scenario.seed, done.outcome.value, plant.configuration))
    return done


class _LastTime:
    """Passes snapshots on and knows the time of the last one."""

    def __init__(self, watcher: Callable[[Snapshot], None]) -> None:
        self._watcher = watcher
        self.at_s = 0.0

    def __call__(self, snapshot: Snapshot) -> None:
        self.at_s = snapshot.at_s
        self._watcher(snapshot)


def run_started(
    plant: Plant,
    scenario: Scenario,
    thinking: Thinking,
    proposer: str,
    chosen: tuple[Setting, ...],
    language: Language | None,
) -> RunStarted:
    """The first event of a run; ``chosen``: what else was chosen."""
    configuration = [Setting("configuration", plant.configuration), *place(plant.files.folder)]
    configuration += [Setting(f"made again {name}", "it was older than its sources") for name in plant.remade]
    configuration += [Setting("end_s", scenario.end_s), Setting("seeds", NAMING)]
    if (tick_s := plant.description.timing.tick_s) != TICK_S:
        configuration.append(Setting(TICK, tick_s))
    for fault in scenario.faults:
        configuration.append(Setting(f"onset_s {fault.fault}", fault.onset_s))
        configuration.append(Setting(f"severity {fault.fault}", fault.severity))
    if scenario.mismatch != NONE:
        configuration.append(Setting("mismatch", scenario.mismatch))
    if scenario.repaired_s is not None:
        configuration.append(Setting("repaired_s", scenario.repaired_s))
    if scenario.begins_in:
        configuration.append(Setting(BEGINS_IN, scenario.begins_in))
    configuration += [Setting(f"{SETPOINT}{tag}", value) for tag, value in scenario.setpoints]
    configuration += [Setting(f"{DISTURBANCE}{k}", str(d)) for k, d in enumerate(scenario.disturbances, start=1)]
    configuration += [Setting("proposer", proposer), thinking.setting, *chosen]
    if language is not None:
        configuration.append(Setting("grounding", language.grounding.value))
    versions = [Setting("python", sys.version.split()[0]), *(Setting(name, version(name)) for name in LIBRARIES)]
    return RunStarted(
        case=scenario.case,
        faults=tuple(f.fault for f in scenario.faults),
        seed=scenario.seed,
        configuration=tuple(configuration),
        versions=tuple(versions),
        wall_started=datetime.now().astimezone().isoformat(timespec="milliseconds"),
    )


def store(directory: RunDirectory, done: Run, whole: bool = True) -> None:
    """Keep beside the journal what the run came to; ``whole``: also what is measured and drawn."""
    with directory.spared(RESULT):
        directory.store_whole(RESULT, f"{done.result(directory.path).to_json()}\n".encode())
    if not whole:
        return
    with directory.spared(TRAJECTORY):
        directory.store_trajectory(done.measured, done.truth, {t.name: t.unit for t in done.plant.description.tags})
    with directory.spared(FIGURE):
        directory.store_whole(FIGURE, draw(done))
