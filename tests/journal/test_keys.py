"""Keys: made once, kept for oneself, read in whatever spelling."""

from __future__ import annotations

import base64
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from cryptography.hazmat.primitives.asymmetric.rsa import generate_private_key
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat
from hypothesis import given
from hypothesis import strategies as st

from homeostat.journal.signing.keys import (
    VARIABLE,
    KeyTrouble,
    SigningKey,
    installation_key,
    installation_public,
    key_path,
    read_public,
    vouches,
)


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the key of a fresh installation would be."""
    monkeypatch.delenv(VARIABLE)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    return tmp_path / "config" / "homeostat" / "signing.key"


def test_a_key_is_made_on_first_use_and_stays(place: Path) -> None:
    assert installation_public() is None and not place.exists() and key_path() == place
    key = installation_key()
    assert stat.S_IMODE(place.stat().st_mode) == 0o600
    assert installation_key().public == key.public == installation_public()
    assert read_public(str(place.with_name("signing.key.pub"))) == key.public
    assert sorted(p.name for p in place.parent.iterdir()) == ["signing.key", "signing.key.pub"]


def test_without_a_variable_it_lives_in_the_home_directory(
    tmp_path: Path, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("XDG_CONFIG_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert key_path() == tmp_path / ".config" / "homeostat" / "signing.key"
    monkeypatch.setenv(VARIABLE, "elsewhere.key")
    assert key_path() == Path("elsewhere.key")


def test_processes_that_start_together_make_one_key(place: Path) -> None:
    code = "from homeostat.journal.signing.keys import installation_key; print(installation_key().public)"
    processes = [
        subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=dict(os.environ))
        for _ in range(3)
    ]
    assert {process.communicate(timeout=240)[0].strip() for process in processes} == {installation_key().public}


@pytest.mark.parametrize(
    ("content", "mode", "words"),
    [
        (b"", 0o600, "is no signing key: it must hold 32 bytes in hexadecimal; remove it"),
        (b"\xff" * 64, 0o600, "is no signing key"),
        (b"ab" * 31, 0o600, "is no signing key"),
        (b"ab" * 32, 0o644, "can be used by others; take their rights away: chmod 600"),
    ],
)
def test_a_key_that_is_none_is_refused(place: Path, content: bytes, mode: int, words: str) -> None:
    place.parent.mkdir(parents=True)
    place.write_bytes(content)
    place.chmod(mode)
    for read in (installation_key, installation_public):
        with pytest.raises(KeyTrouble, match=words):
            read()


def test_where_no_key_can_be_made_it_is_said_in_one_line(place: Path) -> None:
    place.parents[1].touch()
    with pytest.raises(KeyTrouble, match=r"signing key .* cannot be used: ") as refusal:
        installation_key()
    assert "\n" not in str(refusal.value)
    place.parents[1].unlink()
    place.mkdir(parents=True)
    with pytest.raises(KeyTrouble, match="cannot be used: Is a directory"):
        installation_key()


def test_a_public_key_is_read_in_every_spelling(tmp_path: Path) -> None:
    public = SigningKey(bytes(range(32))).public
    raw = bytes.fromhex(public)
    pem = Ed25519PublicKey.from_public_bytes(raw).public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo)
    file = tmp_path / "key.pub"
    for text in (public, public.upper(), base64.b64encode(raw).decode(), pem.decode()):
        assert read_public(text) == public
        file.write_text(f"{text}\n")
        assert read_public(str(file)) == public


def test_what_is_no_public_key_is_refused(tmp_path: Path) -> None:
    rsa = generate_private_key(65537, 2048).public_key()
    other = rsa.public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo).decode()
    for text in ("", "ab", "missing.pub", "ab" * 31, other, "-----BEGIN PUBLIC KEY-----\nx", str(tmp_path), "a\0b"):
        with pytest.raises(KeyTrouble, match=r"public key|another kind"):
            read_public(text)


@given(st.text(max_size=80), st.binary(max_size=40), st.text(max_size=140))
def test_no_text_is_a_signature(public: str, message: bytes, signature: str) -> None:
    key = SigningKey(bytes(32))
    assert not vouches(public, message, signature) and not vouches(key.public, message, signature)
    assert vouches(key.public, message, key.sign(message))
    assert not vouches(key.public, message + b"x", key.sign(message))
