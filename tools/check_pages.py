"""Say which pages of docs/results are older than what they measure without saying so.

A page names the command that makes it, the commit of the sources that were measured, and a yardstick of the host.
benchmarks/pages.toml says which sources those are. Where they have changed since, the page must begin with the banner;
then it need not have been measured with a yardstick. Where git does not know the commit (a shallow clone), nobody can
tell, and that is said.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

TABLE, PAGES = Path("benchmarks/pages.toml"), Path("docs/results")
BANNER = "> **Older than the code.**"
COMMIT = re.compile(r"(?:for\s+the\s+sources\s+of|at\s+commit)\s+`([0-9a-f]{7,40})\+?`")
YARDSTICK = re.compile(r"Yardstick\s+of\s+the\s+host|yardstick \[s\]")


def check(root: Path) -> tuple[list[str], list[str]]:
    """What is wrong with the pages below ``root``, and what cannot be told; one line each."""
    table = tomllib.loads((root / TABLE).read_text("utf-8"))
    everything, pages = table["everything"], table["pages"]
    there = {page.name for page in (root / PAGES).glob("*.md")}
    wrong = [f"{PAGES / name} is missing, but {TABLE} says what it measures" for name in sorted(pages.keys() - there)]
    wrong += [f"{TABLE} does not say what {PAGES / name} measures" for name in sorted(there - pages.keys())]
    unknown = []
    for name in sorted(there & pages.keys()):
        paths = [
            path for entry in pages[name]["measures"] for path in (everything if entry == "everything" else [entry])
        ]
        wrong += [
            f"{path}, which {TABLE} names for {name}, is not there" for path in paths if not (root / path).exists()
        ]
        found = _page(root, name, pages[name]["command"], paths)
        (unknown if found.endswith("cannot tell") else wrong).extend([found] if found else [])
    return wrong, unknown


def _page(root: Path, name: str, command: str, paths: list[str]) -> str:
    """What is wrong with one page; empty where nothing is."""
    text, page = (root / PAGES / name).read_text("utf-8"), PAGES / name
    named = COMMIT.search(text)
    if f"`{command}`" not in text:
        return f"{page} does not name its command, `{command}`"
    if named is None:
        return f"{page} does not name the commit that was measured"
    older = BANNER in text
    if not older and not YARDSTICK.search(text):
        return f"{page} has no yardstick of its host"
    commit = named[1]
    if _git(root, "cat-file", "-e", f"{commit}^{{commit}}").returncode:
        return f"{page}: git does not know commit {commit} here (a shallow clone?), so whether it is older: cannot tell"
    since = _git(root, "log", "--format=%h", f"{commit}..HEAD", "--", *paths).stdout.split()
    if _git(root, "diff", "--quiet", commit, "HEAD", "--", *paths).returncode == 0:
        since = []  # a merge brought the same sources from another side, or a change was taken back
    if since and not older:
        return (
            f"{page} was measured at {commit}; what it measures changed in {len(since)} commits since, {since[0]} last"
        )
    if older and not since:
        return f"{page} says that it is older than the code, and nothing that it measures changed since {commit}"
    return ""


def _git(root: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["git", "-C", str(root), *arguments], capture_output=True, text=True, check=False)


def main() -> int:
    """Print what is wrong; 1 if anything is."""
    wrong, unknown = check(Path(__file__).parents[1])
    for line in unknown:
        print(f"check_pages: {line}")
    for line in wrong:
        print(f"check_pages: {line}", file=sys.stderr)
    if wrong:
        print(f"Make the page again with its command, or begin it with a line '{BANNER} ...'.", file=sys.stderr)
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
