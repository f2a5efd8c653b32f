"""What was measured of attached plants, as text: claims with their bars, and a table for each study."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from benchmarks.attached.rig import HEARTBEAT_S

Row = Mapping[str, Any]
BACK_S: Final = 10.0
"""Data must be there again so soon after the plant's side is [s]."""
GUARD_S: Final = 5.0
"""A guard must be back so soon [s]."""
AIM: Final = 200
"""Disturbances and kills of each kind that are aimed at."""
APART: Final = 0.05
"""Largest difference of a setpoint, as a share of its range [1]."""


class Claim(NamedTuple):
    """What is claimed, and what was measured of it."""

    what: str
    bar: str
    measured: str
    met: bool
    why: str = ""
    """Why it was not met."""


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table of Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def _of(rows: Sequence[Row], key: str) -> list[float]:
    return [float(row[key]) for row in rows if row.get(key) is not None]


def _most(values: Sequence[float]) -> str:
    return f"{max(values):.1f}" if values else "-"


def _percentile(values: Sequence[float], share: float) -> str:
    return f"{np.percentile(values, share):.1f}" if values else "-"


def _groups(rows: Sequence[Row], key: str) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(row[key], []).append(row)
    return dict(sorted(found.items()))


def disturbed(rows: Sequence[Row]) -> str:
    """The table of disturbances, kind by kind."""
    head = (
        "disturbance", "times", "back, median [s]", "99 %", "most", "never", "writes that arrived", "repeated",
        "from before", "fallbacks", "shed at most [s]",
    )  # fmt: skip

    def line(kind: str, those: list[Row]) -> list[object]:
        back = _of(those, "back_s")
        return [
            kind, len(those), _percentile(back, 50), _percentile(back, 99), _most(back),
            sum("never" in row for row in those), int(sum(_of(those, "arrived"))), int(sum(_of(those, "repeated"))),
            int(sum(_of(those, "late"))), int(sum(_of(those, "fallbacks"))), _most(_of(those, "shed_s")),
        ]  # fmt: skip

    return table(head, (line(kind, those) for kind, those in _groups(rows, "kind").items()))


def killed(rows: Sequence[Row]) -> str:
    """The table of kills, process by process."""
    head = (
        "killed", "times", "guard has a sample again, median [s]", "99 %", "most", "itself again, most [s]", "never",
        "latch lost", "mode above observe after", "samples lost", "kept twice",
    )  # fmt: skip

    def line(who: str, those: list[Row]) -> list[object]:
        back = _of(those, "guard_s")
        own = who in ("guard", "the first")
        return [
            who, len(those), _percentile(back, 50), _percentile(back, 99), _most(back),
            _most(_of(those, "again_s")), sum("never" in row for row in those), sum(map(_unlatched, those)),
            sum(own and row.get("mode", "observe") != "observe" for row in those), int(sum(_of(those, "lost"))),
            int(sum(_of(those, "twice"))),
        ]  # fmt: skip

    return table(head, (line(who, those) for who, those in _groups(rows, "who").items()))


def _unlatched(row: Row) -> bool:
    return bool(row.get("latch")) and not row.get("latched", True)


def recovered(rows: Sequence[Row]) -> str:
    """The table of the reactor's runs over the wire."""
    head = ("mode", "fault", "over the wire", "in one process", "farthest setpoint [% of range]", "writes", "load")

    def line(row: Row) -> list[object]:
        if "never" in row:
            return [row["mode_ordered"], row["fault"], f"not measured: {row['never']}", "-", "-", "-", row["load"]]
        apart = row["apart"][0] if row["apart"] else None
        beside = row["beside"]
        return [
            row["mode_ordered"], row["fault"], came_to(row), f"{beside['outcome']}, {beside['states'][-1]}",
            "-" if apart is None else f"{100 * apart:.1f}", len(row["written"]), row["load"],
        ]  # fmt: skip

    return table(head, map(line, sorted(rows, key=lambda row: (row["mode_ordered"], row["fault"]))))


def came_to(row: Row) -> str:
    """What a run over the wire came to, in a few words."""
    if row["fallbacks"]:
        return f"fallback, {row['state']}"
    if row["released"]:
        return f"released, {row['state']}"
    return f"advised {len(row['offered'])} times" if row["offered"] else f"nothing was needed, {row['state']}"


def many(rows: Sequence[Row]) -> str:
    """The table of what many tags took."""
    head = (
        "tags", "ticks", "without a sample", "a tick, median, 99 % and most [ms]", "of the processor [ms]",
        "guard [cores]", "historian [cores]", "memory, first and last [MB]", "bytes per sample", "load",
    )  # fmt: skip

    def line(row: Row) -> list[object]:
        wall, cpu, memory = (", ".join(map(str, row[key])) for key in ("wall_ms", "cpu_ms", "memory_mb"))
        return [
            row["tags"], row["ticks"], row["without"], wall, cpu, row["guard_cores"], row["historian_cores"], memory,
            row["bytes_per_sample"], row["load"],
        ]  # fmt: skip

    return table(head, map(line, rows)) if rows else "Not measured."


def claims(found: Mapping[str, Sequence[Row]]) -> Iterator[Claim]:
    """Every claim of which there are rows."""
    if rows := found.get("disturbed"):
        yield from _of_links(rows)
    if rows := found.get("killed"):
        yield from _of_kills(rows)
    if rows := found.get("recovered"):
        yield from _of_recoveries([row for row in rows if "never" not in row])
    for row in found.get("many", ()):
        yield from _of_many(row)


