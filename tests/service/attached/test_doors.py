"""The doors of an attached plant: who may pass one has its role; whatever comes in, the guard waits for nobody."""

from __future__ import annotations

import contextlib
import json
import os
import pwd
import resource
import select
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from homeostat.domain.events.people import PersonHeard
from homeostat.domain.mode import PersonCommand, Role, Verb
from homeostat.journal import Journal, RunStarted
from homeostat.service.answers import Heard
from homeostat.service.attached.place import DOORS
from homeostat.service.doors import asking, door, messages
from homeostat.service.doors.door import MOST, Behind, Doors
from homeostat.service.doors.messages import within_s
from homeostat.service.order import OrderError, run_identity, written


class Hearing:
    """What stands behind the doors: it answers at once, as a guard would in its next tick."""

    def __init__(self, directory: Path, tick_s: float = 0.0) -> None:
        self.orders: list[PersonCommand] = []
        self.full, self._tick_s = False, tick_s
        behind = Behind(self.order, lambda: {"plant": "tank"}, run_identity(directory), within_s(tick_s))
        self.doors = Doors(directory, behind, {})

    def order(self, command: PersonCommand) -> bool:
        if self.full:
            return False
        self.orders.append(command)
        told = (command.id, command.person, command.role, command.verb.value, command.subject)
        heard = PersonHeard(*told, True, "as you say"), 1.0
        threading.Timer(self._tick_s, self.doors.follow, heard).start()
        return True


@pytest.fixture
def directory(tmp_path: Path) -> Path:
    with Journal(tmp_path) as journal:
        journal.record(RunStarted("tank", (), 1), 0.0)
    return tmp_path


@pytest.fixture
def behind(directory: Path) -> Iterator[Hearing]:
    hearing = Hearing(directory)
    yield hearing
    hearing.doors.close()


def command(role: Role = Role.OPERATOR, number: int = 1) -> PersonCommand:
    return PersonCommand(f"order-{number:08d}", "Ada", role, Verb.ACKNOWLEDGE, "link")


def said(path: Path, line: bytes) -> dict[str, object]:
    with socket.socket(socket.AF_UNIX) as door:
        door.settimeout(20.0)
        door.connect(str(path))
        with contextlib.suppress(BrokenPipeError):
            door.sendall(line)
        told: dict[str, object] = json.loads(door.makefile().readline())
        return told


def test_an_order_is_answered_and_bears_the_login_that_gave_it(behind: Hearing, directory: Path) -> None:
    assert asking.order(directory, command()) == Heard(True, "as you say")
    (given,) = behind.orders
    assert given.person.startswith("Ada (login ") and given.role is Role.OPERATOR and given.age_s < 30.0
    assert f"(login {given.login})" in given.person, "it counts as the login, whatever name is typed"
    assert asking.status(directory) == {"plant": "tank"}


