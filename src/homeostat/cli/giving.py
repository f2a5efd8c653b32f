"""An order on its way: to a plant that is attached through its service's door, to a run that goes on as a file."""

from pathlib import Path
from typing import Final

from homeostat.cli.arguments import UsageError
from homeostat.domain.mode import PersonCommand
from homeostat.service.answers import Heard, is_written, length, wait_for
from homeostat.service.attached.place import begins
from homeostat.service.doors.asking import order
from homeostat.service.inbox import post, take_back

ANSWER_S: Final = 10.0
"""Longest wait for the run's answer [s]; one whose ticks are far apart needs more."""


def given(run_dir: Path, command: PersonCommand, within_s: float = ANSWER_S) -> Heard:
    """What came of ``command``; UsageError or OrderError where nobody takes it, or nobody answers.

    A run is waited for ``within_s`` [s].
    """
    if begins(run_dir) is not None:
        return order(run_dir, command)
    before, name = length(run_dir), command.id
    post(run_dir, command)
    heard = wait_for(run_dir, name, before, within_s)
    if heard is None:
        left = take_back(run_dir, name)
        what = "the order was taken back" if left else "but has taken the order; look at what it does"
        if not is_written(run_dir):
            raise UsageError(f"run {str(run_dir)!r} has ended without an answer, {what}")
        why = "it is paused, or its ticks are that far apart"
        raise UsageError(f"run {str(run_dir)!r} did not answer within {within_s:g} s, {what}; {why}")
    return heard
