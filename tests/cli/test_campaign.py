"""``homeostat campaign`` as users start it: stopped, killed, spread over workers, asked for one job."""

from __future__ import annotations

import random
import re
import signal
from pathlib import Path

import pytest

from homeostat.cli.main import main
from homeostat.journal.verify.verify import verify
from tests.cli.campaigns import (
    JOBS,
    SMALL,
    cluster,
    ended,
    one_worker,
    prints,
    rows_in,
    started,
    stop,
    table,
    tables,
    wait_for,
)
from tests.cli.command import homeostat, refused

LONG = ("--seeds", "400")
"""Options of a study that does not come to its end while it is talked to."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study that nobody disturbed."""
    folder = tmp_path_factory.mktemp("whole")
    status, out, err = ended(started(folder, "--workers", "1"))
    assert (status, rows_in(folder / "out")) == (0, JOBS), err
    assert out.endswith("wrote out/results.parquet\nwrote out/report.html\n")
    assert err.startswith("0 of 16 runs in 0 s\n") and re.search(r"\n16 of 16 runs in \d+ s\n$", err)
    return folder / "out"


def same(folder: Path, whole: Path) -> bool:
    """The study in ``folder`` came to what the undisturbed one came to, and did nothing twice."""
    assert len(prints(folder)) == len(set(prints(folder))) == JOBS
    return table(folder) == table(whole) and tables(folder) == tables(whole)


@pytest.mark.slow
@pytest.mark.parametrize("times", [1, pytest.param(2, marks=pytest.mark.wide)])
def test_killed_and_killed_again(tmp_path: Path, whole: Path, times: int) -> None:
    out, draw, kept = tmp_path / "out", random.Random(5), 0
    for least in (draw.randint(1, 4), draw.randint(6, 10))[:times]:
        process = started(tmp_path, "--workers", "1")
        wait_for(lambda least=least: rows_in(out) >= least, f"{least} rows")  # type: ignore[misc]
        assert stop(process, signal.SIGKILL)[0] == -signal.SIGKILL
        assert rows_in(out) >= max(kept, least)
        kept = rows_in(out)
    status, _, err = ended(started(tmp_path, "--workers", "1"))
    assert status == 0 and err.startswith(f"0 of {JOBS - kept} runs in 0 s\n")
    assert same(out, whole)


@pytest.mark.slow
def test_ctrl_c_says_how_to_go_on(tmp_path: Path) -> None:
    process = started(tmp_path, "--workers", "1", *LONG)
    wait_for(lambda: rows_in(tmp_path / "out") >= 2, "two rows")
    status, out, err = stop(process, signal.SIGINT)
    assert (status, out) == (130, "")
    assert err.endswith("\nstopped; the same command goes on from what is in out\nhomeostat: interrupted\n")
    assert "Traceback" not in err


@pytest.mark.wide
def test_two_workers_and_ctrl_c_and_two_workers(tmp_path: Path, whole: Path) -> None:
    process = started(tmp_path, "--workers", "2")
    wait_for(lambda: rows_in(tmp_path / "out") >= 2, "two rows")
    status, out, err = stop(process, signal.SIGINT)
    assert (status, out) == (130, "") and "Traceback" not in err
    assert err.endswith("\nstopped; the same command goes on from what is in out\nhomeostat: interrupted\n")
    status, _, err = ended(started(tmp_path, "--workers", "2"))
    assert status == 0 and "Traceback" not in err and "Warning" not in err
    assert same(tmp_path / "out", whole)


@pytest.mark.slow
def test_a_cluster_that_loses_a_worker(tmp_path: Path, whole: Path) -> None:
    with cluster(tmp_path, 2) as (address, workers):
        process = started(tmp_path, "--cluster", address)
        wait_for(lambda: rows_in(tmp_path / "out") >= 2, "two rows")
        workers[0].kill()
        status, _, err = ended(process)
    assert status == 0 and "failed" not in err and "Traceback" not in err
    assert same(tmp_path / "out", whole)


@pytest.mark.wide
def test_a_worker_that_joins_takes_what_is_left(tmp_path: Path, whole: Path) -> None:
    with cluster(tmp_path, 1) as (address, workers):
        process = started(tmp_path, "--cluster", address)
        wait_for(lambda: rows_in(tmp_path / "out") >= 1, "a row")
        workers[0].kill()
        assert rows_in(tmp_path / "out") < JOBS
        workers.append(one_worker(address))
        status, _, err = ended(process)
    assert status == 0 and "failed" not in err and "Traceback" not in err
    assert same(tmp_path / "out", whole)


