"""What a run refuses: one line, exit status 2, and not a trace on the disk."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.command import homeostat, refused

REFUSED = [
    ("an unknown case", ("ctsr",), ("'ctsr'", "'cstr'")),
    ("an unknown fault", ("cstr", "--fault", "cool_stuck_close"), ("'cool_stuck_close'", "'cool_stuck_closed'")),
    ("no fault before a plus", ("cstr", "--fault", "+leak"), ("no fault ''",)),
    ("a fault twice", ("cstr", "--fault", "leak+leak"), ("twice",)),
    ("a negative severity", ("cstr", "--fault", "leak", "--severity", "-1"), ("-1", "0.0002", "0.02", "1/s")),
    ("a severity out of range", ("cstr", "--fault", "temp_bias", "--severity", "16"), ("16", "0.5", "15 K")),
    ("a severity of no fault", ("cstr", "--severity", "0.5"), ("exactly one fault",)),
    ("a severity of two faults", ("cstr", "--fault", "leak+fouling", "--severity", "0.5"), ("exactly one fault",)),
    ("an onset after the end", ("cstr", "--fault", "leak", "--onset", "6000"), ("6000 s", "earlier")),
    ("an onset before the start", ("cstr", "--fault", "leak", "--onset", "-1"), ("-1 s",)),
    ("an onset after an early end", ("cstr", "--fault", "leak", "--end", "1999"), ("2000 s", "1999 s")),
    ("an onset of no fault", ("cstr", "--onset", "100"), ("needs a fault",)),
    ("no end", ("cstr", "--end", "0"), ("0 s", "1 s")),
    ("an end too late", ("cstr", "--end", "1e12"), ("86400 s",)),
    ("a negative seed", ("cstr", "--seed", "-1"), ("seed -1",)),
    ("a seed too large", ("cstr", "--seed", str(2**64)), ("4294967295",)),
    ("an unknown proposer", ("cstr", "--proposer", "serch"), ("'serch'", "search")),
    ("an unknown option", ("cstr", "--faults", "leak"), ("--faults",)),
    ("an abbreviated option", ("cstr", "--sev", "1"), ("--sev",)),
    ("a seed that is no number", ("cstr", "--seed", "one"), ("--seed", "'one'")),
    ("two ways of thinking", ("cstr", "--thinking-scale", "1", "--thinking-declared", "1"), ("not allowed with",)),
    ("thinking backwards", ("cstr", "--thinking-scale", "-1"), ("--thinking-scale", "1000")),
    ("single steps of no batch", ("cstr", "--protocol", "per-step"), ("'starting'", "--protocol per-step", "batches")),
    ("a protocol that there is not", ("mixing_module", "--protocol", "steps"), ("'steps'", "per-step")),
    ("thinking for ever", ("cstr", "--thinking-declared", "1e9"), ("--thinking-declared", "3600")),
    *(
        (f"{option} {value}", ("cstr", "--fault", "leak", option, value), (option, f"'{value}'", "finite number"))
        for option in ("--onset", "--severity", "--end", "--thinking-scale", "--thinking-declared")
        for value in ("nan", "inf")
    ),
]


@pytest.mark.parametrize(("arguments", "words"), [plant[1:] for plant in REFUSED], ids=[plant[0] for plant in REFUSED])
def test_refused_and_nothing_written(tmp_path: Path, arguments: tuple[str, ...], words: tuple[str, ...]) -> None:
    refused(homeostat("run", *arguments, cwd=tmp_path), *words)
    assert list(tmp_path.iterdir()) == []


def test_a_directory_that_holds_something_is_never_touched(tmp_path: Path) -> None:
    kept = tmp_path / "out" / "notes.txt"
    kept.parent.mkdir()
    kept.write_text("mine")
    refused(homeostat("run", "cstr", "--end", "10", "--out", "out", cwd=tmp_path), "'out' is not empty")
    assert [path.name for path in tmp_path.rglob("*")] == ["out", "notes.txt"] and kept.read_text() == "mine"


@pytest.mark.parametrize("out", ["file", "file/below", "/proc/homeostat/run", "new/" + "x" * 300])
def test_a_directory_that_cannot_be_made(tmp_path: Path, out: str) -> None:
    (tmp_path / "file").write_text("mine")
    refused(homeostat("run", "cstr", "--end", "10", "--out", out, cwd=tmp_path), "cannot be used")
    assert [path.name for path in tmp_path.rglob("*")] == ["file"]
