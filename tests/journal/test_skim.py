"""A long journal is followed by its chain and read where it matters: nothing is lost, and no change passes."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from homeostat.journal import BrokenChain, Journal, Record, read_events
from homeostat.journal.reading import scan, skim
from tests.journal.forgery import lines_of, rewrite
from tests.journal.samples import write_open_run

JOURNAL = "events.jsonl"
KINDS = ("run-started", "measured", "run-finished")
DATA = Path(__file__).parent / "data"
on_one_file = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)


def scanned(path: Path, kinds: Collection[str]) -> list[Record]:
    """What reading every line finds of ``kinds``, and the last line."""
    every = [line.record for line in scan(path)]
    return [record for record in every if record.kind in kinds or record is every[-1]]


def skimmed(path: Path, kinds: Collection[str]) -> list[Record]:
    return [line.record for line in skim(path, kinds) if line.record is not None]


@pytest.mark.parametrize("kinds", [(), KINDS[:1], KINDS[1:2], KINDS, ("no such kind",)])
@pytest.mark.parametrize("torn", [b"", b'{"seq":9,"pre', b'{"seq":9,"prev":"x"}'])
def test_what_is_asked_for_is_read_and_the_last_line(tmp_path: Path, kinds: tuple[str, ...], torn: bytes) -> None:
    write_open_run(tmp_path)
    path = tmp_path / JOURNAL
    path.write_bytes(path.read_bytes() + torn)
    assert skimmed(path, kinds) == scanned(path, kinds) == list(read_events(tmp_path, kinds))
    assert [line.raw for line in skim(path, kinds)] == [line.raw for line in scan(path)]


def test_an_empty_journal_has_nothing(tmp_path: Path) -> None:
    (tmp_path / JOURNAL).write_bytes(b"")
    assert list(read_events(tmp_path, ())) == []


def broken(read: Callable[[], object]) -> bool:
    try:
        read()
    except BrokenChain:
        return True
    return False


@given(st.data(), st.sampled_from([(), KINDS[:1], KINDS[1:2]]))
@on_one_file
def test_a_byte_that_was_altered_is_noticed_wherever_it_is(
    tmp_path: Path, data: st.DataObject, kinds: tuple[str, ...]
) -> None:
    """Whatever reading all of it finds wrong, following it finds as well; the line may be named by the next one."""
    if not (tmp_path / JOURNAL).exists():
        write_open_run(tmp_path)
        (tmp_path / "whole").write_bytes((tmp_path / JOURNAL).read_bytes())
    whole = bytearray((tmp_path / "whole").read_bytes())
    at = data.draw(st.integers(0, len(whole) - 2))
    whole[at] = data.draw(st.integers(0, 255).filter(lambda byte: byte != whole[at]))
    path = tmp_path / JOURNAL
    path.write_bytes(bytes(whole))
    followed = broken(lambda: list(skim(path, kinds)))
    assert followed == broken(lambda: list(scan(path)))
    confirmed = at < whole.rstrip(b"\n").rfind(b"\n")  # nothing confirms the last line: a letter of a text may differ
    assert followed or not confirmed


@pytest.mark.parametrize("kinds", [(), KINDS[1:2]])
@pytest.mark.parametrize("number", [2, 4, 7])
def test_a_line_that_is_gone_is_noticed(tmp_path: Path, number: int, kinds: tuple[str, ...]) -> None:
    write_open_run(tmp_path)
    path = tmp_path / JOURNAL
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[: number - 1] + lines[number:]))
    with pytest.raises(BrokenChain, match=f"line {number} carries number {number + 1}"):
        list(skim(path, kinds))


def test_a_former_name_is_asked_for_by_its_present_one() -> None:
    every = list(read_events(DATA / "format-1"))
    kinds = {"fallback-activated", "no-action", "deviated"}
    assert list(read_events(DATA / "format-1", kinds)) == [r for r in every if r.kind in kinds or r is every[-1]]


def test_a_journal_is_gone_on_with_behind_its_last_line(tmp_path: Path) -> None:
    """Signatures, numbers and times go on, however little of it was read."""
    write_open_run(tmp_path)
    before = lines_of(tmp_path)
    with Journal.resume(tmp_path):
        pass
    after = lines_of(tmp_path)
    assert after[: len(before)] == before and after[-1]["event"] == "resumed"
    assert after[len(before)]["seq"] == len(before) + 1 and after[-1]["at_s"] == before[-1]["at_s"]
    assert len(list(scan(tmp_path / JOURNAL))) == len(after)


def test_lines_that_somebody_wrote_anew_are_followed_as_far_as_they_follow(tmp_path: Path) -> None:
    """Whoever can write the whole chain anew is found out by signatures, and by nothing else."""
    write_open_run(tmp_path)
    rewrite(tmp_path, [line for line in lines_of(tmp_path) if line["event"] != "measured"])
    assert [record.kind for record in read_events(tmp_path, KINDS)] == ["run-started", "run-finished"]
