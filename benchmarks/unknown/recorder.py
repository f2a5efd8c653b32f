"""Records true runs with nobody acting: what the plant showed up to the last look, and its first symptom."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.unknown.band import Band, Features, Noticed
from benchmarks.unknown.causes import HARMLESS, HEALTHY, Cause
from benchmarks.unknown.harmless import violated
from benchmarks.unknown.jobs import BAND_SEEDS, Job, scenario_of
from benchmarks.unknown.store import recordings, whole
from benchmarks.unknown.workers import each, plant_named
from homeostat.agents.monitoring.monitoring import TwinMonitoring
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.guard.watch.quality import QualityWatch
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.process.batch import ProcessError
from homeostat.twin.history import History
from homeostat.twin.isolation.prechecks import flat_lines

SAME_S = 5.0
"""Symptoms of two runs that lie no further apart than this are the same [s]."""


@dataclass(frozen=True, slots=True)
class Recording:
    """What one run showed."""

    tags: tuple[str, ...]
    """Columns of the readings."""
    readings: NDArray[np.float64]
    """Readings of every second from 1 s on, up to the last look, shape (times, tags)."""
    first_s: float
    """Process time of the first symptom from the onset on [s]; NaN where there was none."""
    looks_s: tuple[float, ...]
    """Process times of the looks that the run lived to see [s]."""
    rules: tuple[str, ...]
    """Symptoms at the first look."""
    noticed: tuple[str, ...]
    """Features that left their fault-free band for long enough, first look or not."""
    violated: tuple[str, ...] = ()
    """Of what is called harmless, the criteria and hard limits that the run does not satisfy."""

    def snapshots(self, plant: Plant) -> Iterator[Snapshot]:
        """What monitoring is shown, second by second: with the quality that the guard gives each reading."""
        judge = _Quality(plant)
        for k, row in enumerate(self.readings.tolist()):
            yield judge(Snapshot(k + 1.0, dict(zip(self.tags, row, strict=True))))


class _Quality:
    """The guard's judgement of each reading, without its journal."""

    def __init__(self, plant: Plant) -> None:
        d = plant.description
        self._watch = QualityWatch(d.qualities, d.tags_by_name, lambda event, at_s: None)

    def __call__(self, snapshot: Snapshot) -> Snapshot:
        judged = self._watch.assess(snapshot.at_s, snapshot)
        return snapshot if judged is None else judged


class _NoTwin:
    """Takes what monitoring has for a twin: symptoms need its readings and no replay."""

    def __init__(self, plant: Plant) -> None:
        d = plant.description
        self._plant, self._rows = d, max(d.timing.whole_ticks(plant.twin.lead_s), 1)
        self._history = History(d.variables, plant.model.inputs, tick_s=d.timing.tick_s, sampled=d.sampled)

    def observe(self, snapshot: Snapshot) -> None:
        """Keep what was read."""
        self._history.append(snapshot)

    def stuck(self) -> dict[str, float]:
        """As of a twin."""
        return {f.tag: f.since_s for f in flat_lines(self._history.window(self._rows), self._plant)}

    def calibrate(self, seconds: int) -> None:
        """Nothing."""


@dataclass(frozen=True, slots=True)
class Alone:
    """What the same true plant shows where nothing happens to it: no cause is noticed by that."""

    raised: tuple[tuple[str, float], ...]
    """Symptoms that it raises, each with its process time [s]."""
    noticed: tuple[str, ...]
    """Features that leave the fault-free band of other plants by themselves."""

    def raises(self, rule: str, at_s: float) -> bool:
        """Whether it raises this symptom at about ``at_s`` [s]."""
        return any(name == rule and abs(own_s - at_s) <= SAME_S for name, own_s in self.raised)


NOTHING = Alone((), ())


