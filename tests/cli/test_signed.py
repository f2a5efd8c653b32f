"""Who vouches for a run: the installation's key, a key that is given, or nobody."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from homeostat.journal.beside.manifest import OLDER_KINDS
from homeostat.journal.signing.keys import VARIABLE, SigningKey, installation_key
from tests.cli.command import Done, homeostat, refused
from tests.journal.forgery import change, lines_of, rewrite, sign

STRANGER = SigningKey(bytes([1] * 32))


@pytest.fixture
def copy(tmp_path: Path, record: Path) -> Path:
    """A copy of a signed run, in the folder ``tmp_path``."""
    return Path(shutil.copytree(record, tmp_path / "run"))


def test_a_run_is_signed_by_the_installation(recovered: Done, tmp_path: Path) -> None:
    own = installation_key().public
    (tmp_path / "own.pub").write_text(own)
    for key in ((), ("--key", own), ("--key", str(tmp_path / "own.pub")), ("--key", STRANGER.public, "--key", own)):
        done = homeostat("trace", "verify", "run", *key, cwd=recovered.cwd)
        assert (done.status, done.err) == (0, "") and done.out.endswith(f"; signed by trusted key {own[:16]}\n")


def test_another_installation_knows_no_one(recovered: Done, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path / "no.key"))
    done = homeostat("trace", "verify", "run", cwd=recovered.cwd)
    assert done.status == 1 and "SIGNED BY A STRANGER" in done.out and not (tmp_path / "no.key").exists()


def test_a_strangers_signature_is_said(tmp_path: Path, copy: Path) -> None:
    change(copy, lambda lines: lines[0].update(wall_started="long ago"))
    sign(copy, STRANGER)
    done = homeostat("trace", "verify", "run", cwd=tmp_path)
    assert done.status == 1 and f"SIGNED BY A STRANGER: nobody vouches for key {STRANGER.public}" in done.out
    done = homeostat("trace", "verify", "run", "--key", STRANGER.public, cwd=tmp_path)
    assert done.status == 0


def test_a_missing_signature_is_said(tmp_path: Path, copy: Path) -> None:
    rewrite(copy, [line for line in lines_of(copy) if line["event"] != "signed"], key="", signature="")
    done = homeostat("trace", "verify", "run", cwd=tmp_path)
    assert done.status == 1 and "NOT SIGNED" in done.out and done.out.count("\n") == 1


def test_a_signed_run_that_is_made_older_than_signatures_is_said(tmp_path: Path, copy: Path) -> None:
    kept = [x for x in lines_of(copy) if x["event"] in OLDER_KINDS and "happened_s" not in x]
    rewrite(copy, kept, format=1, key=None, signature=None, configuration=None)
    for key in ((), ("--key", installation_key().public)):
        done = homeostat("trace", "verify", "run", *key, cwd=tmp_path)
        assert done.status == 3 and "NOT SIGNED" in done.out and "complete and unaltered" not in done.out


def test_a_missing_closing_signature_is_said(tmp_path: Path, copy: Path) -> None:
    lines = lines_of(copy)
    assert lines[-1]["event"] == "signed"
    rewrite(copy, lines[:-1], key="", signature="")
    done = homeostat("trace", "verify", "run", cwd=tmp_path)
    assert done.status == 1 and "NO CLOSING SIGNATURE" in done.out


def test_a_contradiction_is_said(tmp_path: Path, copy: Path) -> None:
    def fall_back(lines: list[dict[str, object]]) -> None:
        lines[-2] = {
            "seq": 0, "prev": "", "at_s": lines[-2]["at_s"], "event": "fallback-activated", "strategy": "x",
            "commands": [], "reason": "",
        }  # fmt: skip

    change(copy, fall_back)
    done = homeostat("trace", "verify", "run", cwd=tmp_path)
    assert done.status == 1 and "CONTRADICTION: line" in done.out and "a fallback acted" in done.out


@pytest.mark.parametrize("key", ["ab", "missing.pub", ""])
def test_a_key_that_is_none_is_refused(recovered: Done, key: str) -> None:
    refused(homeostat("trace", "verify", "run", "--key", key, cwd=recovered.cwd), "is no public key")


def test_a_run_without_a_key_goes_on_and_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "bad.key").write_text("nothing")
    (tmp_path / "bad.key").chmod(0o600)
    monkeypatch.setenv(VARIABLE, str(tmp_path / "bad.key"))
    done = homeostat("run", "cstr", "--end", "400", "--out", "run", cwd=tmp_path)
    assert done.status == 0 and done.err.count("\n") == 1
    assert done.err.startswith("homeostat: the run is not signed: ") and "is no signing key" in done.err
    monkeypatch.setenv(VARIABLE, str(tmp_path / "good.key"))
    checked = homeostat("trace", "verify", "run", cwd=tmp_path)
    assert checked.status == 1 and "NOT SIGNED" in checked.out
