"""Signed runs: a whole journal may be forged, the signature not."""

from __future__ import annotations

import itertools
import shutil
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.journal import BrokenChain, Journal, RunFinished, Signature, Summary, read_events
from homeostat.journal.beside.manifest import read_manifest
from homeostat.journal.signing.keys import SigningKey
from homeostat.journal.signing.signing import EVERY_LINES, EVERY_S
from homeostat.journal.verify.verify import verify
from tests.journal.forgery import change, lines_of, rewrite, sign
from tests.journal.samples import Measured, record_run

OWN, STRANGER = SigningKey(bytes(32)), SigningKey(bytes([1] * 32))


def signed_run(directory: Path, events: int = 6, key: SigningKey = OWN) -> Path:
    """A closed run with a signature."""
    with Journal(directory, key) as journal:
        record_run(journal, events)
        journal.close(Summary(7, "released", "c0ffee"))
    return directory


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return signed_run(tmp_path / "run")


def test_a_signed_run_is_vouched_for_by_whom_one_trusts(run: Path) -> None:
    report = verify(run, {OWN.public})
    assert (report.complete, report.vouched.signature, report.vouched.lines) == (True, Signature.TRUSTED, 9)
    assert report.vouched.key == OWN.public
    manifest = read_manifest(run)
    assert manifest is not None and manifest.self_signed and manifest.configuration == "c0ffee"


@pytest.mark.parametrize("keys", [(), (STRANGER.public,), ("",), ("no key",)])
def test_a_strangers_signature_is_said(run: Path, keys: tuple[str, ...]) -> None:
    report = verify(run, keys)
    assert (report.complete, report.vouched.signature, report.vouched.lines) == (True, Signature.STRANGER, 0)


def test_signatures_come_after_so_many_lines_and_after_so_much_time(tmp_path: Path) -> None:
    with Journal(tmp_path / "lines", OWN) as journal:
        for number in range(3 * EVERY_LINES):
            journal.record(Measured("T1", float(number)), 0.0)
    with Journal(tmp_path / "time", OWN) as journal:
        for number in range(10):
            journal.record(Measured("T1", float(number)), number * EVERY_S / 2)
    lines = [r.seq for r in read_events(tmp_path / "lines") if r.kind == "signed"]
    times = [r.at_s for r in read_events(tmp_path / "time") if r.kind == "signed"]
    assert lines[0] == EVERY_LINES + 1 and all(b - a <= EVERY_LINES + 1 for a, b in itertools.pairwise(lines))
    assert times == [EVERY_S, 2 * EVERY_S, 3 * EVERY_S, 4 * EVERY_S, 4.5 * EVERY_S]
    for name in ("lines", "time"):
        report = verify(tmp_path / name, {OWN.public})
        assert report.intact and report.vouched.signature is Signature.NOT_CLOSED
        assert report.vouched.lines == report.lines


def alter(lines: list[dict[str, Any]]) -> None:
    lines[3]["value"] = 0.0


def test_a_journal_that_is_rehashed_as_a_whole_is_found(run: Path) -> None:
    lines = lines_of(run)
    alter(lines)
    rewrite(run, lines)
    report = verify(run, {OWN.public})
    assert not report.intact and report.problem == "line 9 carries a signature that is not of the lines before it"


def test_a_forger_who_takes_the_signatures_out_is_not_vouched_for(run: Path) -> None:
    change(run, alter)
    report = verify(run, {OWN.public})
    assert report.complete and report.vouched.signature is Signature.NONE


def test_a_forger_who_signs_again_is_a_stranger(run: Path) -> None:
    change(run, alter)
    sign(run, STRANGER)
    report = verify(run, {OWN.public})
    assert report.complete and report.vouched.signature is Signature.STRANGER
    assert (report.vouched.key, report.vouched.lines) == (STRANGER.public, 0)


def test_a_forger_who_calls_the_run_old_is_found(run: Path) -> None:
    lines = [line for line in lines_of(run) if line["event"] != "signed"]
    rewrite(run, lines, format=1, key=None, signature=None, configuration=None)
    report = verify(run, {OWN.public})
    assert not report.intact and report.problem == "line 2: format 1 has no event like this 'measured'"


def test_lines_after_the_last_signature_are_not_vouched_for(run: Path) -> None:
    (run / "manifest.json").unlink()
    journal = Journal.resume(run)
    journal.record(RunFinished("reversed"), 9.0)
    journal.close(Summary(7, "reversed"))
    report = verify(run, {OWN.public})
    assert report.complete and report.vouched.signature is Signature.NOT_CLOSED
    assert (report.lines, report.vouched.lines) == (11, 9)