class _Recorder:
    """Sees every snapshot of a run."""

    def __init__(self, plant: Plant, onset_s: float, after_s: Sequence[int], band: Band, alone: Alone) -> None:
        d = plant.description
        self._judge, self._features, self._noticed = _Quality(plant), Features(plant, onset_s), Noticed(band)
        self._monitoring = monitoring_without_twin(plant)
        self._onset_s, self._after_s, self._alone = onset_s, list(after_s), alone
        self._names = tuple(f.name for f in d.features)
        self.rows: list[list[float]] = []
        self.tags: tuple[str, ...] = ()
        self.first_s = math.nan
        self.looks_s: list[float] = []
        self.rules: tuple[str, ...] = ()

    def __call__(self, raw: Snapshot) -> bool:
        """Take one more snapshot; whether everything has been seen."""
        self.tags = tuple(raw.values)
        if self._after_s:
            self.rows.append(list(raw.values.values()))
        snapshot = self._judge(raw)
        values = self._features.update(snapshot)
        if values is not None:
            self._noticed.update(values)
        if self._after_s:
            self._look(snapshot)
        return not self._after_s and bool(self.noticed)

    @property
    def noticed(self) -> tuple[str, ...]:
        """Features that left their band for long enough, and would not have done so by themselves."""
        found = (n for n, found in zip(self._names, self._noticed.found, strict=True) if found)
        return tuple(n for n in found if n not in self._alone.noticed)

    def _look(self, snapshot: Snapshot) -> None:
        self._monitoring.notices(snapshot)
        active = [s for s in self._monitoring.symptoms if s.at_s >= self._onset_s]
        new = tuple(s.rule for s in active if not self._alone.raises(s.rule, s.at_s))
        if math.isnan(self.first_s) and new:
            self.first_s, self.rules = snapshot.at_s, new
        if snapshot.at_s >= self.first_s + self._after_s[0]:
            self.looks_s.append(snapshot.at_s)
            self._after_s.pop(0)

    def recording(self) -> Recording:
        """What was seen; readings after the last look are left out."""
        length = int(self.looks_s[-1]) if self.looks_s else 0
        readings = np.array(self.rows[:length]).reshape(length, len(self.tags))
        return Recording(self.tags, readings, self.first_s, tuple(self.looks_s), self.rules, self.noticed)


def monitoring_without_twin(plant: Plant) -> TwinMonitoring:
    """Monitoring that only notices."""
    d, twin, grounding = plant.description, _NoTwin(plant), None
    return TwinMonitoring(twin, grounding, d, plant.baselines, plant.started, plant.monitoring)  # type: ignore[arg-type]


def record(plant: Plant, job: Job) -> Recording:
    """Let the true plant of ``job`` run with nobody acting, until everything has been seen."""
    truth = scenario_of(plant, job)
    onset_s = plant.onset_s if truth.onset_s is None else truth.onset_s
    band = fault_free_band(plant, job.mismatch)
    if job.part == HEALTHY:
        seen = _Recorder(plant, 0.0, job.looks_s, band, NOTHING)
    else:
        seen = _Recorder(plant, onset_s, job.looks_s, band, alone(plant, job.seed, job.mismatch))
    with suppress(ProcessError):  # a plant that leaves the physical world has shown what it had to show
        watch(open_process(plant, truth), new_sequencer(plant).sample, seen)
    made = seen.recording()
    return replace(made, violated=violated(plant, truth)) if job.part == HARMLESS else made


def recorded(plant: Plant, job: Job) -> Recording:
    """The recording of ``job``; read back where there is one."""
    path = path_of(job)
    if not path.exists():
        save(record(plant, job), path)
    return load(path)


def record_all(wanted: Sequence[Job], processes: int) -> None:
    """Record every one of ``wanted`` that is not there yet."""
    todo = [job for job in wanted if not path_of(job).exists()]
    for plant, mismatch in sorted({(job.plant, job.mismatch) for job in todo}):
        fault_free_band(plant_named(plant), mismatch)
    for _, told in each(_told, todo, processes):
        print(told, flush=True)


