"""``homeostat status``: how an attached plant stands, from the service that guards it."""

import argparse
import json
from collections.abc import Iterator, Mapping
from typing import Any

from homeostat.cli.run_directory import run_directory
from homeostat.domain.quotation import printable
from homeostat.service.attached.place import begins
from homeostat.service.doors.asking import status
from homeostat.service.order import OrderError


def carry_out(options: argparse.Namespace) -> int:
    """Ask and print; 0."""
    run_dir = run_directory(options.run)
    if begins(run_dir) is None:
        raise OrderError(f"{str(run_dir)!r} is a run and not an attached plant; 'homeostat replay' shows it")
    told = status(run_dir)
    if options.json:
        print(json.dumps(told, indent=1))
        return 0
    for line in lines(told):
        print(printable(line))
    return 0


def lines(told: Mapping[str, Any]) -> Iterator[str]:
    """What is shown of ``told``, line by line, what a person needs first at the front."""
    mode, link, thinking, ticks = (told[name] for name in ("mode", "link", "thinking", "ticks"))
    signed = f", {told['signed'] or 'UNSIGNED'}" if "signed" in told else ""  # a service may be older than this command
    yield _row("plant", f"{told['plant']}, configuration {told['configuration'][:12]}{signed}")
    asked = f"{mode['requested']} was asked for by {mode['by']}" if mode["by"] else "nobody has asked for another one"
    yield _row("mode", f"{mode['actual']}; {asked}{'; ' + mode['why'] if mode['why'] else ''}")
    if told["writes_nothing"]:
        yield _row("writes", f"nothing: {told['writes_nothing']}")
    at = "no sample has come yet" if told["now_s"] is None else f"{told['state']}, at {told['now_s']:.0f} s"
    yield _row("state", at)
    if told["latched"]:
        yield _row("latched", told["latched"])
    yield _row("link", link["trouble"] or f"up, the plant's clock is {link['clock_s']:+z.1f} s from ours")
    gone = f"; the last one: {thinking['reason']}" if thinking["reason"] else ""
    number = thinking["process"]
    yield _row("thinking", f"{'none' if number is None else f'process {number}'}{gone}")
    without = f"{ticks['without']} without a sample, {link['missed']} samples missed"
    yield _row("ticks", f"{ticks['number']}, {without}, longest wait {ticks['longest_s']:.1f} s")
    for alarm in told["alarms"]:
        seen = "" if alarm["lasts"] else ", over"
        seen += "" if alarm["acknowledged_by"] is None else f", seen by {alarm['acknowledged_by']}"
        text = f"{alarm['alarm']} ({alarm['priority']}, since {alarm['since_s']:.0f} s{seen}): {alarm['cause']}"
        yield _row("alarm", text)
    for request, digest in told["offered"].items():
        yield _row("offered", f"{request} --digest {digest[:12]}")
    for tag in told["out_of_service"]:
        yield _row("out", f"{tag} is out of service")
    for tag, reason in told["readings"].items():
        yield _row("reading", f"{tag}: {reason}")


def _row(name: str, text: str) -> str:
    return f"{name:<9} {text}"
