"""``homeostat attach`` and what asks it, where nothing is attached: one clear line each, and the unit that ships."""

from __future__ import annotations

import configparser
import os
import shutil
import socket
from pathlib import Path

import pytest

pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")

from homeostat.links.opcua.security.certificate import make_certificate
from homeostat.links.opcua.security.security import APPLICATION
from homeostat.service.attached.guarding import Attaching
from homeostat.service.keeping.notify import Notify
from tests.cli.command import SOURCE, homeostat, refused

TANKS = Path(__file__).parents[2] / "examples" / "two_tanks"
MAPPING = '[connection]\nurl = "opc.tcp://127.0.0.1:1/x"\n\n[tags.T1]\nnode = "ns=2;s=T1"\n'


@pytest.fixture
def mapping(tmp_path: Path) -> Path:
    path = tmp_path / "cstr.toml"
    path.write_text(MAPPING)
    (tmp_path / "wrong.toml").write_text(MAPPING.replace("tags.T1", "tags.NOSUCH"))
    (tmp_path / "degrees.toml").write_text(MAPPING + 'unit = "degC"\n')
    return path


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), ("which plant",)),
        (("cstr",), ("--link",)),
        (("cstr", "--link", "cstr.toml"), ("--dir",)),
        (("cstr", "--link", "none.toml", "--dir", "d"), ("none.toml",)),
        (("cstrr", "--link", "cstr.toml", "--dir", "d", "--insecure"), ("cstrr",)),
        (("cstr", "--link", "cstr.toml", "--dir", "d"), ("--pki",)),
        (("cstr", "--link", "cstr.toml", "--dir", "d", "--insecure", "--operators", "no-such"), ("no-such",)),
        (("cstr", "--link", "cstr.toml", "--dir", "d", "--insecure", "--pace", "0"), ("0.1",)),
        (("cstr", "--link", "wrong.toml", "--dir", "d", "--insecure"), ("NOSUCH",)),
        (("cstr", "--link", "cstr.toml", "--dir", "d", "--insecure", "--attempts", "2"), ("--attempts", "--proposer")),
        (("cstr", "--link", "cstr.toml", "--dir", "d", "--insecure", "--playbook", "b", "--protocol", "per-step"),
         ("--playbook or --protocol",)),
        (("cstr", "--link", "cstr.toml", "--dir", "d", "--insecure", "--playbook", "d/b"), ("inside --dir",)),
    ],
)  # fmt: skip
def test_what_cannot_be_attached_is_said_in_one_line(
    mapping: Path, arguments: tuple[str, ...], words: tuple[str, ...]
) -> None:
    refused(homeostat("attach", *arguments, cwd=mapping.parent), *words)
    assert not (mapping.parent / "d").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--proposer", "serch"), ("'serch'", "openai:MODEL")),
        (("--proposer", "replay:calls.jsonl"), ("calls.jsonl",)),
        (("--proposer", "openai:gpt"), ("OPENAI_API_KEY",)),
        (("--local-only", "--proposer", "http://llm.example/v1#m"), ("llm.example", "--allow-host")),
        (("--proposer", "scripted:stubborn", "--record", "no/calls"), ("no/calls",)),
        (("--protocol", "per-step"), ("step by step",)),
        (("--playbook", "no/book"), ("no such folder",)),
        (("--playbook", "."), ("is no file",)),
    ],
)  # fmt: skip
def test_who_cannot_propose_is_said_before_anything_is_attached(
    mapping: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...], words: tuple[str, ...]
) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    monkeypatch.setenv("PYTHONPATH", str(SOURCE))
    before = set(mapping.parent.iterdir())
    refused(homeostat("attach", "cstr", "--link", "cstr.toml", "--dir", "d", "--insecure", *options,
                      cwd=mapping.parent), *words)  # fmt: skip
    assert set(mapping.parent.iterdir()) == before


def test_a_node_in_another_unit_that_nothing_converts_is_neither_attached_nor_signed(mapping: Path) -> None:
    folder, told = mapping.parent, ("'T1' is in K and its node in degC", "state scale and offset")
    refused(homeostat("attach", "cstr", "--link", "degrees.toml", "--dir", "d", "--insecure", cwd=folder), *told)
    assert homeostat("plant", "keygen", "mine", cwd=folder).status == 0
    words = "--key", "mine", "--person", "Ada", "--reason", "review 7", "--out", "cstr.sig"
    refused(homeostat("plant", "sign", "cstr", *words, "--link", "degrees.toml", cwd=folder), *told)
    assert not (folder / "d").exists() and not (folder / "cstr.sig").exists()


def test_a_mapping_that_gives_up_before_the_next_tick_of_its_plant_is_refused(mapping: Path) -> None:
    folder = mapping.parent / "two_tanks"
    shutil.copytree(TANKS, folder)
    settings = folder / "case.toml"
    settings.write_text(settings.read_text("utf-8") + "\n[time]\ntick_s = 2.0\n", encoding="utf-8")
    arguments = ("attach", str(folder), "--link", "cstr.toml", "--dir", "d", "--insecure")
    done = homeostat(*arguments, cwd=mapping.parent)
    assert done.status == 2 and "dead_s = " in done.err and "tick of 2 s" in done.err and "at least 4 s" in done.err


