"""Help answers at once: nothing that takes long to import is on its way."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from pkgutil import walk_packages

import pytest

from homeostat import __version__
from homeostat.cli import commands
from tests.cli.command import COMMAND, environment, homeostat, refused

HEAVY = {
    "numpy", "numba", "pyoxigraph", "pyarrow", "matplotlib", "rich", "rdflib", "pyshacl", "lark", "asyncio", "scipy",
    "jinja2", "distributed", "dask", "pydantic", "bm25s", "cryptography", "sklearn",
}  # fmt: skip
PROBE = """
import sys
from homeostat.cli.main import main
try:
    main(sys.argv[1:])
except SystemExit as end:
    assert end.code == 0, end.code
print(*sorted(name.partition(".")[0] for name in sys.modules), file=sys.stderr)
"""


WITHOUT_EXTRAS = """
import sys
from importlib import import_module
extras, commands = (text.split() for text in sys.argv[1:])
sys.modules.update(dict.fromkeys(extras))
for command in commands:
    import_module(command)
"""
"""No command needs an extra to be loaded: what it needs it says in one line when it is carried out."""
EXTRAS = (
    "anthropic argon2 asyncua authlib bm25s bpe_openai dask distributed jinja2 joserfc openai pydantic_ai pyotp scipy "
    "segno sklearn starlette uvicorn"
)


@pytest.mark.parametrize(
    "command",
    [
        (), ("run",), ("campaign",), ("replay",), ("cases",), ("trace",), ("trace", "verify"), ("graph",),
        ("graph", "check"), ("graph", "query"), ("graph", "export"), ("plant",), ("plant", "sign"), ("plant", "doc"),
        ("approve",), ("mode",), ("resume",), ("history", "show"), ("history", "export"), ("plant", "learn"),
        ("monitor",),
    ],
    ids=" ".join,
)  # fmt: skip
def test_help_imports_nothing_heavy(command: tuple[str, ...]) -> None:
    arguments = [sys.executable, "-c", PROBE, *command, "--help"]
    done = subprocess.run(arguments, env=environment(), capture_output=True, text=True, timeout=240, check=True)
    assert done.stdout.startswith(f"usage: {' '.join(('homeostat', *command))} ")
    assert not HEAVY & set(done.stderr.split())


def test_commands_load_without_what_extras_install() -> None:
    named = " ".join(one.name for one in walk_packages(commands.__path__, f"{commands.__name__}.") if not one.ispkg)
    assert "homeostat.cli.commands.replay" in named and "homeostat.cli.commands.link.commissioning" in named
    asked = [sys.executable, "-c", WITHOUT_EXTRAS, EXTRAS, named]
    done = subprocess.run(asked, env=environment(), capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr


def test_the_command_loads_nothing_heavy_to_show_its_help() -> None:
    told = {**environment(), "PYTHONPROFILEIMPORTTIME": "1"}
    done = subprocess.run([*COMMAND, "--help"], env=told, capture_output=True, text=True, timeout=240, check=True)
    loaded = {line.rpartition("|")[2].strip().partition(".")[0] for line in done.stderr.splitlines()}
    assert "homeostat" in loaded and not HEAVY & loaded


def test_version(tmp_path: Path) -> None:
    done = homeostat("--version", cwd=tmp_path)
    assert (done.status, done.out, done.err) == (0, f"homeostat {__version__}\n", "")


@pytest.mark.parametrize("words", [(), ("rnu",), ("graph",), ("trace", "check"), ("run",), ("replay",)], ids=" ".join)
def test_an_incomplete_command_is_refused(tmp_path: Path, words: tuple[str, ...]) -> None:
    refused(homeostat(*words, cwd=tmp_path), "--help")


@pytest.mark.parametrize("command", ["run cstr", "history show T1 --store h", "cases"])
def test_an_option_that_a_command_does_not_have_points_to_its_help(tmp_path: Path, command: str) -> None:
    name = command.split(" T1")[0].removesuffix(" cstr")
    refused(homeostat(*command.split(), "--fualt", cwd=tmp_path), f"--fualt; see 'homeostat {name} --help'")
