"""Keys for signatures (Ed25519): the installation's own, and those that a reader trusts."""

import base64
import binascii
import contextlib
import os
import stat
from pathlib import Path
from typing import Final, final

VARIABLE: Final = "HOMEOSTAT_SIGNING_KEY"
"""Environment variable with the path of the installation's key."""
_BYTES: Final = 32
"""Length of a public key [byte]."""
_MOST_BYTES: Final = 10_000
"""A key file is not longer [byte]."""


class KeyTrouble(ValueError):
    """A key cannot be read or made; the message says so in one line, with the remedy."""


@final
class SigningKey:
    """A private key in memory."""

    def __init__(self, seed: bytes) -> None:
        """``seed``: the 32 secret bytes."""
        from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

        self._key = Ed25519PrivateKey.from_private_bytes(seed)
        self.public = self._key.public_key().public_bytes_raw().hex()
        """The public key, in hexadecimal."""

    def sign(self, message: bytes) -> str:
        """The signature of ``message``, in hexadecimal."""
        return self._key.sign(message).hex()


def vouches(public: str, message: bytes, signature: str) -> bool:
    """Whether ``signature`` is of ``message`` and by the key whose public half is ``public``, both in hexadecimal."""
    from cryptography.exceptions import InvalidSignature
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    try:
        key = Ed25519PublicKey.from_public_bytes(bytes.fromhex(public))
        key.verify(bytes.fromhex(signature), message)
    except (InvalidSignature, ValueError):
        return False
    return True


def key_path() -> Path:
    """Where the installation's key is: `VARIABLE`, else ``$XDG_CONFIG_HOME/homeostat/signing.key``."""
    if chosen := os.environ.get(VARIABLE):
        return Path(chosen)
    try:
        home = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    except RuntimeError as error:
        raise KeyTrouble(f"no home directory for the signing key: {error}; set {VARIABLE}") from error
    return Path(home) / "homeostat" / "signing.key"


def installation_key() -> SigningKey:
    """The installation's key, made where there is none; KeyTrouble where it can be neither read nor made."""
    path = key_path()
    try:
        if not path.exists():
            make_key(path)
        return SigningKey(read_private(path))
    except ImportError as error:
        raise KeyTrouble(f"no signing key: {error}; install 'cryptography'") from error
    except OSError as error:
        raise KeyTrouble(f"signing key {str(path)!r} cannot be used: {error.strerror or error}") from error


def installation_public() -> str | None:
    """The installation's public key, in hexadecimal; None where it has no key, KeyTrouble where it cannot be read."""
    try:
        there = key_path().exists()
    except OSError as error:
        raise KeyTrouble(f"signing key {str(key_path())!r} cannot be used: {error.strerror or error}") from error
    return installation_key().public if there else None


def read_public(given: str) -> str:
    """The public key that ``given`` names, in hexadecimal: a file, or the key itself in hexadecimal or base64.

    A file holds the same, or a public key in PEM. Raises KeyTrouble for anything else.
    """
    text = given.strip()
    with contextlib.suppress(OSError, ValueError):  # ValueError: a name that no file can have
        if Path(given).is_file():
            with Path(given).open("rb") as file:
                text = file.read(_MOST_BYTES).decode("ascii").strip()
    if text.startswith("-----BEGIN PUBLIC KEY"):
        return _from_pem(text, given)
    for decode in (bytes.fromhex, _from_base64):
        with contextlib.suppress(ValueError):
            found = decode(text)
            if len(found) == _BYTES:
                return found.hex()
    raise KeyTrouble(f"{given!r} is no public key; give 32 bytes in hexadecimal or base64, or a file that holds them")


def _from_base64(text: str) -> bytes:
    try:
        return base64.b64decode(text, validate=True)
    except binascii.Error as error:
        raise ValueError(str(error)) from error


def _from_pem(text: str, given: str) -> str:
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
    from cryptography.hazmat.primitives.serialization import load_pem_public_key

    try:
        key = load_pem_public_key(text.encode())
    except (ValueError, UnsupportedAlgorithm) as error:
        raise KeyTrouble(f"{given!r} is no public key in PEM; give an Ed25519 key") from error
    if not isinstance(key, Ed25519PublicKey):
        raise KeyTrouble(f"{given!r} holds a key of another kind; give an Ed25519 key")
    return key.public_bytes_raw().hex()


def make_key(path: Path) -> None:
    """Write a new key and, beside it, its public half; where another process is faster, its key stands.

    Raises OSError, which names ``path`` or its folder, where it cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    seed = os.urandom(_BYTES)
    fresh = path.with_name(f".{path.name}.{os.getpid()}.{seed[:4].hex()}")
    try:
        file = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except OSError as error:  # it names the file beside
        raise OSError(error.errno, error.strerror, str(path)) from error
    try:
        os.write(file, f"{seed.hex()}\n".encode())
        os.fsync(file)
        with contextlib.suppress(FileExistsError):
            os.link(fresh, path)  # a name appears with its whole content, and once
            path.with_name(f"{path.name}.pub").write_text(f"{SigningKey(seed).public}\n", encoding="ascii")
    finally:
        os.close(file)
        fresh.unlink(missing_ok=True)


def read_private(path: Path) -> bytes:
    """The secret bytes of the key in ``path``; KeyTrouble where it is none, or where others can use it."""
    with path.open("rb") as file:
        mode = os.fstat(file.fileno()).st_mode
        content = file.read(_MOST_BYTES)
    if os.name == "posix" and stat.S_ISREG(mode) and mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise KeyTrouble(f"signing key {str(path)!r} can be used by others; take their rights away: chmod 600")
    try:
        seed = bytes.fromhex(content.decode("ascii"))
    except ValueError:
        seed = b""
    if len(seed) != _BYTES:
        raise KeyTrouble(
            f"{str(path)!r} is no signing key: it must hold 32 bytes in hexadecimal; remove it for a new one"
        )
    return seed