def test_an_order_to_a_plant_whose_ticks_are_far_apart_is_waited_for(
    directory: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (asking, messages):
        monkeypatch.setattr(module, "ANSWER_S", 0.1)
    monkeypatch.setattr(asking, "LATE_S", 0.2)
    slow = Hearing(directory, tick_s=1.0)
    assert asking.order(directory, command()) == Heard(True, "as you say")
    slow.doors.close()
    assert len(slow.orders) == 1


def test_a_guard_that_does_not_answer_in_its_ticks_is_told(directory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(messages, "ANSWER_S", 0.1)
    deaf = Behind(lambda given: True, dict, run_identity(directory), within_s(0.05))
    doors = Doors(directory, deaf, {})
    with pytest.raises(OrderError, match=r"has the order, and has not answered within 0\.2 s"):
        asking.order(directory, command())
    doors.close()
    monkeypatch.undo()
    assert (within_s(1.0), within_s(60.0)) == (12.0, 130.0)


def test_only_a_login_that_is_believed_names_people(directory: Path) -> None:
    login, given = pwd.getpwuid(os.getuid()).pw_name, list[PersonCommand]()

    def take(command: PersonCommand) -> bool:
        given.append(command)
        return False

    for believed, counted in ((frozenset({login}), ""), (frozenset({"somebody"}), login)):
        doors = Doors(directory, Behind(take, dict, run_identity(directory)), {}, believed)
        with pytest.raises(OrderError):
            asking.order(directory, command())
        doors.close()
        assert given[-1].login == counted and given[-1].person == f"Ada (login {login})"


def test_nobody_sends_a_login_along(behind: Hearing, directory: Path) -> None:
    sent = json.loads(written(command(), run_identity(directory), time.time()))
    assert "login" not in sent
    answer = said(directory / DOORS[Role.OPERATOR], json.dumps(sent | {"login": ""}).encode() + b"\n")
    assert "error" in answer and behind.orders == []


def test_both_sockets_are_for_their_owner_alone(behind: Hearing, directory: Path) -> None:
    assert [(directory / f"{role}.sock").stat().st_mode & 0o777 for role in ("operator", "engineer")] == [0o600] * 2


def test_a_group_may_be_let_in(directory: Path) -> None:
    group = os.getgid()
    doors = Doors(directory, Behind(lambda given: True, dict, run_identity(directory)), {Role.OPERATOR: group})
    operator, engineer = ((directory / f"{role}.sock").stat() for role in ("operator", "engineer"))
    assert (operator.st_mode & 0o777, operator.st_gid, engineer.st_mode & 0o777) == (0o660, group, 0o600)
    doors.close()


def test_nobody_orders_as_an_engineer_at_the_operators_door(behind: Hearing, directory: Path) -> None:
    line = written(command(Role.ENGINEER), run_identity(directory), 0.0)
    told = said(directory / "operator.sock", line)
    assert told == {"error": "this is the operator's door; nobody orders as engineer here"} and not behind.orders
    assert asking.order(directory, command(Role.ENGINEER)).done


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become somebody else")
def test_who_may_not_pass_a_door_is_told_so_in_one_line(behind: Hearing, directory: Path) -> None:
    for folder in takewhile(lambda each: each != Path(tempfile.gettempdir()), (directory, *directory.parents)):
        folder.chmod(0o755)
    code = (
        "import os, pathlib, sys; sys.path[:0] = sys.argv[2].split(os.pathsep); from tests.service.attached import "
        "test_doors as t; d = pathlib.Path(sys.argv[1]); os.setgid(65534); os.setuid(65534)\n"
        "try: t.asking.order(d, t.command())\nexcept t.OrderError as e: print(e)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(directory), os.pathsep.join(sys.path)], capture_output=True, text=True
    )
    assert done.stdout.startswith("you may not order as operator: ") and done.stdout.count("\n") == 1, done.stderr
    assert not behind.orders


@pytest.mark.parametrize("line", [b"", b"{}\n", b"[1]\n", b"\xff\xfe\n", b'{"ask":"everything"}\n', b"x" * 20_000])
def test_whatever_comes_in_is_answered_in_one_line(behind: Hearing, directory: Path, line: bytes) -> None:
    told = said(directory / "operator.sock", line or b"\n")
    assert list(told) == ["error"] and not behind.orders
    assert asking.status(directory) == {"plant": "tank"}


def test_an_order_for_another_journal_is_refused(behind: Hearing, directory: Path) -> None:
    told = said(directory / "operator.sock", written(command(), "0" * 64, 0.0))
    assert "made for another run" in str(told["error"]) and not behind.orders


def test_a_full_mailbox_is_said(behind: Hearing, directory: Path) -> None:
    behind.full = True
    with pytest.raises(OrderError, match="too many orders wait"):
        asking.order(directory, command())


def test_more_people_than_there_are_places_are_turned_away(
    behind: Hearing, directory: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(door, "ASK_S", 600.0)  # nobody goes because he says nothing

    def has_room() -> bool:
        with contextlib.suppress(OrderError):
            return asking.status(directory) == {"plant": "tank"}
        return False

    path, turned = directory / "operator.sock", 0
    with contextlib.ExitStack() as opened:
        for _ in range(MOST):
            opened.enter_context(socket.socket(socket.AF_UNIX)).connect(str(path))
        end = time.monotonic() + 60.0
        while not turned and time.monotonic() < end:
            turned += "others are being talked to" in str(said(path, b'{"ask":"status"}\n').get("error"))
    assert turned
    while not has_room():
        assert time.monotonic() < end, "those who went have made room"


class SlowToAsk(socket.socket):
    """Asks once the door is shut again."""

    def sendall(self, *line: Any) -> None:
        shut = select.poll()
        shut.register(self, 0)
        assert shut.poll(60_000.0), "nobody was turned away"
        super().sendall(*line)


def test_who_is_turned_away_before_it_could_ask_is_told_why(
    behind: Hearing, directory: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    slow = SimpleNamespace(socket=SlowToAsk, AF_UNIX=socket.AF_UNIX, SOCK_STREAM=socket.SOCK_STREAM)
    monkeypatch.setattr(behind.doors, "_places", threading.BoundedSemaphore(1))
    behind.doors._places.acquire()
    monkeypatch.setattr(asking, "socket", slow)
    with pytest.raises(OrderError, match="others are being talked to; try again"):
        asking.order(directory, command())


def test_whoever_drips_has_no_place_for_longer_than_whoever_says_nothing(
    behind: Hearing, directory: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(door, "ASK_S", 0.3)
    with socket.socket(socket.AF_UNIX) as drips:
        drips.connect(str(directory / "operator.sock"))
        end = time.monotonic() + 20.0
        with pytest.raises(BrokenPipeError):
            while time.monotonic() < end:
                drips.sendall(b" ")
                time.sleep(0.05)


def test_a_door_outlives_a_moment_in_which_no_file_can_be_opened(behind: Hearing, directory: Path) -> None:
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    with socket.socket(socket.AF_UNIX) as early:
        resource.setrlimit(resource.RLIMIT_NOFILE, (3, before[1]))
        try:
            early.connect(str(directory / "operator.sock"))
            time.sleep(0.3)
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, before)
    assert asking.status(directory) == {"plant": "tank"}


def test_where_no_service_runs_one_line_says_so(behind: Hearing, directory: Path, tmp_path: Path) -> None:
    behind.doors.close()
    with pytest.raises(OrderError, match=r"no service runs in .*; 'homeostat attach' with --dir"):
        asking.status(directory)
    with pytest.raises(OrderError, match="no service runs"):
        asking.order(directory, command())


def test_a_door_outlives_a_moment_in_which_no_thread_can_be_begun(directory: Path) -> None:
    hearing = Hearing(directory)
    with contextlib.closing(hearing.doors):
        before = threading.stack_size(1 << 47)  # more than there are addresses
        try:
            for _ in range(MOST + 1):
                with socket.socket(socket.AF_UNIX) as caller:
                    caller.settimeout(20.0)
                    caller.connect(str(directory / DOORS[Role.OPERATOR]))
                    assert b"no thread can be begun; try again" in caller.recv(1000)
        finally:
            threading.stack_size(before)
        assert asking.status(directory) == {"plant": "tank"}