@pytest.mark.slow
@pytest.mark.parametrize("address", [pytest.param("nonsense", marks=pytest.mark.wide), ""])
def test_a_cluster_that_is_not_there_leaves_nothing_behind(tmp_path: Path, address: str) -> None:
    status, out, err = ended(started(tmp_path, "--cluster", address))
    assert (status, out) == (2, "") and f"\nhomeostat: no scheduler answers at '{address}' (" in err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_second_campaign_in_the_same_folder_is_refused(tmp_path: Path) -> None:
    process = started(tmp_path, "--workers", "1", *LONG)
    wait_for(lambda: rows_in(tmp_path / "out") >= 1, "a row")
    second = homeostat("campaign", "small.toml", "--out", "out", cwd=tmp_path)
    status, _, _ = stop(process, signal.SIGKILL)
    assert status == -signal.SIGKILL
    refused(second, "'out' is in use by another study; wait for it or choose --out")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a study, where the command is."""
    (tmp_path / "small.toml").write_text(SMALL)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def said(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    status = main(["campaign", "small.toml", *arguments])
    return status, *capsys.readouterr()


def test_list_names_the_jobs_and_runs_nothing(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = said(capsys, "--list")
    names = out.splitlines()
    assert (status, err, len(names)) == (0, "", JOBS)
    assert names[:2] == ["mixing_module~none~1~do-nothing~none", "mixing_module~none~1~hindsight~none"]
    assert [path.name for path in here.iterdir()] == ["small.toml"]


def test_seeds_and_a_proposer_more(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("small.toml").write_text(SMALL + "seeds = [7]\n")  # the option counts for scenarios that have their own, too
    assert said(capsys, "--list", "--seeds", "1")[1].count("\n") == 4
    status, out, _ = said(
        capsys, "--list", "--seeds", "2", "--proposer", "scripted:reasonable", "--proposer", "hindsight"
    )
    names = out.splitlines()
    assert (status, len(names)) == (0, 12)
    assert sum("~scripted-reasonable~none" in name for name in names) == 4
    assert sum("~hindsight~" in name for name in names) == 4  # it was there already


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--proposer", "scripted:wise"), ("'scripted:wise'", "scripted:reasonable")),
        (("--proposer", ""), ("proposer ''",)),
        (
            ("--only", "mixing_module~none~1~do-nothin~none"),
            ("did you mean 'mixing_module~none~1~do-nothing~none'", "16"),
        ),
    ],
)
def test_refused(
    here: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], words: tuple[str, ...]
) -> None:
    status, out, err = said(capsys, *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1) and all(word in err for word in words)
    assert [path.name for path in here.iterdir()] == ["small.toml"]


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("--seeds", "0"), "1 to 10000"), (("--seeds", "some"), "whole number"), (("--workers", "0"), "1 to 1024"),
        (("--workers", "2", "--cluster", "tcp://x:1"), "not allowed with"), (("--work", "2"), "--work"),
        (("--temperature", "nan"), "finite"),
    ],
)  # fmt: skip
def test_options_that_are_refused(
    here: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], word: str
) -> None:
    with pytest.raises(SystemExit) as left:
        main(["campaign", "small.toml", *arguments])
    out, err = capsys.readouterr()
    assert (left.value.code, out, err.count("\n")) == (2, "", 1) and word in err
    assert [path.name for path in here.iterdir()] == ["small.toml"]


def test_one_job_alone_is_kept(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run, best = "mixing_module~pump_failure~2~do-nothing~none", "mixing_module~pump_failure~2~hindsight~none"
    status, out, err = said(capsys, "--only", run, "--only", best, "--out", "kept")
    assert (status, err) == (0, "")
    assert out == f"{run}: no_action, in kept/runs/{run}\n{best}: possible, nothing to keep\n"
    assert verify(here / "kept" / "runs" / run).complete
    assert sorted(path.name for path in here.iterdir()) == ["kept", "small.toml"]


def test_one_job_that_fails(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("small.toml").write_text(SMALL.replace("400.0", "1.0"))
    assert main(["campaign", "small.toml", "--list"]) == 2  # the onset is after the end
    capsys.readouterr()
    Path("small.toml").write_text(SMALL.partition("[[scenarios]]")[0] + '[[scenarios]]\ncase = "cstr"\nend_s = 1.0\n')
    status, out, err = said(capsys, "--only", "cstr~none~1~do-nothing~none")
    assert (status, err) == (1, "") and out.count("\n") == 1 and "before there is anything to judge" in out


def test_the_command_that_repeats_a_row_asks_as_the_campaign_did(here: Path) -> None:
    from homeostat.cli.commands.campaign import _given
    from homeostat.cli.parser import parser
    from homeostat.evaluate.study.study import rerun_command
    from tests.evaluate.study.fake_rows import plain

    options = [
        "--proposer", "scripted:reasonable", "--local-only", "--allow-host", "a b", "--temperature", "0.5",
        "--model-seed", "3", "--seeds", "2",
    ]  # fmt: skip
    given = _given(parser().parse_args(["campaign", "small.toml", *options, "--workers", "2"]))
    assert sorted(given) == sorted(options)
    command = rerun_command(Path("small.toml"), given)(plain(job="x~y"))
    assert command.startswith(
        "homeostat campaign small.toml --proposer scripted:reasonable --local-only --allow-host 'a b'"
    )
    assert command.endswith(" --only 'x~y'") or command.endswith(" --only x~y")


def test_help_says_what_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(["campaign", "--help"])
    out = " ".join(capsys.readouterr().out.split())
    assert left.value.code == 0
    for word in (
        "FILE.toml",
        "--out",
        "--workers",
        "--cluster",
        "--proposer",
        "--seeds",
        "--only",
        "--list",
        "goes on where",
    ):
        assert word in out
