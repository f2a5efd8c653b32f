"""``homeostat plant``: an engineer's signature under a plant's configuration."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from homeostat.cli.options.arguments import UsageError

if TYPE_CHECKING:
    from homeostat.cli.options.arguments import Commands


def configure(commands: Commands) -> None:
    """Declare the three commands."""
    key = commands.add_parser(
        "keygen",
        help="make a key to sign with",
        description="Write a new private key (Ed25519) to FILE, readable by its owner only, and its public half to "
        "FILE.pub. Whoever is to trust the signatures gets the public half.",
        allow_abbrev=False,
    )
    key.add_argument("file", type=Path, metavar="FILE", help="new file")
    key.set_defaults(carry_out=keygen)
    signing = commands.add_parser(
        "sign",
        help="sign the configuration of a plant",
        description="Check a plant as a run would and sign the digest of its configuration: settings, tables, mapping, "
        "graph, reference values and its own code. Any later change of these makes the signature void.",
        allow_abbrev=False,
    )
    signing.add_argument("case", metavar="CASE", help="name of the plant, or path of its folder")
    signing.add_argument("--key", type=Path, required=True, metavar="FILE", help="private key, as 'keygen' wrote it")
    signing.add_argument("--person", required=True, metavar="NAME", help="who signs")
    signing.add_argument("--reason", required=True, metavar="TEXT", help="why, for example the number of the review")
    signing.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="file to write; it is replaced as a whole (default: plant.sig of the plant)",
    )
    signing.set_defaults(carry_out=sign)
    verifying = commands.add_parser(
        "verify",
        help="check the signature under a plant's configuration",
        description="Say whether a trusted key has signed the configuration as it is now.",
        epilog="Exit status: 0 signed by a trusted key, 1 not signed, altered since, or by another key, 2 bad usage.",
        allow_abbrev=False,
    )
    verifying.add_argument("case", metavar="CASE", help="name of the plant, or path of its folder")
    verifying.add_argument(
        "--key", action="append", required=True, metavar="PUBLIC",
        help="public key that is trusted: a file, or 32 bytes in hexadecimal or base64; may be given several times",
    )  # fmt: skip
    verifying.add_argument("--signature", type=Path, metavar="FILE", help="signature elsewhere than with the plant")
    verifying.set_defaults(carry_out=verify)


def keygen(options: argparse.Namespace) -> int:
    """Make a key; 0."""
    from homeostat.journal.signing.keys import SigningKey, make_key, read_private

    path: Path = options.file
    if path.exists():
        raise UsageError(f"{str(path)!r} is there already; a key is never overwritten, choose another name")
    make_key(path)
    print(f"{path}.pub: {SigningKey(read_private(path)).public}")
    return 0


def sign(options: argparse.Namespace) -> int:
    """Sign the configuration as it is now; 0."""
    from homeostat.journal.files import write_whole
    from homeostat.journal.signing.keys import SigningKey, read_private
    from homeostat.plants.folder import SIGNATURE
    from homeostat.plants.plant import load_case
    from homeostat.plants.signature import sign as signed

    for option in ("person", "reason"):
        if not 0 < len(getattr(options, option).strip()) <= 200:
            raise UsageError(f"--{option} must have 1 to 200 characters")
    key = SigningKey(read_private(options.key))
    case = load_case(options.case)
    signature = signed(case.name, case.configuration, options.person, options.reason, key)
    path = options.out or case.files.folder / SIGNATURE
    write_whole(path, f"{signature.model_dump_json(indent=1)}\n".encode())
    print(f"{path}: {case.name} {case.configuration} signed by {signature.person}")
    return 0


def verify(options: argparse.Namespace) -> int:
    """Print one line; 0 where a trusted key signed the configuration, else 1."""
    from homeostat.journal.signing.keys import read_public
    from homeostat.plants.plant import load_case
    from homeostat.plants.signature import check_signature

    trusted = [read_public(key) for key in options.key]
    if options.signature is not None:
        options.signature.open("rb").close()  # one that was named and is not there is a mistake in the command
    case = load_case(options.case)
    reason = check_signature(case.files.folder, case.configuration, trusted, options.signature)
    print(f"{case.name} {case.configuration}: {reason or 'signed by a trusted key'}")
    return 0 if reason is None else 1