def test_who_signed_the_configuration_decides_whether_the_plant_is_commanded(
    mapping: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, began = mapping.parent, list[Attaching]()

    def attach(attaching: Attaching, *rest: object) -> int:
        began.append(attaching)
        return 0

    monkeypatch.setattr("homeostat.service.keeping.attach.attach", attach)
    make_certificate(folder / "pki", APPLICATION, "link")
    shutil.copy(folder / "pki/own/certificate.der", folder / "pki/trusted")
    for name in ("mine", "theirs"):
        assert homeostat("plant", "keygen", name, cwd=folder).status == 0
    whose = "--key", "mine", "--person", "Ada", "--reason", "review 7", "--out", "cstr.sig"
    assert homeostat("plant", "sign", "cstr", *whose, cwd=folder).status == 0
    over = *whose[:-1], "both.sig", "--link", "cstr.toml"
    done = homeostat("plant", "sign", "cstr", *over, cwd=folder)
    assert done.status == 0 and "and the mapping" in done.out
    known = "attach", "cstr", "--link", "cstr.toml", "--dir", "d", "--pki", "pki"
    for options, told, commands in (
        ((), "UNSIGNED", False),
        (("--signed-by", "mine.pub"), "UNSIGNED", False),
        (("--signature", "both.sig", "--signed-by", "theirs.pub"), "not trusted here", False),
        (("--signature", "cstr.sig", "--signed-by", "mine.pub"), "signed no mapping", False),
        (("--signature", "both.sig", "--signed-by", "theirs.pub", "--signed-by", "mine.pub"), "", True),
        (("--unsigned",), "UNSIGNED", True),
    ):
        done = homeostat(*known, *options, cwd=folder)
        assert done.status == 0 and told in done.err and bool(told) == ("UNSIGNED" in done.err), (options, done)
        attaching = began.pop()
        assert (attaching.security.refusal == "") is commands and attaching.security.encrypted
        (signed,) = (str(setting.value) for setting in attaching.settings if setting.name == "signed")
        assert ("Ada" in signed) is (told == "")
    check = "plant", "verify", "cstr", "--key", "mine.pub", "--signature", "both.sig"
    assert homeostat(*check, "--link", "cstr.toml", cwd=folder).status == 0
    text = (folder / "cstr.toml").read_text("utf-8")
    (folder / "cstr.toml").write_text(f"# looked through\n{text}", encoding="utf-8")
    assert homeostat(*check, "--link", "cstr.toml", cwd=folder).status == 0, "it states the same"
    (folder / "cstr.toml").write_text(text.replace("s=T1", "s=T2"), encoding="utf-8")
    done = homeostat(*known, "--signature", "both.sig", "--signed-by", "mine.pub", cwd=folder)
    assert "signed another mapping" in done.err and began.pop().security.refusal
    assert homeostat(*check, "--link", "cstr.toml", cwd=folder).status == 1
    assert homeostat(*check, cwd=folder).status == 0, "the configuration is as it was"
    refused(homeostat(*known, "--signature", "none.sig", cwd=folder), "none.sig")
    refused(homeostat(*known, "--signed-by", "no key", cwd=folder), "no key")


def test_a_directory_with_something_else_in_it_is_refused(mapping: Path) -> None:
    (mapping.parent / "d").mkdir()
    (mapping.parent / "d" / "notes.txt").write_text("mine")
    arguments = ("attach", "cstr", "--link", "cstr.toml", "--dir", "d", "--insecure")
    done = homeostat(*arguments, cwd=mapping.parent)
    assert done.status == 2 and "'d' is not empty; choose another directory with --dir" in done.err


@pytest.mark.slow
def test_a_run_has_no_status(record: Path, tmp_path: Path) -> None:
    refused(homeostat("status", str(record), cwd=tmp_path), "is a run and not an attached plant")
    refused(homeostat("status", "nowhere", cwd=tmp_path), "nowhere")


def test_the_unit_has_a_watchdog_and_ends_gently(tmp_path: Path) -> None:
    done = homeostat("attach", "--print-units", cwd=tmp_path)
    unit = configparser.ConfigParser(interpolation=None, strict=False)
    unit.optionxform = str  # type: ignore[assignment]
    unit.read_string(done.out)
    service = unit["Service"]
    assert done.status == 0 and service["Type"] == "notify" and 0 < int(service["WatchdogSec"]) <= 60
    assert service["KillMode"] == "mixed" and int(service["TimeoutStopSec"]) > 15
    assert service["ExecStart"].split()[1:3] == ["homeostat", "attach"] and service["Restart"] == "always"


def test_a_service_manager_is_told_and_nobody_else_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "n"))
        manager.settimeout(5.0)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "n"))
        notify = Notify()
        assert "NOTIFY_SOCKET" not in os.environ, "processes that are begun from here tell nothing"
        notify.tell("READY=1")
        assert manager.recv(100) == b"READY=1"
    notify.tell("WATCHDOG=1")  # it is gone: nothing happens
    Notify().tell("READY=1")
