"""``homeostat plant``: an engineer's signature under a plant's configuration."""

import argparse
from pathlib import Path

from homeostat.cli.arguments import UsageError, apart
from homeostat.journal.beside.files import write_whole
from homeostat.journal.signing.keys import SigningKey, make_key, read_private, read_public
from homeostat.plants.files.folder import SIGNATURE
from homeostat.plants.files.signature import check_signature
from homeostat.plants.files.signature import sign as signed
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.guarding import rules_of


def keygen(options: argparse.Namespace) -> int:
    """Make a key; 0."""
    path: Path = options.file
    if path.exists():
        raise UsageError(f"{str(path)!r} is there already; a key is never overwritten, choose another name")
    make_key(path)
    print(f"{path}.pub: {SigningKey(read_private(path)).public}")
    return 0


def sign(options: argparse.Namespace) -> int:
    """Sign the configuration as it is now; 0."""
    for option in ("person", "reason"):
        if not 0 < len(getattr(options, option).strip()) <= 200:
            raise UsageError(f"--{option} must have 1 to 200 characters")
    key = SigningKey(read_private(options.key))
    plant = load_plant(options.case)
    link = _mapping(options, plant)
    signature = signed(plant.name, plant.configuration, options.person, options.reason, key, link)
    path = apart(options.out or plant.files.folder / SIGNATURE, plant.files.folder, plant.files.contents)
    write_whole(path, f"{signature.model_dump_json(indent=1)}\n".encode())
    over = "" if link is None else f", and the mapping {link}"
    print(f"{path}: {plant.name} {plant.configuration}{over} signed by {signature.person}")
    return 0


def verify(options: argparse.Namespace) -> int:
    """Print one line; 0 where a trusted key signed the configuration, else 1. Nothing is written."""
    trusted = [read_public(key) for key in options.key]
    if options.signature is not None:
        options.signature.open("rb").close()  # one that was named and is not there is a mistake in the command
    plant = load_plant(options.case, kept=False)
    reason = check_signature(plant.files.folder, plant.configuration, trusted, options.signature, _mapping(options))
    print(f"{plant.name} {plant.configuration}: {reason or 'signed by a trusted key'}")
    return 0 if reason is None else 1


def _mapping(options: argparse.Namespace, signed: Plant | None = None) -> str | None:
    """Digest of the mapping that was named, which is one; None where none was.

    LinkError where it says something else than the tables of the plant that is ``signed`` with it.
    """
    if options.link is None:
        return None
    from homeostat.links.opcua.agreement import refuse_disagreement
    from homeostat.links.opcua.mapping import read_mapping

    mapping = read_mapping(options.link)
    if signed is not None:
        refuse_disagreement(mapping, rules_of(signed))
    return mapping.digest