def _of_links(rows: Sequence[Row]) -> Iterator[Claim]:
    least = min(len(those) for those in _groups(rows, "kind").values())
    back, never = _of(rows, "back_s"), sum("never" in row for row in rows)
    yield Claim(
        "Disturbances of each kind", f"{AIM}", f"{least} of each at least, {len(rows)} in all", least >= AIM, "time"
    )
    yield Claim(
        "Data again after the plant's side is back", f"<= {BACK_S:g} s, all",
        f"{max(back):.1f} s at most, {never} never", max(back) <= BACK_S and not never, "see the table",
    )  # fmt: skip
    for what, key in (("Writes that arrived more often than they were meant to, or from before", "repeated"),
                      ("Fallbacks while the plant was silent", "fallbacks")):  # fmt: skip
        count = int(sum(_of(rows, key)) + (sum(_of(rows, "late")) if key == "repeated" else 0))
        yield Claim(what, "0", f"{count} in {len(rows)}", count == 0, "see the table")
    dead = [row for row in rows if row.get("dead_s", 0.0) >= HEARTBEAT_S + 2.0]
    shed = _of(dead, "shed_s")
    in_time = len(shed) == len(dead) and max(shed, default=0.0) <= HEARTBEAT_S + 2.0
    text = f"{len(shed)} of {len(dead)}, {_most(shed)} s at most"
    yield Claim(
        f"The plant sheds when we are dead for {HEARTBEAT_S + 2:g} s", f"<= {HEARTBEAT_S + 2:g} s", text, in_time
    )


def _of_kills(rows: Sequence[Row]) -> Iterator[Claim]:
    groups = _groups(rows, "who")
    least = min(len(those) for those in groups.values())
    yield Claim(
        "Kills of each process", f"{AIM}", f"{least} of each at least, {len(rows)} in all", least >= AIM, "time"
    )
    late: Callable[[str], list[float]] = lambda who: _of(groups.get(who, []), "guard_s")  # noqa: E731
    for who, why in (("guard", "the host was busy"), ("the first", "all of it begins anew: an interpreter, the plant")):
        if took := late(who):
            over = sum(t > GUARD_S for t in took)
            text = f"{max(took):.1f} s at most, {over} of {len(took)} later"
            yield Claim(f"Guard back in observe after a kill of {who}", f"<= {GUARD_S:g} s", text, not over, why)
    bad = sum(map(_unlatched, rows)) + sum("never" in row for row in rows)
    yield Claim(
        "Latches lost, or services that never came back", "0", f"{bad} in {len(rows)}", not bad, "see the table"
    )
    lost = int(sum(_of(rows, "lost")) + sum(_of(rows, "twice")))
    yield Claim("Samples of the history lost or kept twice", "0", f"{lost}", not lost, "see the table")


def _of_recoveries(rows: Sequence[Row]) -> Iterator[Claim]:
    writing = [row for row in rows if row["mode_ordered"] != "advise"]
    same = [row for row in writing if _as_in_one_process(row)]
    yield Claim(
        "The reactor at five times real time: path and setpoints as in one process",
        f"<= {100 * APART:g} % of range, all",
        f"{len(same)} of {len(writing)} runs", len(same) == len(writing), "see the table",
    )  # fmt: skip
    advised = [row for row in rows if row["mode_ordered"] == "advise"]
    if advised:
        written = sum(len(row["written"]) for row in advised)
        text = f"{written} in {len(advised)} runs, as the server's wire has it"
        yield Claim("Writes in advise", "0", text, not written, "see the table")


def _as_in_one_process(row: Row) -> bool:
    if not row["released"] or not row["beside"]["released"]:
        return not row["released"] and not row["beside"]["released"] and not row["fallbacks"]
    apart = row["apart"][0]
    return not row["fallbacks"] and apart is not None and bool(apart <= APART)


def _of_many(row: Row) -> Iterator[Claim]:
    tags, minutes = row["tags"], row["ticks"] / 60
    what = f"{tags} tags at 1 Hz for {minutes:.0f} min"
    yield Claim(f"{what}", "120 min", f"{minutes:.0f} min", minutes >= 119, "time: what is per sample or second stands")
    lost = row["missed"] + row["gaps"]
    yield Claim(
        "... samples missed, gaps in the history", "0", f"{row['missed']}, {row['gaps']}", not lost, "a busy host"
    )
    wall, cpu = row["wall_ms"][1], row["cpu_ms"][1]
    yield Claim(
        "... a tick of the guard, 99th percentile", "<= 50 ms", f"{wall:g} ms ({cpu:g} ms of the processor)",
        wall <= 50.0,
        f"other processes had the cores: the load was {row['load']:g} on two",
    )  # fmt: skip
    first, last = row["memory_mb"]
    yield Claim(
        "... memory of the guard's process",
        "+5 %",
        f"{first} to {last} MB",
        last <= 1.05 * first,
        "the last hour is kept for thinking, 64 MB at most",
    )
    size = row["bytes_per_sample"]
    yield Claim(
        "... history, bytes per sample",
        "<= 3",
        f"{size:g}",
        size <= 3.0,
        "each node of the served plant has times of its own",
    )
