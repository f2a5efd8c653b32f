"""``homeostat link``: a mapping is drafted and checked, and a certificate made."""

import argparse
import asyncio
import sys

from homeostat.cli.arguments import UsageError
from homeostat.domain.quotation import printable
from homeostat.journal.beside.files import write_whole
from homeostat.links.opcua.extra import need_opcua
from homeostat.links.opcua.mapping import read_mapping
from homeostat.links.opcua.security.certificate import Pki, make_certificate
from homeostat.links.opcua.security.credentials import login_from
from homeostat.links.opcua.security.security import APPLICATION, SERVED, Security
from homeostat.plants.plant import load_plant
from homeostat.plants.wired.assembly import guard_rules


def draft(options: argparse.Namespace) -> int:
    """Browse a server and write a mapping; 0, or 1 where tags of the plant have no node."""
    need_opcua()
    from homeostat.links.opcua.commissioning.browse import MOST, connected, variables
    from homeostat.links.opcua.commissioning.draft import Draft
    from homeostat.links.opcua.commissioning.draft import draft as drafted

    if options.out.exists() and not options.force:
        raise UsageError(f"{str(options.out)!r} is there already; --force replaces it")
    rules = None if options.plant is None else guard_rules(load_plant(options.plant, learned=False))
    security = _security(options)

    async def browse() -> tuple[Draft, bool]:
        async with connected(options.url, security) as client:
            nodes, whole = await variables(client)
            return drafted(options.url, nodes, rules, await client.get_namespace_array()), whole

    made, whole = asyncio.run(browse())
    write_whole(options.out, made.text.encode())
    if not whole:
        text = f"{options.url} has more than {MOST} nodes, of which the nearest were looked at; write in what is missing"
        print(printable(f"homeostat: {text}"), file=sys.stderr)
    for tag in made.missing:
        print(printable(f"{tag}: no node was found"))
    print(printable(f"{options.out}: {made.tags} tags; check every line of it"))
    return 1 if made.missing else 0


def check(options: argparse.Namespace) -> int:
    """Check a mapping against plant and server, one line each; 0 where nothing is wrong, else 1."""
    need_opcua()
    from homeostat.links.opcua.commissioning.browse import connected
    from homeostat.links.opcua.commissioning.check import Checked
    from homeostat.links.opcua.commissioning.check import check as checked

    mapping, rules = read_mapping(options.mapping), guard_rules(load_plant(options.case, learned=False))
    security = _security(options)

    async def look() -> list[Checked]:
        async with connected(mapping.connection.url, security) as client:
            return await checked(client, mapping, rules)

    lines = asyncio.run(look())
    for line in lines:
        print(printable(f"{'problem' if line.problems else 'ok':<8}{line}"))
    wrong = sum(bool(line.problems) for line in lines)
    print(f"{wrong} of {len(lines)} lines need attention" if wrong else f"{len(lines)} lines, nothing is wrong")
    return 1 if wrong else 0


def certificate(options: argparse.Namespace) -> int:
    """Make a key and a certificate; 0."""
    pki = make_certificate(
        options.folder,
        SERVED if options.server else APPLICATION,
        "Homeostat served plant" if options.server else "Homeostat link",
        tuple(options.host),
        options.days,
    )
    print(printable(f"{pki.certificate}: give this to the other side, and put theirs into {pki.trusted}"))
    return 0


def _security(options: argparse.Namespace) -> Security:
    """What the options say of security; the wish to do without is said loudly."""
    security = Security(None if options.pki is None else Pki(options.pki), options.insecure, login_from(options.login))
    security.check()
    if not security.encrypted:
        print("homeostat: INSECURE: nothing is encrypted, nobody is checked, nothing can be written", file=sys.stderr)
    return security
