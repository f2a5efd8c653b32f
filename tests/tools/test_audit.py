"""The audit of the locked packages, against an advisory database that is here."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

AUDIT = Path(__file__).resolve().parents[2] / "tools" / "audit.py"
LOCK = AUDIT.parents[1] / "requirements" / "build.txt"
FLAW = {
    "id": "PYSEC-2026-1",
    "summary": "A flaw",
    "affected": [
        {
            "package": {"name": "packaging", "ecosystem": "PyPI"},
            "ranges": [{"type": "ECOSYSTEM", "events": [{"introduced": "0"}, {"fixed": "9999"}]}],
        }
    ],
}

pytest.importorskip("pip_audit")


@contextmanager
def database(flaws: dict[str, Any], status: int = 200) -> Iterator[str]:
    """An advisory database that knows ``flaws``, by package."""

    class Answering(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            query = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            flaw = flaws.get(query["package"]["name"])
            self.send_response(status)
            self.end_headers()
            self.wfile.write(json.dumps({"vulns": [flaw]} if flaw else {}).encode())

        def log_message(self, *_: object) -> None:
            pass

    server = HTTPServer(("127.0.0.1", 0), Answering)
    Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/v1/query"
    finally:
        server.shutdown()
        server.server_close()


def audit(url: str, lock: Path = LOCK) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(AUDIT), "--osv-url", url, str(lock)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)


def test_locks_without_a_known_flaw_pass() -> None:
    with database({}) as url:
        done = audit(url)
    assert done.returncode == 0 and done.stdout.endswith("locked packages, 0 known vulnerabilities\n"), done


def test_a_known_flaw_fails_and_is_named() -> None:
    with database({"packaging": FLAW}) as url:
        done = audit(url)
    assert done.returncode == 1, done
    assert done.stderr.startswith("packaging ") and "PYSEC-2026-1, fixed in 9999" in done.stderr


@pytest.mark.parametrize("status", [403, 500])
def test_a_database_that_does_not_answer_is_said_and_is_no_failure(status: int) -> None:
    with database({}, status) as url:
        done = audit(url)
    assert done.returncode == 0 and done.stdout.startswith("audit: skipped") and done.stdout.count("\n") == 1, done


def test_no_network_is_said_and_is_no_failure() -> None:
    with database({}) as url:
        pass
    done = audit(url)
    assert done.returncode == 0 and done.stdout.startswith("audit: skipped") and done.stdout.count("\n") == 1, done


def test_a_lock_without_hashes_is_a_failure(tmp_path: Path) -> None:
    (tmp_path / "lock.txt").write_text("packaging==26.0\n")
    with database({}) as url:
        done = audit(url, tmp_path / "lock.txt")
    assert done.returncode == 1 and "could not be audited" in done.stderr, done
