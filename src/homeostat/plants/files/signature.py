"""An engineer's signature under a plant's configuration: whose key vouches for exactly these tables and settings.

It may name the mapping of a link as well, over which this configuration, and no other, may command the plant.
"""

import json
from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Final

from pydantic import BaseModel, ConfigDict, StringConstraints, ValidationError

from homeostat.domain.quotation import quoted
from homeostat.journal.signing.keys import SigningKey, vouches
from homeostat.plants.files.folder import SIGNATURE

_PURPOSE: Final = b"homeostat plant configuration\n"
"""What is signed begins with this, so that no other signature of the key can be passed off as one of a plant."""
_MOST_BYTES: Final = 10_000
"""A signature file is not longer [byte]."""

Digest = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")]
Words = Annotated[str, StringConstraints(min_length=1, max_length=200, strip_whitespace=True)]


class Signature(BaseModel):
    """Content of ``plant.sig``."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    plant: Words
    """Name of the plant."""
    digest: Digest
    """Digest of its configuration."""
    person: Words
    """Who signed."""
    reason: Words
    """Why, for example the number of the review."""
    key: Digest
    """Public Ed25519 key, in hexadecimal."""
    link: Digest | None = None
    """Digest of the mapping of a link; None where none was signed with it."""
    signature: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{128}$")] = "0" * 128
    """Signature over all the rest, in hexadecimal."""

    @property
    def message(self) -> bytes:
        """What is signed."""
        content = self.model_dump(exclude={"signature"}, exclude_none=True)  # as it was before mappings were signed
        return _PURPOSE + json.dumps(content, sort_keys=True, separators=(",", ":")).encode("ascii")

    @property
    def genuine(self) -> bool:
        """Whether whoever holds the key signed this content."""
        return vouches(self.key, self.message, self.signature)


def sign(plant: str, digest: str, person: str, reason: str, key: SigningKey, link: str | None = None) -> Signature:
    """A signature under ``digest`` and, where there is one, the digest ``link`` of a mapping.

    ValueError where ``person`` or ``reason`` does not have 1 to 200 characters.
    """
    who, why = quoted(person, 1000), quoted(reason, 1000)
    plain = Signature(plant=plant, digest=digest, person=who, reason=why, key=key.public, link=link)
    return plain.model_copy(update={"signature": key.sign(plain.message)})


def check_signature(
    plant_folder: Path,
    digest: str,
    trusted_keys: Collection[str],
    file: Path | None = None,
    link: str | None = None,
) -> str | None:
    """Why nobody trusted vouches for the configuration ``digest``, in one line; None where somebody does.

    The signature is ``plant.sig`` in ``plant_folder``, or ``file``; ``trusted_keys`` are public keys in hexadecimal;
    ``link``: digest of the mapping that must have been signed with it, if one must.
    """
    found = _signature(file or plant_folder / SIGNATURE, digest)
    if isinstance(found, str):
        return found
    if found.key not in trusted_keys:
        return f"the signature is by {_who(found)}, a key that is not trusted here"
    if link is None or found.link == link:
        return None
    if found.link is None:
        return f"{_who(found)} signed no mapping with the configuration; sign both: 'homeostat plant sign' with --link"
    return f"{_who(found)} signed another mapping, {found.link[:16]}...; this one is {link[:16]}..."


def signer(plant_folder: Path, digest: str, file: Path | None = None) -> str:
    """Who signed the configuration ``digest``, whether the key is trusted or not, or why nobody did; in one line.

    The signature is ``plant.sig`` in ``plant_folder``, or ``file``.
    """
    found = _signature(file or plant_folder / SIGNATURE, digest)
    return found if isinstance(found, str) else f"signed by {_who(found)}"


def _signature(path: Path, digest: str) -> Signature | str:
    """The genuine signature under ``digest`` in the file ``path``, or why there is none."""
    try:
        with path.open("rb") as stream:
            found = Signature.model_validate_json(stream.read(_MOST_BYTES))
    except FileNotFoundError:
        return f"the configuration is not signed: there is no {str(path)!r}; sign it with 'homeostat plant sign'"
    except OSError as error:
        return f"the signature {str(path)!r} cannot be read: {error.strerror}"
    except ValidationError as error:
        return f"{str(path)!r} is no signature: {error.errors(include_url=False)[0]['msg']}"
    if not found.genuine:
        return f"the signature {str(path)!r} was altered: it is not what {_who(found)} signed"
    if found.digest != digest:
        return f"{_who(found)} signed another configuration, {found.digest[:16]}...; this one is {digest[:16]}..."
    return found


def _who(found: Signature) -> str:
    return f"{quoted(found.person)!r} (key {found.key[:16]}...)"
