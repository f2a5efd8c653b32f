"""Looks every locked version up in the public advisory database (OSV); fails where one has a known vulnerability.

``python tools/audit.py [--osv-url URL] [FILE ...]``; all of ``requirements/*.txt`` where no file is named. Exit status
1 with a line for each vulnerability. Where the database does not answer that is said in one line and is no failure:
without a network nothing else may stop. The database is OSV's because its client reports what it could not ask; that of
the package index takes "no answer" for "no vulnerability".
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

REQUIREMENTS = Path(__file__).resolve().parents[1] / "requirements"
OSV = "https://api.osv.dev/v1/query"
NO_ANSWER = ("ConnectionError", "ConnectTimeout", "ReadTimeout", "ServiceError", "ProxyError", "SSLError", "HTTPError")
"""How the names of the exceptions end that mean: the database could not be asked."""


class Unreachable(Exception):
    """The advisory database gave no answer; the message says why."""


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="tools/audit.py", description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="lock file; default: requirements/*.txt")
    parser.add_argument("--osv-url", default=OSV, help="query address of the advisory database")
    options = parser.parse_args(arguments)
    files = options.files or sorted(REQUIREMENTS.glob("*.txt"))
    found: set[str] = set()
    audited: set[str] = set()
    try:
        for file in files:
            packages = asked(file, options.osv_url)
            audited.update(f"{item['name']} {item.get('version')}" for item in packages)
            found.update(told(packages))
    except Unreachable as error:
        print(f"audit: skipped, the advisory database cannot be asked: {error}")
        return 0
    for line in sorted(found):
        print(line, file=sys.stderr)
    print(f"audit: {len(audited)} locked packages, {len(found)} known vulnerabilities")
    return 1 if found else 0


def asked(file: Path, url: str) -> list[dict[str, Any]]:
    """What the database says about every package of a lock file."""
    command = [sys.executable, "-m", "pip_audit", "--disable-pip", "--require-hashes", "--progress-spinner", "off"]
    command += ["--format", "json", "--vulnerability-service", "osv", "--osv-url", url, "--requirement", str(file)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        packages: list[dict[str, Any]] = json.loads(run.stdout)["dependencies"]
        return packages
    except ValueError:
        reason = (run.stderr.strip().splitlines() or ["pip-audit said nothing"])[-1]
    if reason.partition(":")[0].endswith(NO_ANSWER):
        raise Unreachable(reason[:200])
    raise SystemExit(f"audit: {file.name} could not be audited (status {run.returncode}): {reason}")


def told(packages: list[dict[str, Any]]) -> Iterator[str]:
    """A line for every vulnerability, and for every package that was not looked up."""
    for item in packages:
        if "skip_reason" in item:
            yield f"{item['name']} was not looked up: {item['skip_reason']}"
        for flaw in item.get("vulns", ()):
            fixed = ", ".join(flaw["fix_versions"]) or "no release yet"
            yield f"{item['name']} {item['version']}: {flaw['id']}, fixed in {fixed}; lock again with 'make lock'"


if __name__ == "__main__":
    sys.exit(main())
