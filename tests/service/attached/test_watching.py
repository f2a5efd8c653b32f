"""What the guard's process looks after beside the guard: time that goes on, the connection, and what is shown."""

from __future__ import annotations

import itertools
import subprocess
import sys
from dataclasses import dataclass, field

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.events.guard import ThinkingBegan, ThinkingEnded
from homeostat.domain.events.people import ModeEntered
from homeostat.domain.mode import Mode
from homeostat.domain.observation import StandBack
from homeostat.domain.snapshot import Snapshot
from homeostat.links.errors import LinkError
from homeostat.service.attached.source import Onward
from homeostat.service.attached.standing import APART, Standing
from homeostat.service.attached.status import ModeShown, ThinkingShown

FAST = 1000.0
"""Process seconds per second: a tick without a sample waits for half a second."""


@dataclass
class Scripted:
    """A link's source that gives samples of the given times, and then raises."""

    times: list[float]
    now_s: float = 0.0
    never_blocks: bool = False
    ended: bool = False

    def advance(self) -> Snapshot | None:
        if not self.times:
            raise LinkError("the plant is not reached")
        self.now_s = self.times.pop(0)
        return Snapshot(self.now_s, {"T": 1.0}, taken_s={"T": self.now_s - 2.0})


@given(st.lists(st.integers(1, 30), min_size=1, max_size=8), st.floats(0.0, 1e6), st.integers(1, 10**6))
def test_time_goes_on_behind_the_journal_and_never_runs_back(steps: list[int], after_s: float, first: int) -> None:
    times = [float(first + sum(steps[:k])) for k in range(len(steps))]
    source, last = Onward(Scripted(list(times)), after_s, FAST), after_s
    found = []
    for _ in times:
        sample = source.advance()
        assert sample is not None and sample.at_s == source.now_s > last
        assert sample.taken_s["T"] == pytest.approx(sample.at_s - 2.0)
        last = sample.at_s
        found.append(sample.at_s)
    assert [b - a for a, b in itertools.pairwise(found)] == [float(step) for step in steps[: len(times) - 1]]
    if times[0] > after_s:
        assert found == times or times[0] <= -(-after_s // 1), "the plant's own time where that is possible"


def test_a_tick_without_a_sample_comes_all_the_same() -> None:
    source = Onward(Scripted([]), 100.0, FAST)
    for now_s in (101.0, 102.0):
        with pytest.raises(LinkError, match="not reached"):
            source.advance()
        assert source.now_s == now_s


@dataclass
class Connection:
    trouble: str = ""
    connections: int = 1
    clock_s: float = 0.0
    permitted: bool = True
    put: list[StandBack] = field(default_factory=list)


def test_a_lost_connection_and_one_that_was_made_again_bring_the_mode_down() -> None:
    link = Connection()
    standing = Standing(link, 2.0, link.put.append)
    standing.look(Mode.CLOSED_LOOP)
    assert link.put == []
    link.trouble = "silent"
    standing.look(Mode.CLOSED_LOOP)
    assert link.put == [StandBack("the connection was lost: silent")]
    link.trouble, link.connections = "", 3
    standing.look(Mode.ADVISE)
    assert link.put[-1].reason == "the connection was lost and made again"
    standing.look(Mode.CLOSED_LOOP)
    assert len(link.put) == 2, "a person may raise it again"


def test_a_permission_that_is_taken_back_ends_a_mode_that_writes() -> None:
    link = Connection(permitted=False)
    standing = Standing(link, 2.0, link.put.append)
    for mode in (Mode.OBSERVE, Mode.ADVISE):
        standing.look(mode)
    assert link.put == []
    standing.look(Mode.APPROVE)
    assert link.put == [StandBack("the plant's operators do not permit writing any more")]


def test_clocks_that_differ_for_long_bring_the_mode_down_and_one_late_sample_does_not() -> None:
    link = Connection()
    standing = Standing(link, 2.0, link.put.append)
    for clock_s in (5.0, 0.1, -5.0, -5.0):
        link.clock_s = clock_s
        standing.look(Mode.APPROVE)
    assert link.put == []
    for _ in range(APART):
        standing.look(Mode.APPROVE)
    assert link.put and "-5.0 s from ours, 2 s are allowed" in link.put[0].reason


def test_who_observes_already_is_not_told() -> None:
    link = Connection(trouble="gone", clock_s=99.0)
    standing = Standing(link, 2.0, link.put.append)
    for _ in range(10):
        standing.look(Mode.OBSERVE)
    assert link.put == []


def test_requested_and_actual_mode_are_two_things() -> None:
    shown = ModeShown().after(ModeEntered("observe", ""), 1.0)
    assert (shown.requested, shown.actual, shown.why) == ("observe", "observe", "")
    shown = shown.after(ModeEntered("closed-loop", "Ada"), 10.0)
    assert (shown.requested, shown.by, shown.actual) == ("closed-loop", "Ada", "closed-loop")
    shown = shown.after(ModeEntered("observe", "", "the connection was lost"), 20.0)
    assert (shown.requested, shown.actual, shown.why) == ("closed-loop", "observe", "the connection was lost")
    again = shown.after(ModeEntered("observe", ""), 30.0)
    assert (again.requested, again.actual, again.why) == ("closed-loop", "observe", "the guard began again")


def test_thinking_is_shown_with_why_the_last_one_ended() -> None:
    shown = ThinkingShown().after(ThinkingBegan(7))
    assert (shown.process, shown.begun, shown.reason) == (7, 1, "")
    shown = shown.after(ThinkingEnded(7, "killed")).after(ThinkingBegan(8))
    assert (shown.process, shown.begun, shown.reason) == (8, 2, "killed")


def test_the_guards_process_loads_rules_and_neither_twin_nor_compiler() -> None:
    code = (
        "import sys; import homeostat.service.keeping.attach\n"
        "from homeostat.plants.described import read_described; from homeostat.plants.wired.guarding import rules_of\n"
        "assert rules_of(read_described('cstr')).plant == 'cstr'\n"
        "print(sorted({'numba', 'llvmlite', 'matplotlib', 'homeostat.twin.twin', 'homeostat.plants.plant', "
        "'homeostat.recovery.supervisor', 'homeostat.plants.cstr.kernel'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_both_processes_know_a_plant_by_the_same_digest() -> None:
    from homeostat.plants.described import read_described
    from homeostat.plants.plant import load_plant
    from homeostat.plants.wired.assembly import guard_rules
    from homeostat.plants.wired.guarding import rules_of

    for name in ("cstr", "mixing_module"):
        assert rules_of(read_described(name)) == guard_rules(load_plant(name))
