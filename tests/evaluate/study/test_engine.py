"""Engines and whole studies in this process: what fails, what goes on, what is refused."""

from __future__ import annotations

import errno
import json
import socket
import subprocess
import sys
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from homeostat.evaluate.study import engine as one
from homeostat.evaluate.study import study as whole
from homeostat.evaluate.study.engine import carry_out, measured_alike
from homeostat.evaluate.study.error import StudyError
from homeostat.evaluate.study.ledger import DATASET, LEDGER, Ledger, read_dataset
from homeostat.evaluate.study.measurement import KeptRuns
from homeostat.evaluate.study.plan.job import Job
from homeostat.evaluate.study.study import PROVENANCE, Ended, Progress, Workers, run_study
from homeostat.record.directory import RunDirectory
from homeostat.record.row import Row
from tests.cli.campaigns import cluster
from tests.cli.command import environment
from tests.evaluate.study.fake_rows import plain
from tests.evaluate.study.plans import BATCH, PUMP, jobs, lasting

JOBS = jobs(seeds=2, proposers=["do-nothing", "hindsight"], scenarios=[BATCH, PUMP])


def done(folder: Path, some: tuple[Job, ...] = JOBS, shown: list[str] | None = None) -> Ended:
    def show(progress: Progress) -> None:
        if shown is not None:
            shown.append(progress.line)

    return run_study("A study", some, folder, Workers(1), show, lambda row: f"again {row.job}")


def lines(folder: Path) -> list[str]:
    return [json.loads(line)["fingerprint"] for line in (folder / LEDGER).read_text().splitlines()]


@pytest.fixture(autouse=True)
def _no_report(monkeypatch: pytest.MonkeyPatch) -> None:
    """The report has tests of its own, and takes longer than all jobs here."""
    monkeypatch.setattr(whole, "write_report", lambda *given: ())


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> tuple[Row, ...]:
    return done(tmp_path_factory.mktemp("expected")).rows


@pytest.mark.slow
def test_a_campaign_in_this_process(tmp_path: Path, expected: tuple[Row, ...]) -> None:
    shown: list[str] = []
    ended = done(tmp_path, shown=shown)
    assert [row.job for row in ended.rows] == [job.name for job in JOBS] and ended.failed == ()
    assert [lasting(row) for row in ended.rows] == [lasting(row) for row in expected]
    assert read_dataset(tmp_path / DATASET) == list(ended.rows)
    assert [line.partition(" runs")[0] for line in shown] == [f"{n} of 8" for n in range(9)]
    assert lines(tmp_path) == [job.fingerprint for job in JOBS]
    again: list[str] = []
    assert done(tmp_path, shown=again).rows == ended.rows
    assert again == ["0 of 0 runs in 0 s"] and len(lines(tmp_path)) == 8


def test_a_plan_that_grew_makes_only_what_is_new(tmp_path: Path) -> None:
    done(tmp_path, JOBS[:3])
    assert [row.job for row in done(tmp_path).rows] == [job.name for job in JOBS]
    assert lines(tmp_path) == [job.fingerprint for job in JOBS]
    assert len(done(tmp_path, JOBS[4:6]).rows) == 2  # and one that shrank shows what it has now


def test_rows_that_were_made_with_other_libraries_are_said_to_be(tmp_path: Path) -> None:
    """A study that goes on after a library was brought up to date has rows of both."""

    def provenance() -> dict[str, Any]:
        content: dict[str, Any] = json.loads((tmp_path / PROVENANCE).read_text())
        return content

    done(tmp_path, JOBS[:1])
    now = provenance()
    assert "earlier_versions" not in now
    old = {**now["versions"], "numpy": "1.0"}
    (tmp_path / PROVENANCE).write_text(json.dumps({**now, "versions": old}))
    for _ in range(2):
        done(tmp_path, JOBS[:2])
        assert (provenance()["versions"], provenance()["earlier_versions"]) == (now["versions"], [old])
    done(tmp_path, JOBS[2:3])
    assert "earlier_versions" not in provenance(), "none of these rows is older"


