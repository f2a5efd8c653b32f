"""Every command of the documentation is carried out, or marked and read: a renamed option, file or name is found."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import subprocess
import tomllib
from importlib.util import find_spec
from pathlib import Path

import pytest

import homeostat as hs
from homeostat.cli import operation
from homeostat.cli.parser import parser
from homeostat.evaluate.scenario import scenario
from homeostat.llm.address import KEY_VARIABLES
from homeostat.plants.plant import load_plant
from tests.docs.blocks import BLOCK, MARKERS, PAGES, REPO, Block, Shown, blocks, named, not_run

TESTED = {"sh", "console", "python"}
"""Languages of blocks that are carried out, or read here."""
OTHERS = {"", "text", "toml", "{eval-rst}", "{toctree}"}
"""Languages of blocks that show something: figures, outputs, studies (which are read here), parts of the site."""
COMMAND = re.compile(r"^(?:\$ )?(?:homeostat|python3?|make|pip|bash|export) ")
READ = [(page, shown) for page in PAGES for shown in not_run(page.read_text("utf-8"))]


def read_command(command: str) -> None:
    """Raise where ``command`` could not be carried out as it is written, whatever it needs."""
    match shlex.split(command, comments=True):
        case ["homeostat", *arguments]:
            _read_arguments(arguments)
        case ["make", *targets] if targets:
            made = subprocess.run(["make", "--dry-run", *targets], cwd=REPO, capture_output=True, text=True)
            assert made.returncode == 0, made.stderr
        case ["pip", "install", wanted] if extra := re.fullmatch(r"homeostat\[(\w+)\]", wanted):
            project = tomllib.loads((REPO / "pyproject.toml").read_text("utf-8"))["project"]
            assert extra[1] in project["optional-dependencies"], f"there is no extra {extra[1]!r}"
        case ["pip", "install", wanted]:
            locked = (REPO / "requirements" / "dev.txt").read_text("utf-8")
            assert re.search(rf"^{re.escape(wanted)}==", locked, re.MULTILINE), f"{wanted!r} is not locked"
        case ["python", "-m", module, *_]:
            assert find_spec(module) is not None, f"there is no module {module!r}"
        case ["bash", script]:
            assert (REPO / script).is_file(), f"there is no script {script!r}"
        case ["export", setting]:
            assert setting.partition("=")[0] in KEY_VARIABLES, f"nobody reads {setting!r}"
        case _:
            raise AssertionError(f"nobody here can tell whether {command!r} is right; carry it out")


def _read_arguments(arguments: list[str]) -> None:
    """Raise where ``homeostat`` would refuse ``arguments`` before anything runs."""
    options = parser().parse_args(arguments)
    match options.carry_out:
        case "run:carry_out":
            operation.check(options)
            operation.speaker(options)
            scenario(
                load_plant(options.case), options.fault, options.seed, options.onset, options.severity, options.end
            )
        case "campaign:carry_out":
            assert hs.Study(REPO / options.file).jobs
        case "orders:carry_out" if options.verb in ("in-service", "out-of-service", "start"):
            graphs = (f.read_text("utf-8") for f in (REPO / "src/homeostat/plants").glob("*/plant.ttl"))
            assert any(re.search(rf"\b{re.escape(options.subject)}\b", graph) for graph in graphs), options.subject


@pytest.mark.parametrize(
    ("page", "shown"), READ, ids=lambda value: value.command[:60] if isinstance(value, Shown) else ""
)
def test_what_is_not_run_is_right_as_it_is_written(
    page: Path, shown: Shown, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    for key in KEY_VARIABLES:
        monkeypatch.setenv(key, "no key")
    try:
        read_command(shown.command)
    except SystemExit:
        pytest.fail(f"{named(page)}:{shown.line}: {shown.command!r} is refused, as said on standard error")


WRONG = [
    ("homeostat run cstr --fualt fouling", "unrecognized arguments: --fualt"),
    ("homeostat run cstr --fault fowling", "'fowling'"),
    ("homeostat run cstr --fault fouling --proposer olama:qwen3:8b", "unknown proposer: 'olama:qwen3:8b'"),
    ("homeostat run cstr --fault fouling --local-only", "only a language model needs that"),
    ("homeostat campaign campaigns/slow.toml", "slow.toml"),
    ("homeostat start run t_begin", "t_begin"),
    ("homeostat reject run search-1-70s", "required: --reason"),
    ("make dmeo", "No rule to make target 'dmeo'"),
    ("pip install 'homeostat[lm]'", "no extra 'lm'"),
    ("pip install duck", "'duck' is not locked"),
    ("python -m homeostat.knowledge.bild", "no module 'homeostat.knowledge.bild'"),
    ("bash tools/no.sh", "no script 'tools/no.sh'"),
    ("export OPENAI_KEY=...", "nobody reads 'OPENAI_KEY=...'"),
    ("curl http://127.0.0.1", "nobody here can tell"),
]


@pytest.mark.parametrize(("command", "why"), WRONG, ids=lambda value: value[:40])
def test_a_command_that_is_wrong_is_found(command: str, why: str, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises((SystemExit, Exception)) as found:
        read_command(command)
    assert why in f"{found.value} {capfd.readouterr().err}"


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_no_command_hides_from_the_tests(page: Path) -> None:
    """Not in a block of another language, indented, or behind a marker that says nothing or is misspelt."""
    text = page.read_text("utf-8")
    for block in blocks(text):
        assert block.language in TESTED | OTHERS, (
            f"{named(page)}:{block.line}: {block.language!r} blocks are not tested"
        )
        commands = [line for line in block.body.splitlines() if COMMAND.match(line)]
        assert block.language in TESTED or not commands, (
            f"{named(page)}:{block.line}: {commands[0]!r} is in no sh block"
        )
        assert block.marker != "not run" or len(block.said.split()) >= 3, f"{named(page)}:{block.line}: say why"
        assert not block.marker or block.language == "sh", f"{named(page)}:{block.line}: a marker is for sh blocks"
    assert len(blocks(text)) == len(re.findall(r"^```", text, re.MULTILINE)) / 2, f"{named(page)}: a fence is odd"
    assert sum(bool(block.marker) for block in blocks(text)) == sum(
        line.startswith(f"<!-- {m}") for m in MARKERS for line in text.splitlines()
    )
    prose = BLOCK.sub("", text)
    assert not re.search(rf"^ {{4,}}{COMMAND.pattern[1:]}", prose, re.MULTILINE), f"{named(page)}: an indented command"


def spans(text: str) -> list[str]:
    """Commands that stand in the middle of a line."""
    return re.findall(r"`(homeostat [a-z][^`\n]*)`", BLOCK.sub("", text).replace("\\|", "|"))


@pytest.mark.parametrize("page", [page for page in PAGES if spans(page.read_text("utf-8"))], ids=named)
def test_commands_in_the_middle_of_a_line_have_the_options_that_they_name(page: Path) -> None:
    for span in spans(page.read_text("utf-8")):
        words = span.split()[1:]
        inner = words[0] in ("trace", "graph", "plant", "playbook", "link")
        command = [w.split("|") for w in words[: 2 if inner else 1]]
        for first in command[0]:
            for second in command[1] if len(command) > 1 else [""]:
                told = helped(first, second)
                for option in re.findall(r"--[a-z][a-z-]+", span):
                    assert re.search(rf"{option}(?![\w-])", told), f"{named(page)}: `{span}`: no {option}"


def helped(*command: str) -> str:
    """The help page of a command."""
    with contextlib.redirect_stdout(io.StringIO()) as told, pytest.raises(SystemExit) as end:
        parser().parse_args([*filter(None, command), "--help"])
    assert end.value.code == 0, command
    return told.getvalue()


TABLES = [(page, block) for page in PAGES for block in blocks(page.read_text("utf-8")) if block.language == "toml"]
PROVIDERS = [block for _, block in TABLES if "\nissuer = " in block.body]
STUDIES = [(page, b) for page, b in TABLES if not b.body.startswith("[project") and b not in PROVIDERS]
"""Of the tables that pages show, those that are no part of another package's settings, and set up no provider."""


@pytest.mark.parametrize(
    ("page", "block"), STUDIES, ids=lambda value: "" if isinstance(value, Path) else str(value.line)
)
def test_a_study_that_a_page_shows_can_be_read(page: Path, block: Block, tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(block.body, "utf-8")
    assert hs.Study(tmp_path / "study.toml").jobs, named(page)


@pytest.mark.parametrize("block", PROVIDERS, ids=lambda block: str(block.line))
def test_the_settings_of_a_provider_that_a_page_shows_can_be_read(block: Block, tmp_path: Path) -> None:
    pytest.importorskip("argon2", reason="the extra 'console' is not installed")
    from homeostat.console.sign_on.settings import read_settings

    for name, content in (("sign-on.toml", block.body), ("sign-on.secret", "a secret")):
        (tmp_path / name).touch(0o600)
        (tmp_path / name).write_text(content, "utf-8")
    settings, secret = read_settings(tmp_path / "sign-on.toml")
    assert secret == "a secret" and settings.roles.engineer and settings.redirect in block.body
