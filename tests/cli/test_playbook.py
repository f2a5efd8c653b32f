"""``homeostat run --playbook`` and ``homeostat playbook``: what they read, add, print, and refuse."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

from homeostat.domain.playbook import Aftermath, Ending
from homeostat.journal import read_events
from homeostat.journal.beside.manifest import read_manifest
from homeostat.journal.verify.verify import verify
from homeostat.record import playbook
from homeostat.record.playbook import add_to_playbook, read_playbook
from tests.agents.entries import entry, stuck
from tests.cli.command import homeostat, homeostat_process, refused
from tests.cli.conftest import RECOVERY

SHORT = (*RECOVERY[:7], "960", *RECOVERY[8:])
"""The run of every test here, ended soon after its release."""


@pytest.mark.slow
def test_a_run_makes_its_playbook_and_the_next_one_begins_with_it(tmp_path: Path) -> None:
    done = homeostat(*SHORT, "--playbook", "book.jsonl", cwd=tmp_path)
    assert done.err.endswith("homeostat: 1 entry added to book.jsonl\n")
    assert (tmp_path / "run" / "playbook.jsonl").read_bytes() == b"", "it began with nothing"
    before = (tmp_path / "book.jsonl").read_bytes()
    again = homeostat(*SHORT[:-1], "again", "--playbook", "book.jsonl", "--severity", "0.68", cwd=tmp_path)
    assert "1 by playbook, normal > reduced_load" in again.out
    assert len(read_playbook(tmp_path / "book.jsonl").entries) == 2
    assert (tmp_path / "again" / "playbook.jsonl").read_bytes() == before, "as it was when the run began"
    (began,) = (r for r in read_events(tmp_path / "again") if r.kind == "run-started")
    stated = {s["name"]: s["value"] for s in began.fields["configuration"]}
    manifest = read_manifest(tmp_path / "again")
    assert manifest is not None
    (kept,) = (file for file in manifest.files if file.name == "playbook.jsonl")
    assert kept.sha256 == stated["playbook"] and verify(tmp_path / "again").complete
    replayed = homeostat("replay", "again", cwd=tmp_path)
    assert (replayed.status, replayed.out) == (0, again.out)


@pytest.mark.slow
def test_what_is_wrong_in_a_playbook_is_told_and_the_run_goes_on(tmp_path: Path) -> None:
    add_to_playbook(tmp_path / "book", [entry(), entry(stuck(0.6), configuration="0" * 64)])
    with (tmp_path / "book").open("ab") as file:
        file.write(b'{"format":1,"half\n')
    before = (tmp_path / "book").read_bytes()
    done = homeostat(*SHORT, "--playbook", "book", cwd=tmp_path)
    told = [line for line in done.err.splitlines() if "playbook 'book'" in line]
    assert len(told) == 2 and "line 3: it is no entry" in told[0]
    assert "1 of 2 entries are of another configuration than cstr has now" in told[1] and "build it again" in told[1]
    assert "proposed  1 by playbook" in done.out
    after = (tmp_path / "book").read_bytes()
    assert after.startswith(before) and len(after) > len(before)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_file_that_cannot_be_written_changes_nothing_about_the_run(tmp_path: Path) -> None:
    add_to_playbook(tmp_path / "book", [entry()])
    (tmp_path / "book").chmod(0o444)
    done = homeostat(*SHORT, "--playbook", "book", cwd=tmp_path)
    assert "the playbook was not added to" in done.err and "released" in done.out


@pytest.mark.wide
def test_a_playbook_that_is_full_changes_nothing_about_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    add_to_playbook(tmp_path / "book", [entry()])
    before = (tmp_path / "book").read_bytes()
    monkeypatch.setattr(playbook, "MOST_BYTES", len(before) + 1)
    done = homeostat(*SHORT, "--playbook", "book", cwd=tmp_path)
    assert "homeostat: the playbook was not added to" in done.err and "begin another file" in done.err
    assert "released" in done.out and (tmp_path / "book").read_bytes() == before


def test_what_cannot_be_a_playbook_is_refused_before_the_run(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    refused(homeostat(*SHORT, "--playbook", "pipe", cwd=tmp_path), "is no file")
    refused(homeostat(*SHORT, "--playbook", ".", cwd=tmp_path), "is no file")
    refused(homeostat(*SHORT, "--playbook", "gone/book", cwd=tmp_path), "there is no such folder; make it first")
    refused(homeostat(*SHORT, "--playbook", "b", "--protocol", "per-step", cwd=tmp_path), "whole recoveries")
    assert not (tmp_path / "run").exists()


def test_the_table_says_situation_action_cost_margin_and_outcome(tmp_path: Path) -> None:
    held = Aftermath(Ending.HELD, 600.0, 1.4)
    nothing = entry(stuck(0.9), answer=None, reason="no answer: no path is open", source="built: \x1b[2J")
    add_to_playbook(tmp_path / "book", [entry(stuck(0.7, 0.8), stuck(0.6, 0.2), aftermath=held), nothing])
    done = homeostat("playbook", "show", "book", cwd=tmp_path)
    assert (done.status, done.err) == (0, "")
    title, heads, _, first, second = done.out.splitlines()
    assert title.startswith("configuration ") and title.endswith(", 2 entries")
    assert heads.split() == ["situation", "action", "cost", "margin", "outcome"]
    assert "normal: cool_stuck_closed 0.7" in first and "F1.sp 0.0205, L1.sp 10, T1.sp 310, V2.man automatic" in first
    assert "39.0%" in first and "+0.4 K (ACC-T-HIGH), at most 0.008 violate" in first
    assert "held for 600 s, +1.4 K read; a test" in first
    assert "no answer: no path is open" in second and "\\x1b[2J" in second and "\x1b" not in done.out


def test_what_is_no_entry_is_told_beside_the_table(tmp_path: Path) -> None:
    add_to_playbook(tmp_path / "book", [entry()])
    (tmp_path / "book").write_bytes((tmp_path / "book").read_bytes() + b"x\n")
    done = homeostat("playbook", "show", "book", cwd=tmp_path)
    assert done.status == 1 and "F1.sp 0.0205" in done.out
    assert done.err.startswith("homeostat: playbook 'book', line 2: it is no entry") and done.err.count("\n") == 1


def test_a_playbook_that_is_not_there_cannot_be_shown(tmp_path: Path) -> None:
    refused(homeostat("playbook", "show", "book", cwd=tmp_path), "there is no playbook 'book'")


BUILD = ("playbook", "build", "cstr", "--severities", "1", "--out", "book")


@pytest.mark.slow
def test_a_playbook_is_built_and_gone_on_with(tmp_path: Path) -> None:
    done = homeostat(*BUILD, "--faults", "cool_stuck_closed", cwd=tmp_path)
    assert (done.status, done.err.replace("homeostat: compiling, once\n", "")) == (0, "")
    begin, first, end = done.out.splitlines()
    assert begin == "1 situations, 0 of them in book already"
    assert first.startswith("1 of 1: cool_stuck_closed 0.7 in normal: reduced_load: F1.sp ")
    assert end == "1 answers; 0 without an answer, where the fallback acts; 0 where nothing need be done"
    more = homeostat(*BUILD, "--faults", "cool_stuck_closed,level_bias", cwd=tmp_path)
    assert more.out.startswith("2 situations, 1 of them in book already\n1 of 1: level_bias")
    same = homeostat(*BUILD, "--faults", "level_bias", "--faults", "cool_stuck_closed", cwd=tmp_path)
    assert same.out.splitlines()[0] == "2 situations, 2 of them in book already" and same.status == 0
    assert len(read_playbook(tmp_path / "book").entries) == 2


@pytest.mark.wide
def test_several_processes_build_the_same(tmp_path: Path) -> None:
    alone = homeostat(*BUILD, "--faults", "cool_stuck_closed,level_bias", cwd=tmp_path)
    (tmp_path / "book").rename(tmp_path / "alone")
    both = homeostat_process(*BUILD, "--faults", "cool_stuck_closed,level_bias", "--jobs", "2", cwd=tmp_path)
    assert alone.status == both.status == 0
    assert set(read_playbook(tmp_path / "alone").entries) == set(read_playbook(tmp_path / "book").entries)


def test_what_the_plant_does_not_have_is_refused(tmp_path: Path) -> None:
    refused(homeostat(*BUILD, "--faults", "leek", cwd=tmp_path), "did you mean 'leak'")
    refused(homeostat(*BUILD, "--states", "holding", cwd=tmp_path), "it has normal")
    refused(homeostat("playbook", "build", "none", "--out", "book", cwd=tmp_path), "unknown plant")
    assert not (tmp_path / "book").exists()


@pytest.mark.slow
def test_a_run_that_was_killed_goes_on_with_the_playbook_that_it_began_with(tmp_path: Path) -> None:
    add_to_playbook(tmp_path / "book", [replace(entry(), source="before")])
    homeostat(*SHORT, "--playbook", "book", cwd=tmp_path)
    run = tmp_path / "run"
    for name in ("manifest.json", "result.json"):
        (run / name).unlink()
    lines = (run / "events.jsonl").read_bytes().splitlines(keepends=True)
    until = next(n for n, each in enumerate(lines) if b'"event":"noticed"' in each)
    (run / "events.jsonl").write_bytes(b"".join(lines[:until]))
    altered = homeostat("resume", "run", "--out", "copy", cwd=tmp_path)
    assert (
        "1 by playbook" in altered.out and "nothing is added to it" in altered.err and "entry added" not in altered.err
    )
    (run / "playbook.jsonl").write_bytes(b"")
    refused(homeostat("resume", "run", "--out", "other", cwd=tmp_path), "is not the playbook that it began with")