def test_lines_that_a_stranger_signs_after_the_last_signature_are_a_strangers(run: Path) -> None:
    (run / "manifest.json").unlink()
    journal = Journal.resume(run, STRANGER)
    journal.record(RunFinished("reversed"), 9.0)
    journal.close(Summary(7, "reversed"))
    report = verify(run, {OWN.public})
    assert report.vouched.signature is Signature.STRANGER and report.vouched.lines == 9


def test_a_missing_closing_signature_is_said(run: Path) -> None:
    lines = lines_of(run)[:-1]
    rewrite(run, lines)
    report = verify(run, {OWN.public})
    assert report.problem == "the manifest carries a signature that is not of its content"
    rewrite(run, lines_of(run), key="", signature="")
    assert verify(run, {OWN.public}).vouched.signature is Signature.NONE
    signed_run(run.parent / "again", EVERY_LINES + 5)
    rewrite(run.parent / "again", lines_of(run.parent / "again")[:-1], key="", signature="")
    report = verify(run.parent / "again", {OWN.public})
    assert (report.vouched.signature, report.vouched.lines) == (Signature.NOT_CLOSED, EVERY_LINES + 1)


@pytest.mark.parametrize(
    "changed", [{"outcome": "recovered"}, {"seed": 8}, {"configuration": "other"}, {"key": STRANGER.public}]
)
def test_a_manifest_that_is_rehashed_is_found(run: Path, changed: dict[str, Any]) -> None:
    rewrite(run, lines_of(run), **changed)
    report = verify(run, {OWN.public})
    assert not report.intact and report.problem == "the manifest carries a signature that is not of its content"


def test_a_signature_of_another_run_is_none(tmp_path: Path, run: Path) -> None:
    other = lines_of(signed_run(tmp_path / "other", events=4))
    lines = lines_of(run)
    lines[-1] = {**other[-1], "seq": len(lines)}
    rewrite(run, lines)
    assert not verify(run, {OWN.public}).intact


def test_a_run_goes_on_where_it_was_left(tmp_path: Path) -> None:
    with Journal(tmp_path, OWN) as journal:
        record_run(journal, 3)
    with (tmp_path / "events.jsonl").open("ab") as file:
        file.write(b'{"seq":7,"prev":"torn')
    journal = Journal.resume(tmp_path, OWN)
    (resumed,) = [r for r in read_events(tmp_path) if r.kind == "resumed"]
    assert dict(resumed.fields) == {"lines": 6, "signed": 6, "torn": True, "changed": []}
    journal.record(Measured("T1", 1.0), 0.5)
    journal.close(Summary(7, "released"))
    report = verify(tmp_path, {OWN.public})
    assert (report.complete, report.vouched.signature) == (True, Signature.TRUSTED)
    assert [r.at_s for r in read_events(tmp_path)][-3:] == [1.5, 1.5, 1.5]
    with pytest.raises(FileExistsError, match="was closed; begin another one"):
        Journal.resume(tmp_path)


def test_what_was_not_signed_when_a_run_goes_on_is_told(tmp_path: Path) -> None:
    with Journal(tmp_path, OWN) as journal:
        record_run(journal, 3)
    Journal.resume(tmp_path).record(Measured("T1", 9.0), 1.5)
    Journal.resume(tmp_path, OWN)
    found = [dict(r.fields) for r in read_events(tmp_path) if r.kind == "resumed"]
    assert found == [
        {"lines": 6, "signed": 0, "torn": False, "changed": []},
        {"lines": 8, "signed": 6, "torn": False, "changed": []},
    ]


def test_a_journal_that_was_forged_is_not_gone_on_with(run: Path) -> None:
    (run / "manifest.json").unlink()
    lines = lines_of(run)
    alter(lines)
    rewrite(run, lines)
    with pytest.raises(BrokenChain, match="line 9 carries a signature that is not of the lines before it"):
        Journal.resume(run, OWN)


@settings(max_examples=60)
@given(data=st.data())
def test_whatever_a_forger_changes_and_rehashes_is_found(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    base = tmp_path_factory.getbasetemp() / "forged"
    if not base.exists():
        signed_run(base)
    copy = Path(shutil.copytree(base, tmp_path_factory.mktemp("copy") / "run"))
    lines = lines_of(copy)
    place = data.draw(st.integers(0, len(lines) - 2))
    match data.draw(st.sampled_from(["drop", "repeat", "time", "value"])):
        case "drop":
            del lines[place]
        case "repeat":
            lines.insert(place, lines[place])
        case "time":
            lines[place]["at_s"] += data.draw(st.floats(0.25, 9.0))
        case "value":
            lines[place]["value"] = data.draw(st.floats(-1.0, 1.0))
    rewrite(copy, lines)
    report = verify(copy, {OWN.public})
    assert not report.intact and report.problem and "\n" not in report.problem
