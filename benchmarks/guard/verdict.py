"""What must hold of a plant and its journal after guards have died beside it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

from benchmarks.guard.life import Life
from homeostat.domain.recovery import Command
from homeostat.guard.writing.flight import PUT_RIGHT
from homeostat.journal import BrokenChain, Record
from homeostat.journal.beside.files import JOURNAL
from homeostat.links.truth.process import TrueProcess

FRESH_S = 15.0
"""What was intended this shortly before the end need not be read back yet [s]."""


@dataclass(frozen=True)
class Judged:
    """One life, as it ended."""

    wrong: list[str]
    places: list[str]
    """Where guards died."""
    instants: list[str]
    """Where the first one might have died."""
    state: str
    fell_back: bool


def verdict(life: Life, process: TrueProcess, instants: list[str]) -> Judged:
    """Everything that is wrong with ``life``, a line each."""
    try:
        events = life.events()
    except BrokenChain as broken:
        return Judged([f"the journal does not verify: {broken}"], life.deaths, instants, "", False)
    fell_back = life.guard.latched is not None or any(map(_falls_back, events))
    wrong = [
        *_lost(life), *_repeated(events), *_unnoticed(events, life.link.now_s), *_unasked(life, events),
        *_unsafe(life, process, events),
    ]  # fmt: skip
    wrong += [
        f"{e.fields['alarm']}: {e.fields['cause']}" for e in events
        if e.kind == "alarm-raised" and str(e.fields["alarm"]).startswith("guard:")
    ]  # fmt: skip
    return Judged(wrong, life.deaths, instants, life.guard._parts.sequencer.state, fell_back)


def _lost(life: Life) -> list[str]:
    """Lines that were synced and are gone."""
    content = (life.folder / JOURNAL).read_bytes()
    return ["lines that were synced are gone" for synced in life.synced if not content.startswith(synced)]


def _repeated(events: list[Record]) -> list[str]:
    """Writes that were sent again although their effect had been read."""
    wrong, confirmed, done, names = [], set(), set(), dict[Any, Any]()
    for e in events:
        if e.kind == "write-intended":
            name = names[e.fields["write"]] = (e.fields["cause"], e.fields["source"])
            if e.fields["write"] in confirmed or (name in done and name[0] in ("SEQUENCE", "REQUEST")):
                wrong.append(f"write {e.fields['write']} ({name[1]}) was sent again although it was read back")
        elif e.kind == "read-back" and not e.fields["deviating"]:
            confirmed.add(e.fields["write"])
            done.add(names.get(e.fields["write"]))
        elif e.kind == "latch-reset":
            done.clear()
    return wrong


def _unnoticed(events: list[Record], end_s: float) -> list[str]:
    """Writes of which nobody says what became."""
    read = {e.fields["write"] for e in events if e.kind == "read-back"}
    intended = {e.fields["write"]: e for e in events if e.kind == "write-intended"}
    old = {n: e for n, e in intended.items() if e.at_s < end_s - FRESH_S}
    return [f"nobody says what became of write {n} ({e.fields['source']})" for n, e in old.items() if n not in read]


def _unasked(life: Life, events: list[Record]) -> list[str]:
    """What arrived on the wire without an intention in the journal."""
    intended = [_commands(e) for e in events if e.kind == "write-intended"]
    arrived = Counter(a.commands for a in life.link.wire_log)
    return [
        f"{commands} arrived {count} times without as many intentions" for commands, count in arrived.items()
        if count > sum(i[: len(commands)] == commands for i in intended)
    ]  # fmt: skip


def _unsafe(life: Life, process: TrueProcess, events: list[Record]) -> list[str]:
    """A plant that is neither inside its limits nor in a fallback that was read back."""
    kinds = [
        "begun" if _falls_back(e) else e.kind for e in events
        if _falls_back(e) or e.kind in ("fallback-stands", "latch-reset")
    ]  # fmt: skip
    sent = [e for e in events if e.kind == "write-intended" and e.fields["cause"] == "FALLBACK"][-1:]
    right = [e.fields["write"] for e in sent if not _falls_back(e)]
    last = [e for e in events if e.kind == "read-back" and e.fields["write"] in right]
    begun = [k for k, kind in enumerate(kinds) if kind == "begun"]
    if begun and "latch-reset" not in kinds[begun[-1] :]:
        wrong = [] if life.guard.latched is not None else ["a fallback has acted, and nothing is latched"]
        wrong += [] if "fallback-stands" in kinds[begun[-1] :] else ["the fallback is not confirmed"]
        return wrong + (["what was put right of it is not confirmed"] if last and last[-1].fields["deviating"] else [])
    true = {tag: float(values[0, -1]) for tag, values in process.truth().signals.items()}
    margins = {limit.name: limit.formula.margin_at(true) for limit in life.rules.limits.hard}
    return [f"{name} is violated by {-m:.3g} without a fallback" for name, m in margins.items() if not m >= 0.0]


def _falls_back(event: Record) -> bool:
    """Whether a fallback is begun: its intention says so, whatever the journal has lost after it.

    What is put right of one that stands begins none.
    """
    fields = event.fields
    return event.kind == "write-intended" and fields["cause"] == "FALLBACK" and fields["source"] != PUT_RIGHT


def _commands(event: Record) -> tuple[Command, ...]:
    found: Any = event.fields["commands"]
    return tuple(Command(c["tag"], c["value"], c["rate"]) for c in found)
