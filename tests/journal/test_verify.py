"""Attacks on a stored run: whatever is changed, verification says so and never vouches for a changed line."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from homeostat.journal import BrokenChain, Journal, Summary, read_events
from homeostat.journal.beside.artifacts import write_text
from homeostat.journal.chain import digest
from homeostat.journal.encode import canonical
from homeostat.journal.reading import parse
from homeostat.journal.verify.verify import verify
from tests.journal.samples import write_open_run, write_run

pytestmark = pytest.mark.quick

LINES = 8


@pytest.fixture(scope="module")
def closed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A closed run of LINES lines; tests put back what they change."""
    directory = tmp_path_factory.mktemp("closed")
    write_run(directory, events=LINES - 2)
    return directory


@pytest.fixture(scope="module")
def left(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same run without manifest."""
    directory = tmp_path_factory.mktemp("left")
    write_open_run(directory, events=LINES - 2)
    return directory


@pytest.fixture
def copy(closed: Path, tmp_path: Path) -> Iterator[Path]:
    yield Path(shutil.copytree(closed, tmp_path / "copy"))


def unharmed(before: list[bytes], after: list[bytes]) -> int:
    """Number of leading lines that are the same."""
    same = [a == b for a, b in zip(before, after, strict=False)]
    return same.index(False) if False in same else len(same)


def attack(directory: Path, content: bytes) -> None:
    """Replace the journal, expect detection, put the journal back."""
    journal = directory / "events.jsonl"
    original = journal.read_bytes()
    assume(content != original)
    journal.write_bytes(content)
    try:
        report = verify(directory)
    finally:
        journal.write_bytes(original)
    assert not report.complete and not report.intact and report.problem and "\n" not in report.problem
    assert report.lines <= unharmed(original.splitlines(True), content.splitlines(True))


def test_an_untouched_run_is_complete(closed: Path, left: Path) -> None:
    whole, open_run = verify(closed), verify(left)
    assert (whole.lines, whole.complete, whole.intact, whole.problem) == (LINES, True, True, None)
    assert (open_run.lines, open_run.complete, open_run.intact) == (LINES, False, True)
    assert open_run.problem == f"incomplete run: verifies up to line {LINES}"


@given(st.data())
def test_any_changed_byte_is_found(closed: Path, data: st.DataObject) -> None:
    content = bytearray((closed / "events.jsonl").read_bytes())
    place = data.draw(st.integers(0, len(content) - 1))
    content[place] = data.draw(st.integers(0, 255))
    attack(closed, bytes(content))


@given(st.data())
def test_any_changed_byte_of_the_manifest_is_found(closed: Path, data: st.DataObject) -> None:
    manifest = closed / "manifest.json"
    original = manifest.read_bytes()
    changed = bytearray(original)
    changed[data.draw(st.integers(0, len(changed) - 1))] = data.draw(st.integers(0, 255))
    assume(changed != original)
    manifest.write_bytes(changed)
    try:
        report = verify(closed)
    finally:
        manifest.write_bytes(original)
    assert not report.complete and not report.intact and report.problem and "manifest.json" in report.problem


@given(st.data())
def test_missing_moved_repeated_and_added_lines_are_found(closed: Path, data: st.DataObject) -> None:
    lines = (closed / "events.jsonl").read_bytes().splitlines(True)
    here, there = data.draw(st.integers(0, LINES - 1)), data.draw(st.integers(0, LINES))
    match data.draw(st.sampled_from(["drop", "swap", "repeat", "insert", "cut", "tear"])):
        case "drop":
            del lines[here]
        case "swap":
            other = there % LINES
            lines[here], lines[other] = lines[other], lines[here]
        case "repeat":
            lines.insert(there, lines[here])
        case "insert":
            lines.insert(there, data.draw(st.sampled_from([b"\n", b"{}\n", b"[" * 100_000 + b"\n", b"\xff\xfe\n"])))
        case "cut":
            lines = lines[:here]
        case "tear":
            lines[-1] = lines[-1][: data.draw(st.integers(0, len(lines[-1]) - 1))]
    attack(closed, b"".join(lines))


@given(st.data())
def test_two_attacks_at_once_do_not_vouch_for_a_changed_line(closed: Path, data: st.DataObject) -> None:
    lines = (closed / "events.jsonl").read_bytes().splitlines(True)
    place = data.draw(st.integers(0, LINES - 2))
    forged = json.loads(lines[place])
    forged["at_s"] += 1.0
    lines[place] = canonical(forged).encode() + b"\n"
    later = data.draw(st.integers(place + 1, LINES - 1))
    lines[later : later + 1] = data.draw(st.sampled_from([[], [b"garbage\n"], [lines[later], lines[later]]]))
    attack(closed, b"".join(lines))


def test_a_changed_last_line_is_not_vouched_for_when_more_is_wrong(copy: Path) -> None:
    journal = copy / "events.jsonl"
    changed = journal.read_bytes().replace(b'"outcome":"released"', b'"outcome":"reversed"')
    journal.write_bytes(changed + b"torn")
    assert verify(copy).lines == LINES - 1
    journal.write_bytes(changed)
    (copy / "manifest.json").write_bytes(b"{}")
    assert verify(copy).lines == LINES - 1


@pytest.mark.parametrize("ending", [b"", b"\n"])
def test_a_line_that_continues_a_closed_run_is_found(copy: Path, ending: bytes) -> None:
    journal = copy / "events.jsonl"
    content = journal.read_bytes()
    last = content.splitlines()[-1]
    more = canonical({"seq": LINES + 1, "prev": digest(last), "at_s": 9.0, "event": "measured"}).encode()
    journal.write_bytes(content + more + ending)
    report = verify(copy)
    assert (report.lines, report.complete, report.intact) == (LINES, False, False)
    assert report.problem == f"something was added to the journal after line {LINES}, its last"


@pytest.mark.parametrize(
    "line",
    [
        b'{"seq":1.0,"prev":"0","at_s":0.0,"event":"x"}',
        b'{"seq":1,"prev":0,"at_s":0.0,"event":"x"}',
        b'{"seq":1,"prev":"0","at_s":"NaN","event":"x"}',
        b'{"seq":1,"prev":"0","at_s":0.0,"event":null}',
        b'{"prev":"0","seq":1,"at_s":0.0,"event":"x"}',
        b'[1,"0",0.0,"x"]',
    ],
)
def test_a_line_of_another_shape_is_none(line: bytes) -> None:
    with pytest.raises(ValueError, match="must be"):
        parse(line)


@given(st.integers(0, LINES - 1))
def test_a_forged_line_with_its_own_number_and_digest_is_found(closed: Path, place: int) -> None:
    lines = (closed / "events.jsonl").read_bytes().splitlines()
    forged = json.loads(lines[place])
    forged["at_s"] += 1.0
    lines[place] = canonical(forged).encode()
    attack(closed, b"\n".join(lines) + b"\n")


def test_a_chain_forged_to_its_end_still_contradicts_the_manifest(copy: Path) -> None:
    lines = [json.loads(line) for line in (copy / "events.jsonl").read_bytes().splitlines()]
    lines[3]["value"] = 0.0
    forged, last = [], "0" * 64
    for content in lines:
        raw = canonical({**content, "prev": last}).encode()
        forged.append(raw + b"\n")
        last = digest(raw)
    (copy / "events.jsonl").write_bytes(b"".join(forged))
    assert len(list(read_events(copy))) == LINES
    report = verify(copy)
    assert not report.intact and report.problem and report.problem.startswith(f"line {LINES}, the last, was altered")


@given(st.data())
def test_without_manifest_every_line_but_the_last_is_still_protected(left: Path, data: st.DataObject) -> None:
    content = bytearray((left / "events.jsonl").read_bytes())
    confirmed = content[:-1].rindex(b"\n")
    content[data.draw(st.integers(0, confirmed))] = data.draw(st.integers(0, 255))
    attack(left, bytes(content))


@given(st.data())
def test_a_run_cut_anywhere_verifies_to_its_last_whole_line(left: Path, data: st.DataObject) -> None:
    journal = left / "events.jsonl"
    original = journal.read_bytes()
    rest = original[: data.draw(st.integers(0, len(original)))]
    journal.write_bytes(rest)
    try:
        report, records = verify(left), list(read_events(left))
    finally:
        journal.write_bytes(original)
    whole = rest.count(b"\n")
    torn = "" if rest.endswith(b"\n") or not rest else f"; line {whole + 1} is torn"
    assert (report.lines, report.complete, report.intact) == (whole, False, True)
    assert report.problem == f"incomplete run: verifies up to line {whole}{torn}"
    assert [record.seq for record in records] == list(range(1, whole + 1))


def test_reading_stops_at_the_first_line_that_does_not_follow(copy: Path) -> None:
    lines = (copy / "events.jsonl").read_bytes().splitlines(True)
    (copy / "events.jsonl").write_bytes(b"".join(lines[:3] + lines[4:]))
    events = read_events(copy)
    assert [next(events).seq for _ in range(3)] == [1, 2, 3]
    with pytest.raises(BrokenChain, match="line 4 carries number 5: a line was removed, added, moved or altered"):
        next(events)


def test_files_beside_the_journal_are_protected(copy: Path) -> None:
    (query,) = (copy / "queries").iterdir()
    original = query.read_bytes()
    for changed in (original.replace(b"true", b"fals"), original + b" ", b""):
        query.write_bytes(changed)
        report = verify(copy)
        assert not report.intact and report.lines == LINES
        assert report.problem == f"file 'queries/{query.name}' was altered: its size or digest is not the manifest's"
    query.unlink()
    assert verify(copy).problem == f"file 'queries/{query.name}' is missing"


def test_what_is_no_run_is_said_to_be_none(tmp_path: Path) -> None:
    for directory in (tmp_path, tmp_path / "absent"):
        report = verify(directory)
        assert (report.lines, report.complete, report.intact) == (0, False, False)
        assert report.problem and "holds no events.jsonl" in report.problem
    with pytest.raises(FileNotFoundError):
        next(read_events(tmp_path))


def test_a_manifest_cannot_point_outside_the_run(tmp_path: Path) -> None:
    from homeostat.journal.beside.files import StoredFile
    from homeostat.journal.beside.manifest import Manifest, write_manifest

    run = tmp_path / "run"
    with Journal(run) as journal:
        honest = journal.close(Summary(1, "no-fault"))
    secret = write_text(tmp_path, "elsewhere", ".txt")
    outside = StoredFile(f"../{secret.name}", secret.size_bytes, secret.sha256)
    forged = Manifest(honest.format, honest.homeostat, 1, "no-fault", 0, honest.last, (outside,))
    write_manifest(run, forged)
    report = verify(run)
    assert not report.intact and report.problem and "lies outside the run directory" in report.problem
