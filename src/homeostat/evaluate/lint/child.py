"""A process of its own for checks that run a plant's code: whatever it does there, hang or end, is one finding.

The child says which check it begins; where none is over in the time that it has, the child is killed.
"""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Final

from homeostat.evaluate.lint.checks import CHECKS, Check, Found
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.scaled import broken
from homeostat.evaluate.lint.finding import Finding, Place, Severity, split
from homeostat.evaluate.lint.stuck import answer_to, ask, hangs
from homeostat.plants.error import PlantError
from homeostat.plants.files import generated
from homeostat.plants.files.code import told
from homeostat.plants.files.folder import BASELINES, PlantFiles, read_files
from homeostat.process.batch import ProcessError

LIMIT_S: Final = 20.0
"""Longest silence of a check that simulates: a run of a plant takes less than a second [s]."""
PATIENT_S: Final = 60.0
"""Longest silence while equations are compiled, or an answer is searched for [s]."""
_MEND: Final = "mend the plant's code"


@dataclass(frozen=True, slots=True)
class Begun:
    """A check has begun, or one of its parts."""

    check: str
    """Name of the check."""
    part: str = ""
    """What is being done; empty at its beginning."""


@dataclass(frozen=True, slots=True)
class Over:
    """Every check that could be carried out was."""


def carried_out(
    folder: Path, names: tuple[str, ...], told: Callable[[Begun], None], silent_s: float = LIMIT_S
) -> Iterator[Found]:
    """What the checks called ``names`` find in the plant in ``folder``; ``told`` hears how far they are.

    One that simulates and says nothing while it computes for ``silent_s`` [s] is a finding, and the last one.
    """
    context = get_context("spawn")
    here, there = context.Pipe(duplex=False)
    with tempfile.TemporaryDirectory(prefix="homeostat-check-") as scratch:
        frames = Path(scratch) / "frames.txt"
        process = context.Process(target=_serve, args=(there, str(folder), names, str(frames)), daemon=True)
        process.start()
        there.close()
        now, limit_s = Begun(names[0]), PATIENT_S
        try:
            while not hangs(process.pid, here, limit_s):
                said = here.recv()
                match said:
                    case Begun():
                        now, limit_s = said, PATIENT_S if CHECKS[said.check].patient else silent_s
                        told(said)
                    case Over():
                        return
                    case _:
                        yield said
            what = f"the plant's code does not answer for {limit_s:g} s in {_doing(now)}, nothing after it is checked"
            yield _stopped(folder, now, what, ask(process.pid, frames, folder))
        except EOFError:
            process.join(LIMIT_S)
            what = f"the plant's code ends the process, with status {process.exitcode}, in {_doing(now)}"
            yield _stopped(folder, now, what, None)
        finally:
            process.kill()
            process.join()
            here.close()


def _doing(now: Begun) -> str:
    return f"the check {now.check!r}" + (f" ({now.part})" if now.part else "")


def _stopped(folder: Path, now: Begun, what: str, line: tuple[str, int] | None) -> Finding:
    names = sorted(name for name in read_files(folder).own_code if "/" not in name)
    place = Place("process.py" if "process.py" in names or not names else names[0], None, now.part or now.check)
    remedy = f"{_MEND}; try it with 'homeostat plant try {folder}'"
    return Finding(Severity.ERROR, now.check, place if line is None else Place(*line), what, remedy)


def _serve(pipe: Connection, folder: str, names: tuple[str, ...], frames: str) -> None:
    """The child: carry the checks out in their order, until one that others rely on finds something."""
    answer_to(Path(frames))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # whoever interrupts the command ends this process, too
    logging.getLogger(generated.__name__).setLevel(logging.ERROR)  # what was made again the parent has told
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # a plant may print; results are the parent's to show
    here = Path(folder)
    with contextlib.suppress(BrokenPipeError):
        doing = [names[0]]
        bench = Bench(here, lambda part: pipe.send(Begun(doing[0], part)))
        for name in names:
            doing[0] = name
            pipe.send(Begun(name))
            wrong = False
            for found in findings_of(CHECKS[name], bench):
                pipe.send(found)
                wrong = wrong or (isinstance(found, Finding) and found.severity is Severity.ERROR)
            if wrong and CHECKS[name].others_rely:
                break
        pipe.send(Over())


def findings_of(check: Check, bench: Bench) -> Iterator[Found]:
    """What a check finds; what the plant's code raises meanwhile is a finding, too."""
    try:
        yield from check.carry_out(bench)
    except (KeyboardInterrupt, GeneratorExit):
        raise
    except PlantError as refused:  # only learning refuses a plant that was loaded
        what, remedy = split(str(refused), "correct what is not well")
        yield Finding(Severity.ERROR, check.name, Place(BASELINES), what, remedy)
    except ProcessError as error:
        yield from broken(bench, str(error), check.name)
    except BaseException as raised:  # it is anybody's code
        place, what = _raised(read_files(bench.folder), raised)
        yield Finding(Severity.ERROR, check.name, place, f"{what} in the check {check.name!r}", _MEND)


def _raised(files: PlantFiles, broken: BaseException) -> tuple[Place, str]:
    """The line of the plant's own code that something came from, and what it is."""
    text = told(files, broken).replace("; ", ", ")
    where, separator, what = text.partition(": ")
    name, _, line = where.partition(", line ")
    if separator and line.isdigit():
        return Place(name, int(line)), what
    return Place("process.py" if "process.py" in files.own_code else "case.toml"), text
