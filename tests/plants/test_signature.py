"""An engineer's signature under a plant: void after any change, by a stranger, altered, missing or no signature."""

from __future__ import annotations

import json
import stat
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.journal.signing.keys import SigningKey
from homeostat.plants.files.folder import SIGNATURE
from homeostat.plants.files.signature import check_signature, sign
from tests.cli.command import homeostat, refused
from tests.plants.copies import Copy

KEY, STRANGER = SigningKey(b"k" * 32), SigningKey(b"s" * 32)
DIGEST = "0123456789abcdef" * 4


def put(folder: Path, changes: Mapping[str, object] = MappingProxyType({})) -> None:
    content = json.loads(sign("cstr", DIGEST, "E. Engineer", "review 12", KEY).model_dump_json())
    (folder / SIGNATURE).write_text(json.dumps({**content, **changes}))


def test_a_trusted_signature_under_this_configuration(tmp_path: Path) -> None:
    put(tmp_path)
    assert check_signature(tmp_path, DIGEST, {KEY.public}) is None
    assert "signed another configuration" in str(check_signature(tmp_path, DIGEST[::-1], {KEY.public}))
    assert "a key that is not trusted here" in str(check_signature(tmp_path, DIGEST, {STRANGER.public}))
    assert "a key that is not trusted here" in str(check_signature(tmp_path, DIGEST, set()))
    (tmp_path / SIGNATURE).unlink()
    assert "is not signed" in str(check_signature(tmp_path, DIGEST, {KEY.public}))


@pytest.mark.parametrize(
    "change",
    [
        {"digest": DIGEST[::-1]}, {"person": "Somebody Else"}, {"reason": "no review"}, {"plant": "mixing_module"},
        {"key": STRANGER.public}, {"signature": "0" * 128}, {"signature": ""}, {"more": 1}, {"person": None},
        {"digest": DIGEST.upper()},
    ],
    ids=str,
)  # fmt: skip
def test_an_altered_signature(tmp_path: Path, change: dict[str, object]) -> None:
    put(tmp_path, change)
    for digest in (DIGEST, DIGEST[::-1]):
        reason = check_signature(tmp_path, digest, {KEY.public, STRANGER.public})
        assert reason is not None and "\n" not in reason


