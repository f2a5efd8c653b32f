"""``homeostat attach``: a live plant, guarded and thought about through a link until it is stopped."""

from __future__ import annotations

import argparse
import grp
import pwd
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from homeostat.cli.arguments import UsageError
from homeostat.domain.mode import Role
from homeostat.domain.quotation import printable

if TYPE_CHECKING:
    from homeostat.plants.described import DescribedPlant
    from homeostat.service.attached.guarding import Attaching
    from homeostat.service.keeping.attach import ThoughtOf


TICKS = 2.0
"""Fewest samples that a connection must have missed before it is dead."""
REMEDY = "sign both ('homeostat plant sign --link') and name the key with --signed-by, or say --unsigned"
"""What is to be done about a configuration and a mapping that nobody vouches for."""
CALL_S = 0.5
"""Longest wait for a control system to take a write or a heartbeat, wall-clock [s]."""


def carry_out(options: argparse.Namespace) -> int:
    """Check everything, then keep the plant attached; 0 once it was stopped."""
    if options.print_units:
        from homeostat.service.keeping.units import unit

        print(unit(), end="")
        return 0
    for name in ("case", "link", "dir"):
        if getattr(options, name) is None:
            raise UsageError(f"say {'which plant' if name == 'case' else f'--{name}'}; only --print-units needs none")
    from homeostat.links.opcua.extra import need_opcua

    need_opcua()
    from homeostat.cli.compiled import recompiled
    from homeostat.cli.proposers import consulted
    from homeostat.service.keeping.attach import ThoughtOf, attach

    thought = ThoughtOf(_absolute(options.case), consulted(options).elsewhere())
    attaching = _attaching(options, thought)
    if slow := recompiled():
        tell(f"SLOW: {slow}")
    return attach(attaching, thought, tell)


def tell(text: str) -> None:
    """Say ``text`` to whoever watches, if anybody does."""
    try:
        print(printable(f"homeostat: {text}"), file=sys.stderr, flush=True)
    except OSError:
        return


def _attaching(options: argparse.Namespace, thought: ThoughtOf) -> Attaching:
    """Everything that the two processes begin with, read and checked."""
    from homeostat.evaluate.recorded.plant import place
    from homeostat.guard.requests.seal import new_key
    from homeostat.guard.settings import GuardSettings
    from homeostat.journal import Setting
    from homeostat.links.opcua.agreement import refuse_disagreement
    from homeostat.links.opcua.mapping import read_mapping
    from homeostat.links.opcua.security.certificate import Pki
    from homeostat.links.opcua.security.credentials import login_from
    from homeostat.links.opcua.security.security import Security
    from homeostat.plants.described import read_described
    from homeostat.plants.wired.guarding import rules_of
    from homeostat.service.attached.guarding import Attaching
    from homeostat.service.thinking.consulted import ROUTE

    plant, mapping = read_described(options.case), read_mapping(options.link)
    security = Security(None if options.pki is None else Pki(options.pki), options.insecure, login_from(options.login))
    security.check()
    tick_s, dead_s = plant.description.timing.tick_s, mapping.connection.dead_s
    if dead_s < (least_s := TICKS * tick_s / options.pace):
        words = f"dead_s = {dead_s:g} s of the mapping is too short for {plant.name}, which has a tick of {tick_s:g} s"
        raise UsageError(f"{words}: a connection that is well would be dead; state at least {least_s:g} s")
    rules, groups = rules_of(plant), _groups(options)
    if thought.consulted.protocol != ROUTE:  # every step is asked for: nothing follows by itself
        rules = replace(rules, nominal=())
    refuse_disagreement(mapping, rules)
    history, believed = _history(options), _believed(options.console_login)
    objection = _objection(plant, options, mapping.digest)
    playbook = _checked(thought, options.dir)
    security = replace(security, withheld=_withheld(objection, options.unsigned))
    if not security.encrypted:
        tell("INSECURE: nothing is encrypted, nobody is checked, nothing can be written")
    settings = (
        Setting("configuration", plant.configuration),
        *place(plant.files.folder),
        Setting("link", mapping.digest),
        Setting("pace", options.pace),
        Setting("persons", options.persons),
        Setting("signed", "" if objection else _signer(plant, options)),
        *thought.consulted.settings(playbook),
    )
    return Attaching(
        rules=rules,
        mapping=mapping,
        security=security,
        directory=options.dir,
        settings=settings,
        guard=GuardSettings(persons=options.persons, call_s=CALL_S, lease_within_s=plant.settings.link.lease_within_s),
        pace=options.pace,
        groups=groups,
        key=new_key(),
        history=history,
        believed=believed,
    )


