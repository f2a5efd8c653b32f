"""Orders to a run that goes on: a person at a second terminal."""

from __future__ import annotations

import shutil
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from homeostat.journal import read_events
from homeostat.journal.verify.verify import verify
from tests.cli.command import COMMAND, LIMIT_S, environment, homeostat, refused


@dataclass
class Going:
    """A run in a process of its own."""

    process: subprocess.Popen[str]
    cwd: Path

    def told(self, label: str) -> str:
        """The first line with ``label``, as soon as it is there."""
        deadline = time.monotonic() + LIMIT_S
        while time.monotonic() < deadline and self.process.poll() is None:
            for line in (self.cwd / "out.txt").read_text().splitlines():
                if f" s  {label:<9} " in line:
                    return line
            time.sleep(0.1)
        raise AssertionError((self.cwd / "out.txt").read_text() + (self.cwd / "err.txt").read_text())

    def order(self, verb: str, *about: str) -> tuple[int, str]:
        """Exit status and output of an order."""
        done = homeostat(verb, "run", *about, cwd=self.cwd)
        return done.status, done.out or done.err


def going(cwd: Path, *arguments: str) -> Iterator[Going]:
    with (cwd / "out.txt").open("w") as out, (cwd / "err.txt").open("w") as err:
        command = [*COMMAND, "run", "mixing_module", "--out", "run", *arguments]
        process = subprocess.Popen(command, cwd=cwd, env=environment(), stdout=out, stderr=err, text=True)
    try:
        yield Going(process, cwd)
    finally:
        process.kill()
        process.wait(LIMIT_S)


@pytest.fixture
def faulty(tmp_path: Path) -> Iterator[Going]:
    """A run in mode approve, to whose fault the search has an answer."""
    yield from going(tmp_path, "--mode", "approve", "--pace", "4", "--fault", "stuck_closed_VI202", "--onset", "30")


@pytest.fixture
def healthy(tmp_path: Path) -> Iterator[Going]:
    """A run in mode approve without a fault, slow enough to be talked to."""
    yield from going(tmp_path, "--mode", "approve", "--pace", "3")


@pytest.mark.slow
def test_a_request_is_listed_and_approved(faulty: Going) -> None:
    offered = faulty.told("offered")
    command = offered.partition("homeostat approve ")[2].split()
    assert command[0] == "run" and command[2] == "--digest"
    request, digest = command[1], command[3]
    status, listed = faulty.order("approve")
    assert status == 0 and f"{request}  by search  --digest {digest}" in listed
    assert "VI202.cmd to" in listed and "  leads to  held, by" in listed and "stuck_closed_VI202" in listed
    status, text = faulty.order("approve", request)
    assert status == 2 and "--digest" in text
    assert faulty.order("approve", request, "--digest", "0" * 12)[0] == 3
    assert faulty.order("approve", request, "--digest", digest, "--person", "Ada") == (0, f"approve {request}: done\n")
    faulty.told("released")
    assert f"approved {request} by Ada" in (faulty.cwd / "out.txt").read_text()
    confirmed = [e for e in read_events(faulty.cwd / "run") if e.fields.get("status") == "confirmed"]
    assert [e.fields["request"] for e in confirmed] == [request]


@pytest.mark.slow
def test_people_change_service_mode_and_more_while_a_run_goes_on(healthy: Going) -> None:
    healthy.told("state")
    status, listed = healthy.order("approve")
    assert status == 0 and listed.startswith("no request waits for a person at ")
    assert healthy.order("fall-back", "--reason", "smoke")[0] == 0
    healthy.told("latched")
    assert healthy.order("in-service", "VI203.cmd", "--out")[0] == 3  # without a reason
    assert healthy.order("in-service", "VI203.cmd", "--out", "--reason", "maintenance")[0] == 0
    status, said = healthy.order("in-service", "VI203.cmdd")
    assert status == 3 and "there is no tag 'VI203.cmdd'; did you mean 'VI203.cmd'" in said
    assert healthy.order("mode", "approve", "--role", "operator") == (
        3, "mode approve: refused, only an engineer may order 'mode'\n"
    )  # fmt: skip
    assert healthy.order("acknowledge", "latched")[0] == 0
    assert healthy.order("reset", "--reason", "false alarm", "--person", "Ada")[0] == 0
    assert "by Ada: false alarm; the plant stands in 'aborted'" in healthy.told("reset")
    assert healthy.order("start", "t_restart_aborted")[0] == 3  # in observe nobody writes
    assert healthy.order("mode", "closed-loop", "--reason", "go on")[0] == 0
    assert healthy.order("in-service", "VI203.cmd")[0] == 0
    assert healthy.order("start", "t_restart_aborted") == (0, "start t_restart_aborted: done\n")
    report = verify(healthy.cwd / "run")
    assert report.intact and report.contradictions == ()


def test_an_order_to_nothing_is_refused(tmp_path: Path, record: Path) -> None:
    refused(homeostat("reset", "nowhere", "--reason", "x", cwd=tmp_path), "nowhere")
    refused(homeostat("reset", str(record), "--reason", "x", cwd=tmp_path), "is over")
    refused(homeostat("approve", str(record), cwd=tmp_path), "is over")
    shutil.copytree(record, tmp_path / "emptied")
    (tmp_path / "emptied" / "manifest.json").unlink()
    refused(homeostat("approve", "emptied", cwd=tmp_path), "does not go on")
    (tmp_path / "emptied" / "events.jsonl").write_bytes(b"")
    refused(homeostat("approve", "emptied", cwd=tmp_path), "no run that has begun")
    refused(homeostat("approve", str(record), "r", "--digest", "abc", cwd=tmp_path), "8 or more")
    refused(homeostat("reset", str(record), cwd=tmp_path), "--reason")


def test_the_first_of_two_people_is_heard(tmp_path: Path) -> None:
    for run in going(tmp_path, "--pace", "2", "--persons", "2"):
        run.told("state")
        assert run.order("fall-back", "--reason", "smoke")[0] == 0
        run.told("latched")
        said = "reset: heard; 1 of 2 people; another person must order it too\n"
        assert run.order("reset", "--reason", "no smoke", "--person", "Ada") == (0, said)
        assert run.order("reset", "--reason", "no smoke", "--person", "Bo") == (0, "reset: done\n")
        assert "by Ada and Bo" in run.told("reset")
        assert "Ada (engineer) ordered reset; 1 of 2 people" in (run.cwd / "out.txt").read_text()


def test_where_a_person_decides_in_real_time_no_thinking_is_declared(tmp_path: Path) -> None:
    command = ("run", "cstr", "--mode", "approve", "--thinking-declared", "1")
    refused(homeostat(*command, cwd=tmp_path), "real time")


@pytest.mark.slow
def test_in_advise_what_would_be_released_is_shown_and_nobody_writes(tmp_path: Path) -> None:
    done = homeostat(
        "run", "mixing_module", "--fault", "stuck_closed_VI202", "--mode", "advise", "--end", "110", "--out", "run",
        "--thinking-declared", "1", cwd=tmp_path,
    )  # fmt: skip
    assert "advise: nobody writes" in done.out and done.out.count(" s  advice    search-1") == 1
    assert not [e for e in read_events(tmp_path / "run") if e.kind.startswith("write")]
    assert homeostat("replay", "run", cwd=tmp_path).out == done.out
