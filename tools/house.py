"""The size and shape of the package, before and after: `python tools/house.py COMMIT` prints a Markdown table.

Counted in ``src/**/*.py``. A public name is a class, function or constant at the top of a module without an underscore.
A constructor's parameters are those of a hand-written ``__init__``; a record has as many fields as there are data.
"""

from __future__ import annotations

import ast
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LONG_FUNCTION, MANY_PARAMETERS = 60, 6
LISTED = ("Belief", "Diagnosis", "Monitoring", "Plant", "Row", "State")
"""Names that the review found to stand for several ideas."""


@dataclass(frozen=True)
class House:
    """What was counted in one tree."""

    files: int
    lines: int
    public: int
    front_door: int
    median: float
    longest: int
    rooms: int
    long_functions: tuple[str, ...]
    big_constructors: tuple[str, ...]
    ambiguous: tuple[str, ...]
    """Listed names that are classes in several modules."""
    skips: int
    """Lines on which the formatter is told to look away."""


def measure(source: Path) -> House:
    """Count what is in ``source``, the package's folder."""
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(source.rglob("*.py"))}
    trees = {path: ast.parse(text) for path, text in texts.items()}
    lines = [text.count("\n") for text in texts.values()]
    rooms = max(len(list(rooms_of(folder))) for folder in [source, *source.rglob("*")] if folder.is_dir())
    return House(
        files=len(texts),
        lines=sum(lines),
        public=sum(len(list(public_names(tree))) for tree in trees.values()),
        front_door=front_door(trees[source / "__init__.py"]),
        median=statistics.median(lines),
        longest=max(lines),
        rooms=rooms,
        long_functions=tuple(f"{path.stem}.{name}" for path, tree in trees.items() for name in long_functions(tree)),
        big_constructors=tuple(f"{path.stem}.{name}" for path, tree in trees.items() for name in constructors(tree)),
        ambiguous=tuple(name for name in LISTED if sum(name in public_names(tree) for tree in trees.values()) > 1),
        skips=sum(text.count("# fmt: skip") for text in texts.values()),
    )


def rooms_of(folder: Path) -> Iterator[Path]:
    """The modules and packages in ``folder``."""
    for path in folder.iterdir():
        if (path.suffix == ".py" and path.stem != "__init__") or (path / "__init__.py").exists():
            yield path


def public_names(tree: ast.Module) -> Iterator[str]:
    """Names that a module declares for others."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            names = [node.name]
        elif isinstance(node, ast.Assign):
            names = [n.id for target in node.targets for n in ast.walk(target) if isinstance(n, ast.Name)]
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names = [node.target.id]
        else:
            names = []
        yield from (name for name in names if not name.startswith("_"))


def front_door(tree: ast.Module) -> int:
    """Number of names in ``__all__``."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and any(isinstance(t, ast.Name) and t.id == "__all__" for t in node.targets):
            return len(ast.literal_eval(node.value))
    return 0


def long_functions(tree: ast.Module) -> Iterator[str]:
    """Functions of more than :data:`LONG_FUNCTION` lines."""
    for node in ast.walk(tree):
        lines = (getattr(node, "end_lineno", None) or 0) - getattr(node, "lineno", 0) + 1
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and lines > LONG_FUNCTION:
            yield node.name


def constructors(tree: ast.Module) -> Iterator[str]:
    """Classes whose hand-written constructor takes more than :data:`MANY_PARAMETERS`, beside ``self``."""
    for node in (n for n in ast.walk(tree) if isinstance(n, ast.ClassDef)):
        for made in (m for m in node.body if isinstance(m, ast.FunctionDef) and m.name == "__init__"):
            if len(made.args.args) + len(made.args.kwonlyargs) - 1 > MANY_PARAMETERS:
                yield node.name


def table(before: House, after: House) -> str:
    """The two side by side, with the bar where there is one."""
    shrunk = f"{after.lines} ({100 * (after.lines / before.lines - 1):+.1f} %)"

    def named(names: tuple[str, ...]) -> str:
        return f"{len(names)}{': ' if names else ''}{', '.join(names)}"

    rows = [
        ("Files", before.files, after.files, ""),
        ("Lines", before.lines, shrunk, "-12 %"),
        ("Public names at the top of modules", before.public, after.public, ""),
        ("Names of the front door", before.front_door, after.front_door, "at most 15"),
        ("Median file [lines]", f"{before.median:g}", f"{after.median:g}", "at most 120"),
        ("Longest file [lines]", before.longest, after.longest, "at most 350"),
        ("Most rooms in a folder", before.rooms, after.rooms, "about a dozen"),
        (f"Functions over {LONG_FUNCTION} lines", named(before.long_functions), named(after.long_functions), "0"),
        (f"Constructors over {MANY_PARAMETERS} parameters", named(before.big_constructors),
         named(after.big_constructors), "at most 5"),
        (f"Names with several meanings, of {', '.join(LISTED)}", named(before.ambiguous), named(after.ambiguous), "0"),
        ("`# fmt: skip`", before.skips, after.skips, "at most 10"),
    ]  # fmt: skip
    lines = [f"| {what} | {old} | {new} | {bar} |" for what, old, new, bar in rows]
    return "\n".join(["| | Before | After | Bar |", "|---|---|---|---|", *lines])


def main() -> None:
    """Compare the working tree with a commit."""
    commit = sys.argv[1]
    with tempfile.TemporaryDirectory() as scratch:
        archive = subprocess.run(["git", "archive", commit, "src"], cwd=ROOT, capture_output=True, check=True).stdout
        subprocess.run(["tar", "-x", "-C", scratch], input=archive, check=True)
        before = measure(Path(scratch) / "src" / "homeostat")
    print(table(before, measure(ROOT / "src" / "homeostat")))


if __name__ == "__main__":
    main()
