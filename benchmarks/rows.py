"""Rows of long studies, kept with the project: whoever goes on with a study, or doubts its page, begins with them.

    python -m benchmarks.rows pack unknown 'build/unknown/*.jsonl'
    python -m benchmarks.rows unpack unknown

A study keeps what it has found as lines of files whose names say for which sources they count. ``pack`` puts these
files into ``benchmarks/kept/NAME.tar.xz``, the same bytes for the same rows; ``unpack`` puts them back where the study
looks for them. A file that is there already with as many bytes or more has gone on since, and stays.
"""

from __future__ import annotations

import argparse
import io
import tarfile
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from benchmarks.host import ROOT

KEPT: Final = Path("benchmarks") / "kept"
"""Folder of the archives."""


def archive_of(name: str, root: Path = ROOT) -> Path:
    """Where the rows of the study ``name`` are kept."""
    return root / KEPT / f"{name}.tar.xz"


def pack(name: str, patterns: Iterable[str], root: Path = ROOT) -> list[Path]:
    """Keep the files below ``root`` that any of ``patterns`` names; those that were kept before go.

    FileNotFoundError where there is none: an empty archive would drop what was kept.
    """
    files = sorted({path for pattern in patterns for path in root.glob(pattern) if path.is_file()})
    if not files:
        raise FileNotFoundError(f"no file below {root} is named so: {', '.join(patterns)}")
    to = archive_of(name, root)
    to.parent.mkdir(parents=True, exist_ok=True)
    new = to.with_name(f"{to.name}.new")
    with tarfile.open(new, "w:xz") as archive:
        for path in files:
            held = path.read_bytes()
            entry = tarfile.TarInfo(path.relative_to(root).as_posix())  # no times, no owners
            entry.size = len(held)
            archive.addfile(entry, io.BytesIO(held))
    new.replace(to)
    return files


def unpack(name: str, root: Path = ROOT) -> list[Path]:
    """Put back what is kept of the study ``name``; the files that were put. FileNotFoundError where nothing is."""
    put, kept = [], archive_of(name, root)
    if not kept.exists():
        raise FileNotFoundError(f"nothing is kept of a study {name!r}: there is no {kept.relative_to(root)}")
    with tarfile.open(kept) as archive:
        for entry in archive.getmembers():
            path = root / entry.name
            held = archive.extractfile(entry)
            if held is None or (path.exists() and path.stat().st_size >= entry.size):
                continue
            if not path.resolve().is_relative_to(root.resolve()):
                raise ValueError(f"{kept} names a file outside the project: {entry.name}")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(held.read())
            put.append(path)
    return put


def main() -> int:
    """Carry out what the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rows", description=__doc__.splitlines()[0])
    parser.add_argument("step", choices=("pack", "unpack"))
    parser.add_argument("name", metavar="STUDY", help="what the archive is called")
    parser.add_argument("patterns", nargs="*", metavar="FILES", help="of pack: files below the project, as a pattern")
    asked = parser.parse_args()
    try:
        files = pack(asked.name, asked.patterns) if asked.step == "pack" else unpack(asked.name)
    except FileNotFoundError as missing:
        raise SystemExit(str(missing)) from missing
    for path in files:
        print(path.relative_to(ROOT))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
