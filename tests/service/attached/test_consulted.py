"""The served reactor attached with a model and a playbook, with real processes: a model costs nothing but its time."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")
pytest.importorskip("pydantic_ai", reason="the extra 'llm' is not installed")

from homeostat.journal import Record, read_events
from homeostat.journal.verify.verify import verify
from homeostat.record.playbook import read_playbook
from tests.equipment.opcua.attached import Attached, Reactor, until
from tests.llm.servers import hostile

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

SCALE = 5.0
KEY = "sk-never-written-anywhere-0123456789"


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Reactor]:
    with Reactor(tmp_path_factory.mktemp("served"), SCALE) as reactor:
        yield reactor


@pytest.fixture
def live(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HOMEOSTAT_LLM_KEY", KEY)
    return tmp_path / "live"


def of(live: Path, kind: str) -> list[Record]:
    return [e for e in read_events(live) if e.kind == kind]


def command_lines(of_pid: int) -> str:
    return Path(f"/proc/{of_pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()


def recovers(attached: Attached, served: Reactor) -> None:
    attached.waits_for(lambda now: now["thinking"]["process"] and now["now_s"] is not None, "thinking")
    assert attached.order("mode", "closed-loop", "--reason", "test")[0] == 0
    attached.waits_for(lambda now: now["state"] == "normal", "normal operation", 400.0)
    served.ask("fault cool_stuck_open")
    attached.waits_for(lambda now: bool(of(attached.directory, "released")), "a release", 400.0)


def test_a_server_that_hangs_costs_nothing_and_what_helped_is_there_for_the_next_thinking(
    served: Reactor, live: Path
) -> None:
    served.ask("behave")
    served.ask("begin")
    book, calls = live.parent / "book.jsonl", live.parent / "calls.jsonl"
    with hostile() as url:
        options = (
            "--proposer", f"{url}#hang", "--local-only", "--answer-timeout", "3", "--budget", "300",
            "--playbook", str(book), "--record", str(calls),
        )  # fmt: skip
        with Attached(served, live, *options) as attached:
            recovers(attached, served)
            now = attached.status
            assert now["latched"] is None and now["ticks"]["longest_s"] < 2.0 and now["link"]["missed"] <= 1
            assert "llvmlite" not in Path(f"/proc/{now['guard_process']}/maps").read_text()
            assert KEY not in command_lines(now["thinking"]["process"])
            assert {e.fields["failure"] for e in of(live, "model-called")} <= {"TIMEOUT"}, "asked where it could win"
            assert of(live, "released")[0].fields["proposer"] in ("search", "playbook")
            (entry,) = until(lambda: read_playbook(book).entries, "an entry")
            assert entry.answer is not None and entry.occasion.mode == "closed-loop"
            os.kill(now["thinking"]["process"], signal.SIGKILL)
            attached.waits_for(lambda now: now["thinking"]["begun"] == 2 and now["thinking"]["process"], "another one")
            began = of(live, "thinking-began")
            assert began[1].fields["playbook"] != began[0].fields["playbook"], "it begins with what was added"
            assert (live / "playbooks" / f"{began[1].fields['playbook']}.jsonl").exists()
            assert attached.interrupt() == 0
    report = verify(live)
    assert report.complete and report.contradictions == ()
    stated = next(read_events(live)).fields["configuration"]
    chosen = {each["name"]: each["value"] for each in stated}
    assert chosen["proposer"] == f"{url}#hang" and chosen["grounding"] == "graph" and chosen["budget_s"] == 300.0
    for path in (p for p in live.parent.rglob("*") if p.is_file()):
        assert KEY.encode() not in path.read_bytes(), path
    assert calls.exists() and '"failure": null' not in calls.read_text()


def test_a_recording_that_is_gone_leaves_the_search_and_is_an_alarm(served: Reactor, live: Path) -> None:
    served.ask("repair")
    served.ask("begin")
    calls = live.parent / "calls.jsonl"
    calls.touch()
    with Attached(served, live, "--proposer", f"replay:{calls}") as attached:
        first = attached.waits_for(lambda now: now["thinking"]["process"], "thinking")["thinking"]["process"]
        calls.unlink()
        os.kill(first, signal.SIGKILL)
        attached.waits_for(lambda now: now["thinking"]["begun"] == 2 and now["thinking"]["process"], "another one")
        now = attached.waits_for(lambda now: any("recovery:model" in str(a) for a in now["alarms"]), "an alarm")
        assert now["mode"]["actual"] == "observe" and now["ticks"]["longest_s"] < 2.0
    assert verify(live).complete