@given(content=st.one_of(st.binary(max_size=200), st.just(b"[" * 9000), st.just(b'{"person": ' * 500)))
def test_any_file_is_a_signature_or_not(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    folder = tmp_path_factory.mktemp("plant")
    (folder / SIGNATURE).write_bytes(content)
    assert "is no signature" in str(check_signature(folder, DIGEST, {KEY.public}))


def test_a_signature_names_its_mapping_or_none(tmp_path: Path) -> None:
    put(tmp_path)
    assert "signed no mapping" in str(check_signature(tmp_path, DIGEST, {KEY.public}, link=DIGEST))
    both = sign("cstr", DIGEST, "E. Engineer", "review 12", KEY, link=DIGEST)
    (tmp_path / SIGNATURE).write_text(both.model_dump_json())
    assert check_signature(tmp_path, DIGEST, {KEY.public}) is None
    assert check_signature(tmp_path, DIGEST, {KEY.public}, link=DIGEST) is None
    assert "signed another mapping" in str(check_signature(tmp_path, DIGEST, {KEY.public}, link=DIGEST[::-1]))
    for link in (None, DIGEST[::-1]):
        (tmp_path / SIGNATURE).write_text(both.model_copy(update={"link": link}).model_dump_json())
        assert "was altered" in str(check_signature(tmp_path, DIGEST, {KEY.public})), link


def test_an_empty_name_or_reason_signs_nothing() -> None:
    for person, reason in (("", "why"), ("who", " "), ("x" * 201, "why")):
        with pytest.raises(ValueError):
            sign("cstr", DIGEST, person, reason, KEY)


def test_sign_and_verify_on_the_command_line(tmp_path: Path) -> None:
    copy = Copy.of("mixing_module", tmp_path)
    made = homeostat("plant", "keygen", "own.key", cwd=tmp_path)
    assert made.status == 0 and made.out.startswith("own.key.pub: ")
    assert stat.S_IMODE((tmp_path / "own.key").stat().st_mode) == 0o600
    before = (tmp_path / "own.key").read_bytes()
    refused(homeostat("plant", "keygen", "own.key", cwd=tmp_path), "never overwritten")
    assert (tmp_path / "own.key").read_bytes() == before
    plant, words = "./mixing_module", ("--person", "E. Engineer", "--reason", "review 12")
    check = ("plant", "verify", plant, "--key", "own.key.pub")
    unsigned = homeostat(*check, cwd=tmp_path)
    assert unsigned.status == 1 and "is not signed" in unsigned.out
    signed = homeostat("plant", "sign", plant, "--key", "own.key", *words, cwd=tmp_path)
    digest = copy.load().configuration
    assert signed.status == 0 and digest in signed.out and copy.load().configuration == digest
    verified = homeostat(*check, cwd=tmp_path)
    assert (verified.status, verified.out) == (0, f"mixing_module {digest}: signed by a trusted key\n")
    copy.replace("engineering/faults.csv", "Clogging of the main line", "Clogged main line")
    changed = homeostat(*check, cwd=tmp_path)
    assert changed.status == 1 and "signed another configuration" in changed.out


@pytest.mark.slow
def test_verify_writes_nothing_whatever_is_stale(tmp_path: Path) -> None:
    copy = Copy.of("mixing_module", tmp_path)
    homeostat("plant", "keygen", "own.key", cwd=tmp_path)
    key = ("--key", "own.key.pub")
    copy.replace("engineering/faults.csv", "Clogging of the main line", "Clogged main line")
    copy.replace("case.toml", "end_s = 600.0", "end_s = 580.0")

    def there() -> dict[str, tuple[bytes, int]]:
        paths = [path for path in copy.folder.rglob("*") if path.is_file()]
        return {str(path): (path.read_bytes(), path.stat().st_mtime_ns) for path in paths}

    before = there()
    done = homeostat("plant", "verify", "./mixing_module", *key, cwd=tmp_path)
    assert done.status == 1 and there() == before
    graph, values = done.err.splitlines()
    assert "made again mixing_module/plant.ttl: table 'engineering/faults.csv' changed since it was made" in graph
    assert "made again mixing_module/baseline.csv: what it follows from has changed" in values
    for line in (graph, values):
        assert line.endswith("is only looked at, and the next run of the plant writes it") and str(copy.folder) in line
    digest = done.out.split()[1].rstrip(":")
    assert copy.load().configuration == digest, "it is the configuration that a run would have"


def test_what_cannot_be_signed(tmp_path: Path) -> None:
    Copy.of("cstr", tmp_path).replace("plant.ttl", '"T1 <= 313"', '"T1 <= 353"')
    homeostat("plant", "keygen", "own.key", cwd=tmp_path)
    words = ("--person", "E. Engineer", "--reason", "review 12")
    refused(homeostat("plant", "sign", "./cstr", "--key", "own.key", *words, cwd=tmp_path), "[altered]")
    refused(homeostat("plant", "sign", "cstr", "--key", "own.key.pub", *words, cwd=tmp_path), "own.key.pub")
    refused(homeostat("plant", "sign", "cstr", "--key", "none", *words, cwd=tmp_path), "'none'")
    refused(homeostat("plant", "sign", "cstr", "--key", "own.key", *words[:3], " ", cwd=tmp_path), "--reason")
    refused(homeostat("plant", "verify", "cstr", "--key", "no key", cwd=tmp_path), "no public key")
    known = ("--key", "own.key.pub", "--signature")
    refused(homeostat("plant", "verify", "cstr", *known, "/no/plant.sig", cwd=tmp_path), "'/no/plant.sig' cannot")
    refused(homeostat("plant", "verify", "cstr", *known, ".", cwd=tmp_path), "'.' cannot be used")
    signing = ("plant", "sign", "cstr", "--key", "own.key", *words)
    refused(homeostat(*signing, "--out", "no/cstr.sig", cwd=tmp_path), "homeostat: 'no/cstr.sig' cannot be used")
    long = "x" * 250  # the name of the file beside it is longer still
    refused(homeostat("plant", "keygen", long, cwd=tmp_path), f"homeostat: '{long}' cannot be used")
    assert not (tmp_path / "cstr" / SIGNATURE).exists()