def test_a_study_that_dies_has_said_what_its_first_rows_were_made_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def dies(fingerprints: Iterable[str], ledger: Ledger) -> list[Row]:
        raise KeyboardInterrupt

    monkeypatch.setattr(whole, "in_order", dies)
    with pytest.raises(KeyboardInterrupt):
        done(tmp_path, JOBS[:1])
    assert "numpy" in json.loads((tmp_path / PROVENANCE).read_text())["versions"] and len(lines(tmp_path)) == 1


def broken(job: Job) -> Job:
    """A job whose plant has gone."""
    return replace(job, scenario=replace(job.scenario, case="gone"))


def test_a_job_that_fails_is_its_own_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, expected: tuple[Row, ...]
) -> None:
    measure, bad = one.measure, JOBS[2].name

    def breaks(job: Job, kept: KeptRuns) -> Row:
        if job.name == bad:
            raise RuntimeError("the first line\nand the second one")
        return measure(job, kept)

    with monkeypatch.context() as patch:
        patch.setattr(one, "measure", breaks)
        ended = done(tmp_path)
    assert [(f.job.name, f.failure) for f in ended.failed] == [(bad, "RuntimeError: the first line and the second one")]
    assert [row.job for row in ended.rows] == [job.name for job in JOBS if job.name != bad]
    assert [lasting(row) for row in done(tmp_path).rows] == [lasting(row) for row in expected]
    assert len(lines(tmp_path)) == 8 and lines(tmp_path)[-1] == JOBS[2].fingerprint


def test_a_run_that_still_goes_on_elsewhere_is_left_alone(tmp_path: Path) -> None:
    """On a worker that was given up and lives, or where a job was asked for twice: two would write one record."""
    kept = replace(JOBS[0], keep="all")
    folder = KeptRuns(tmp_path).folder(kept)
    assert folder is not None
    with RunDirectory(folder) as directory:
        directory.store_whole("of the other", b"")
        found = one.measured(kept, KeptRuns(tmp_path))
        assert found.row is None and found.failure.endswith("still goes on; stop it first")
        assert (folder / "of the other").exists() and (folder / "events.jsonl").exists()
    after = one.measured(kept, KeptRuns(tmp_path))
    assert after.row is not None and not (folder / "of the other").exists()


def test_a_case_that_has_gone_is_one_line(tmp_path: Path) -> None:
    ended = done(tmp_path, (broken(JOBS[0]), JOBS[1]))
    (failed,) = ended.failed
    assert failed.failure.startswith("StudyError: unknown plant 'gone'") and "\n" not in failed.failure
    assert [row.job for row in ended.rows] == [JOBS[1].name]


def test_nothing_but_failures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An earlier report of other rows does not stay: the new one says that there are none, and why."""
    told = list[tuple[Any, ...]]()
    monkeypatch.setattr(whole, "write_report", lambda *given: told.append(given) or (tmp_path / "page",))
    ended = done(tmp_path, (broken(JOBS[0]),))
    assert (ended.rows, len(ended.failed), ended.files) == ((), 1, (tmp_path / DATASET, tmp_path / "page"))
    assert read_dataset(tmp_path / DATASET) == []
    assert [(given[2], given[-1]) for given in told] == [([], [(ended.failed[0].job.name, ended.failed[0].failure)])]


@pytest.mark.parametrize("how", ["changed", "removed"])
def test_recorded_answers_that_do_not_last_are_a_failure_of_their_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: str
) -> None:
    """Whether a run read the answers before or after they were changed, nobody knows: it is no row of either."""
    answers = tmp_path / "answers.jsonl"
    answers.write_text("")
    mixed = jobs(tmp_path, proposers=["replay:answers.jsonl", "do-nothing"], scenarios=[BATCH])
    measure = one.measure

    def meanwhile(job: Job, kept: KeptRuns) -> Row:
        if job.arm.model is None:
            return measure(job, kept)
        answers.write_text("\n") if how == "changed" else answers.unlink()
        return plain(job=job.name)

    monkeypatch.setattr(one, "measure", meanwhile)
    ended = done(tmp_path / "out", mixed)
    assert [row.job for row in ended.rows] == [mixed[1].name] and len(lines(tmp_path / "out")) == 1
    ((job, failure),) = ((f.job.name, f.failure) for f in ended.failed)
    assert job == mixed[0].name and failure.startswith("of what answers it was made is not known: they ")


def test_a_full_disk_loses_nothing_that_was_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, expected: tuple[Row, ...]
) -> None:
    add, shown = Ledger.add, list[str]()

    def full(self: Ledger, fingerprint: str, row: Row) -> None:
        if len(self.rows) == 3:
            raise OSError(errno.ENOSPC, "No space left on device", "rows.jsonl")
        add(self, fingerprint, row)

    with monkeypatch.context() as patch, pytest.raises(OSError, match="No space left on device"):
        patch.setattr(Ledger, "add", full)
        done(tmp_path, shown=shown)
    assert shown[-1].startswith("3 of 8 runs") and len(lines(tmp_path)) == 3
    assert [lasting(row) for row in done(tmp_path).rows] == [lasting(row) for row in expected]
    assert len(lines(tmp_path)) == 8


def test_nobody_else_writes_while_dataset_and_report_are_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write = whole.write_dataset

    def checked(path: Path, rows: list[Row]) -> None:
        with pytest.raises(StudyError, match="in use by another study"):
            Ledger(tmp_path)
        write(path, rows)

    monkeypatch.setattr(whole, "write_dataset", checked)
    assert len(done(tmp_path, JOBS[:1]).rows) == 1


@pytest.fixture
def silent() -> Iterator[str]:
    """Address of somebody who listens and says nothing."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        yield f"tcp://127.0.0.1:{listener.getsockname()[1]}"