def _checked(thought: ThoughtOf, directory: Path) -> str:
    """The digest of the playbook, empty for none; UsageError where nobody could think as was chosen.

    It is looked at in a process of its own, by what will think: what is loaded for it would stay in the guard's.
    """
    if thought.consulted.usual:
        return ""
    for name in ("record", "playbook"):
        path = getattr(thought.consulted, name)
        if path is not None and Path(path).resolve().is_relative_to(directory.resolve()):
            raise UsageError(f"--{name} {path!r} is inside --dir, which is closed when it stops; name one outside")
    command = [sys.executable, "-P", "-m", "homeostat.service.thinking", "--check", thought.plant]
    done = subprocess.run(command, input=thought.consulted.to_text(), capture_output=True, text=True, check=False)
    said = done.stderr.splitlines()
    if done.returncode:
        raise UsageError(said[-1] if said else f"who proposes could not be looked at: status {done.returncode}")
    for line in said:
        tell(line)
    return done.stdout.strip()


def _withheld(objection: str | None, unsigned: bool) -> str:
    """Why the plant is not commanded where there is an ``objection``, which is told loudly; empty where it may be."""
    if objection is None:
        return ""
    if unsigned:
        tell(f"UNSIGNED: {objection}; --unsigned lets it be commanded all the same, as for a simulated plant")
        return ""
    tell(f"UNSIGNED: {objection}; nothing is commanded: no mode beyond advise. To change that, {REMEDY}")
    return f"the configuration is not signed with this mapping by a trusted key, so nothing is commanded; {REMEDY}"


def _signer(plant: DescribedPlant, options: argparse.Namespace) -> str:
    """Who signed the configuration."""
    from homeostat.plants.files.signature import signer

    return signer(plant.files.folder, plant.configuration, options.signature)


def _objection(plant: DescribedPlant, options: argparse.Namespace, mapping: str) -> str | None:
    """Why nobody trusted vouches for the configuration of ``plant`` with this ``mapping``; None where somebody does."""
    from homeostat.journal.signing.keys import read_public
    from homeostat.plants.files.signature import check_signature

    if options.signature is not None:
        options.signature.open("rb").close()  # one that was named and is not there is a mistake in the command
    trusted = [read_public(key) for key in options.signed_by]
    return check_signature(plant.files.folder, plant.configuration, trusted, options.signature, mapping)


def _history(options: argparse.Namespace) -> Path | None:
    """Folder of the history; None where none is wanted. HistoryError where it holds something else."""
    if options.no_history:
        return None
    from homeostat.history.settings import read_settings
    from homeostat.service.attached.place import KEPT

    directory: Path = options.dir.resolve()
    folder: Path = (options.history or directory.with_name(directory.name + KEPT)).resolve()
    if folder.is_relative_to(directory):  # the journal's manifest names every file in it
        raise UsageError(f"--history {str(folder)!r} is inside --dir, which is closed when it stops; name one outside")
    read_settings(folder)
    return folder


def _believed(login: str | None) -> frozenset[str]:
    if login is None:
        return frozenset()
    try:
        return frozenset((pwd.getpwnam(login).pw_name,))
    except KeyError:
        raise UsageError(f"there is no login {login!r} on this machine; name that of the console") from None


def _groups(options: argparse.Namespace) -> dict[Role, int]:
    found = {}
    for role, name in ((Role.OPERATOR, options.operators), (Role.ENGINEER, options.engineers)):
        if name is not None:
            try:
                found[role] = grp.getgrnam(name).gr_gid
            except KeyError:
                raise UsageError(f"there is no group {name!r} on this machine; name one that has the {role}s") from None
    return found


def _absolute(case: str) -> str:
    """``case``, as a process in another folder understands it."""
    return str(Path(case).resolve()) if "/" in case else case