def _told(job: Job) -> str:
    """Record ``job``: a line for whoever waits."""
    began = time.process_time()
    seen = recorded(plant_named(job.plant), job)
    return (
        f"{job.name}: first {seen.first_s:g} s, {len(seen.looks_s)} looks, {' '.join(seen.rules)}; "
        f"noticeable by {' '.join(seen.noticed) or 'nothing'}; {time.process_time() - began:.1f} s"
    )


def path_of(job: Job) -> Path:
    """File of its recording; another one for another disturbance under the same name."""
    return recordings() / f"{job.name}-{job.truth}.npz"


def save(recording: Recording, path: Path) -> None:
    """Write ``recording`` whole or not at all."""
    with whole(path) as new:
        np.savez_compressed(
            new,
            tags=np.array(recording.tags),
            readings=recording.readings,
            first_s=recording.first_s,
            looks_s=np.array(recording.looks_s),
            rules=np.array(recording.rules, dtype=np.str_),
            noticed=np.array(recording.noticed, dtype=np.str_),
            violated=np.array(recording.violated, dtype=np.str_),
        )


def load(path: Path) -> Recording:
    """The recording in ``path``."""
    with np.load(path) as found:
        return Recording(
            tuple(found["tags"].tolist()),
            found["readings"],
            float(found["first_s"]),
            tuple(found["looks_s"].tolist()),
            tuple(found["rules"].tolist()),
            tuple(found["noticed"].tolist()),
            tuple(found["violated"].tolist()),
        )


def fault_free_band(plant: Plant, mismatch: str) -> Band:
    """The band of fault-free runs of the same mismatch on other seeds; kept on disk."""
    path = recordings() / f"band-{plant.name}-{mismatch}.npz"
    if not path.exists():
        runs = [_fault_free(plant, seed, mismatch) for seed in BAND_SEEDS[plant.name]]
        band = Band.of(plant, runs)
        with whole(path) as new:
            np.savez_compressed(new, low=band.low, high=band.high, outside_s=band.outside_s)
    with np.load(path) as found:
        return Band(found["low"], found["high"], found["outside_s"])


def alone(plant: Plant, seed: int, mismatch: str) -> Alone:
    """What the true plant of ``seed`` shows by itself; kept on disk."""
    path = recordings() / f"alone-{plant.name}-{mismatch}-{seed}.json"
    if not path.exists():
        with whole(path) as new:
            new.write_text(json.dumps(asdict(_alone(plant, seed, mismatch))))
    found = json.loads(path.read_text())
    return Alone(tuple((rule, at_s) for rule, at_s in found["raised"]), tuple(found["noticed"]))


def _alone(plant: Plant, seed: int, mismatch: str) -> Alone:
    truth = scenario_of(plant, Job(plant.name, HEALTHY, Cause("none", HEALTHY), seed, mismatch))
    judge, features, noticed = (
        _Quality(plant),
        Features(plant, plant.onset_s),
        Noticed(fault_free_band(plant, mismatch)),
    )
    monitoring, raised = monitoring_without_twin(plant), {}

    def see(raw: Snapshot) -> bool:
        snapshot = judge(raw)
        values = features.update(snapshot)
        if values is not None:
            noticed.update(values)
        monitoring.notices(snapshot)
        raised.update({(s.rule, s.at_s): None for s in monitoring.symptoms})
        return False

    watch(open_process(plant, truth), new_sequencer(plant).sample, see)
    names = (f.name for f in plant.description.features)
    return Alone(tuple(raised), tuple(n for n, found in zip(names, noticed.found, strict=True) if found))


def _fault_free(plant: Plant, seed: int, mismatch: str) -> NDArray[np.float64]:
    """Deviations of every feature of one fault-free run, shape (times, features)."""
    truth = scenario_of(plant, Job(plant.name, HEALTHY, Cause("none", HEALTHY), seed, mismatch))
    judge, features, rows = _Quality(plant), Features(plant, plant.onset_s), []

    def see(raw: Snapshot) -> bool:
        values = features.update(judge(raw))
        if values is not None:
            rows.append(values)
        return False

    watch(open_process(plant, truth), new_sequencer(plant).sample, see)
    return np.array(rows)