DASK = """
import sys
from homeostat.evaluate.study import engine
from homeostat.evaluate.study.error import StudyError
from homeostat.evaluate.study.measurement import KeptRuns
from tests.evaluate.study.plans import BATCH, jobs
if sys.argv[1] == "missing":
    sys.modules["distributed"] = None
else:
    from homeostat.evaluate.study import cluster
    cluster.WAIT_S = 1
try:
    list(engine.carry_out(jobs(proposers=["do-nothing"], scenarios=[BATCH]), KeptRuns(None), 2, sys.argv[2] or None))
except StudyError as error:
    print(error)
"""


def refused(what: str, address: str) -> str:
    """What a study says in a process of its own, where a library may spoil what it likes."""
    root = Path(__file__).parents[3]
    env = {**environment(), "PYTHONPATH": f"{environment()['PYTHONPATH']}:{root}"}
    arguments = [sys.executable, "-c", DASK, what, address]
    run = subprocess.run(arguments, env=env, capture_output=True, text=True, timeout=240)
    assert (run.returncode, run.stderr, run.stdout.count("\n")) == (0, "", 1)
    return run.stdout


def test_several_workers_need_a_library() -> None:
    told = refused("missing", "")
    assert "several workers need 'distributed': pip install 'homeostat[campaign]', or use --workers 1" in told


@pytest.mark.wide
def test_a_scheduler_that_does_not_answer(silent: str) -> None:
    for address in ("nonsense", silent):
        told = refused("there", address)
        assert told.startswith(f"no scheduler answers at '{address}' (") and "start one with 'dask scheduler'" in told


@pytest.mark.slow
def test_a_scheduler_without_workers(tmp_path: Path) -> None:
    with cluster(tmp_path, 0) as (address, _):
        told = refused("there", address)
    assert told == f"the scheduler at '{address}' has no worker; start one with 'dask worker {address}'\n"


def test_one_worker_needs_no_library(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    (only,) = carry_out(JOBS[:1], KeptRuns(None), 1)
    assert only.row is not None and only.row.job == JOBS[0].name


def test_a_worker_of_another_version_carries_nothing_out() -> None:
    done = measured_alike(jobs(scenarios=[BATCH])[0], KeptRuns(None), "another")
    assert done.row is None and "another version of the package" in done.failure


def test_what_the_report_needs_is_asked_for_before_anything_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = whole.importlib.util.find_spec
    monkeypatch.setattr(whole.importlib.util, "find_spec", lambda name: None if name == "jinja2" else found(name))
    with pytest.raises(StudyError, match=r"needs 'jinja2': pip install 'homeostat\[campaign\]'"):
        run_study("t", jobs(scenarios=[BATCH]), tmp_path / "out", Workers(1), lambda progress: None, lambda row: "")
    assert not (tmp_path / "out").exists()
