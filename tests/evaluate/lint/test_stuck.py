"""A process hangs that computes in silence for as long as it may, or that waits; one that is slow does not."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from homeostat.evaluate.lint.stuck import HELD_UP, ask, computed_s, hangs

CONTEXT = multiprocessing.get_context("fork")


def computes(said: Connection) -> None:
    while True:
        pass


def waits(said: Connection) -> None:
    time.sleep(600.0)


def speaks(said: Connection) -> None:
    time.sleep(0.3)
    said.send("here")
    time.sleep(600.0)


def ends(said: Connection) -> None:
    os._exit(0)


@contextmanager
def begun(does: Callable[[Connection], None]) -> Iterator[tuple[int, Connection]]:
    """A process that ``does`` something, and what it says."""
    here, there = CONTEXT.Pipe(duplex=False)
    process = CONTEXT.Process(target=does, args=(there,), daemon=True)
    process.start()
    there.close()
    try:
        assert process.pid is not None
        yield process.pid, here
    finally:
        process.kill()
        process.join()


@pytest.mark.parametrize(("does", "hung"), [(computes, True), (waits, True), (speaks, False), (ends, False)])
def test_whether_a_process_hangs(does: Callable[[Connection], None], hung: bool) -> None:
    with begun(does) as (pid, said):
        assert hangs(pid, said, 1.0 if hung else 20.0) is hung


def test_a_process_that_gets_a_part_of_the_machine_has_its_time_all_the_same() -> None:
    """It runs for a third of the time at most."""
    with begun(computes) as (pid, said):
        over = threading.Event()

        def hold_up() -> None:
            while not over.is_set():
                os.kill(pid, signal.SIGSTOP)
                time.sleep(0.06)
                os.kill(pid, signal.SIGCONT)
                time.sleep(0.03)

        holding = threading.Thread(target=hold_up)
        holding.start()
        before = computed_s(pid)
        try:
            assert hangs(pid, said, 0.5)
            now = computed_s(pid)
        finally:
            over.set()
            holding.join()
        assert before is not None and now is not None and now - before >= HELD_UP * 0.5


def test_a_process_that_takes_its_time_to_say_where_it_is_is_heard_to_the_end(tmp_path: Path) -> None:
    file, plants = tmp_path / "frames", tmp_path / "plant"

    def says_slowly(said: Connection) -> None:
        def say(number: int, frame: object) -> None:
            with file.open("a") as frames:
                for piece in ("Current thread 0x1 (most recent call first):\n", f'  File "{plants}/model.py", line 1'):
                    frames.write(piece)
                    frames.flush()
                    time.sleep(0.2)
                frames.write("2 in derivative\n")

        signal.signal(signal.SIGUSR1, say)
        said.send("ready")
        while True:
            time.sleep(600.0)

    file.touch()
    with begun(says_slowly) as (pid, said):
        assert said.recv() == "ready"
        assert ask(pid, file, plants) == ("model.py", 12)


def test_nobody_tells_what_a_process_that_is_gone_has_computed() -> None:
    assert computed_s(None) is None
    own = computed_s(os.getpid())
    assert own is not None and own > 0.0
