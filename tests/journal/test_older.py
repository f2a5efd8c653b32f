"""A run that was recorded before runs were signed is read, verified and told as it was."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from homeostat.journal import Signature, read_events
from homeostat.journal.signing.keys import VARIABLE, installation_key
from homeostat.journal.verify.verify import verify
from homeostat.record.decode import decode
from tests.cli.command import homeostat
from tests.journal.forgery import lines_of, rewrite

DATA = Path(__file__).parent / "data"
RUN = DATA / "format-1"
TOLD = DATA / "format-1.txt"


def test_it_agrees_with_itself_and_nobody_vouches_for_it() -> None:
    report = verify(RUN)
    assert (report.complete, report.problem, report.vouched.signature) == (True, None, Signature.OLDER)


@pytest.mark.parametrize("key", [(), ("--key", "ab" * 32)])
@pytest.mark.parametrize("installation", ["none", "own"])
def test_a_run_that_says_it_is_older_than_signatures_is_said_with_a_status_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, key: tuple[str, ...], installation: str
) -> None:
    """Whoever takes the signatures out of a run can have it say the same."""
    monkeypatch.setenv(VARIABLE, str(tmp_path / "signing.key"))
    if installation == "own":
        installation_key()
    done = homeostat("trace", "verify", "format-1", *key, cwd=DATA)
    assert (done.status, done.err) == (3, "") and done.out.count("\n") == 1
    assert "NOT SIGNED: it says that it was recorded before runs were signed, as anybody may have it say" in done.out


def test_it_is_told_as_it_was() -> None:
    done = homeostat("replay", "format-1", cwd=DATA)
    assert (done.status, done.out, done.err) == (0, TOLD.read_text(encoding="utf-8"), "")


def test_every_event_of_it_is_recalled() -> None:
    assert all(decode(record) is not None for record in read_events(RUN))


@pytest.mark.parametrize(
    ("number", "name", "value", "words"),
    [
        (12, "at_s", 99999.0, "its time is 99999 s, outside the run"),
        (12, "at_s", -5.0, "its time is -5 s, outside the run"),
        (11, "event", "write-intended", "format 1 has no event like this"),
        (42, "outcome", "handed_over", "the run ended 'handed-over', by the manifest 'recovered'"),
        (12, "event", "fallback-activated", "but a fallback acted in line 12"),
    ],
)
def test_what_it_says_is_asked_too(tmp_path: Path, number: int, name: str, value: object, words: str) -> None:
    copy = Path(shutil.copytree(RUN, tmp_path / "run"))
    lines = lines_of(copy)
    lines[number - 1][name] = value
    rewrite(copy, lines)
    report = verify(copy)
    assert not report.intact and any(words in sentence for sentence in report.contradictions), report
