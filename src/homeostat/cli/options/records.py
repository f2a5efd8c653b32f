"""Commands on a run that goes on or is over: what people order of it, replay, trace verify."""

from pathlib import Path
from typing import Final

from homeostat.cli.options.arguments import Commands, Parser, command

LEAST_DIGITS: Final = 8
"""Fewest digits that name a digest."""
_ORDERED: Final = (
    "Exit status: 0 done, or heard where more people must order it; 3 refused by the guard, which says why; 2 no such "
    "run, it is over, or it does not answer. "
    "Name and role are a claim: the guard checks what the role may order and journals both; simulation trusts them."
)


def orders(commands: Commands) -> None:
    """Declare approve, reject, reset, mode, in-service, acknowledge, fall-back and start."""
    approve = _order(commands, "approve", "say yes to a request that waits, or list the requests that wait", "operator")
    approve.add_argument("subject", nargs="?", default="", metavar="REQUEST", help="the request; left out: list them")
    approve.add_argument("--digest", metavar="D", help=f"digest of what is approved, {LEAST_DIGITS} digits or more")
    approve.set_defaults(carry_out="orders:approve")
    reject = _order(commands, "reject", "say no to a request that waits", "operator", reason="required")
    reject.add_argument("subject", metavar="REQUEST", help="the request")
    after = "reset the latch after a fallback; the plant stands in observe then"
    _order(commands, "reset", after, "engineer", reason="required")
    mode = _order(commands, "mode", "change what may be done to the plant", "engineer", reason="possible")
    mode.add_argument("subject", metavar="MODE", help="observe, advise, approve or closed-loop")
    service = _order(commands, "in-service", "bring a writable tag back, or take it out", "operator", reason="possible")
    service.add_argument("subject", metavar="TAG", help="the tag")
    out = "take it out; with --reason"
    service.add_argument("--out", action="store_const", dest="verb", const="out-of-service", help=out)
    seen = _order(commands, "acknowledge", "say that an alarm was seen", "operator")
    seen.add_argument("subject", metavar="ALARM", help="the alarm, as the run shows it")
    _order(commands, "fall-back", "have the fallback act now", "engineer", reason="required")
    start = _order(commands, "start", "take a transition that leads back to a start", "engineer")
    start.add_argument("subject", metavar="TRANSITION", help="the transition, as the tables name it")


def _order(commands: Commands, verb: str, about: str, role: str, reason: str = "none") -> Parser:
    """A command with what every order has; ``reason`` is ``none``, ``possible`` or ``required``."""
    made = command(commands, verb, "orders:carry_out", about, f"Order a run that goes on: {about}.", _ORDERED)
    add = made.add_argument
    add("run", type=Path, metavar="RUN", help="run directory")
    if reason != "none":
        add("--reason", required=reason == "required", default="", metavar="R", help="why, in your words")
    add("--person", metavar="NAME", help="who orders it (default: the login name)")
    add("--role", choices=("operator", "engineer"), default=role, help=f"in which role (default: {role})")
    made.set_defaults(verb=verb, subject="", digest="", reason="")
    return made


def replay(commands: Commands) -> None:
    """Declare ``homeostat replay``."""
    about = "Show a recorded run again, from its journal, with the lines that the run showed."
    ending = "Exit status 1 where the record is incomplete or was altered; what can be shown is shown before."
    add = command(commands, "replay", "replay:carry_out", "show a recorded run again", about, ending).add_argument
    add("run", type=Path, metavar="RUN", help="run directory")
    add("--case", metavar="PATH", help="folder of the run's plant, where it is not where it was")
    add("--json", action="store_true", help="print the result as the run did with --json")


def trace_verify(commands: Commands) -> None:
    """Declare ``homeostat trace verify``."""
    about = (
        "Check the hash chain and the signatures of a run's journal, whether its events agree with one "
        "another, its manifest and every file that the manifest names. A key is trusted only from outside the run."
    )
    ending = (
        "Exit status: 0 complete, unaltered and signed by a trusted key; 1 incomplete, altered, contradicting "
        "itself, signed by a stranger, without a signature or without a closing one; 2 not a run directory, or no key; "
        "3 without a signature and in the format from before runs were signed: it agrees with itself, and anybody may "
        "have written it."
    )
    what = "check that a recorded run is complete, unaltered and signed"
    add = command(commands, "verify", "trace_verify:carry_out", what, about, ending).add_argument
    add("run", type=Path, metavar="RUN", help="run directory")
    form = "a file, or 32 bytes in hexadecimal or base64 (may be given several times; default: the installation's key)"
    add("--key", action="append", metavar="PUBLIC", help=f"public key to trust: {form}")
