"""A page of results that is older than what it measures says so, or the check fails."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tools.check_pages import BANNER, check

pytestmark = pytest.mark.quick

TABLE = """
everything = ["src"]
[pages."page.md"]
command = "python -m made"
measures = ["everything", "bench.py"]
"""
PAGE = """# A page

{banner}
Made by `python -m made`. Measured for the sources of `{commit}` with Python 3. Yardstick
of the host: 0.2 s.
"""


def git(root: Path, *arguments: str) -> str:
    command = ["git", "-C", str(root), "-c", "user.name=A", "-c", "user.email=a@b", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def put(root: Path, name: str, text: str) -> str:
    """Commit a file; the commit."""
    (root / name).parent.mkdir(parents=True, exist_ok=True)
    (root / name).write_text(text)
    git(root, "add", ".")
    git(root, "commit", "--quiet", "--message", name)
    return git(root, "log", "-1", "--format=%h")


@pytest.fixture
def project(tmp_path: Path) -> Path:
    git(tmp_path, "init", "--quiet")
    put(tmp_path, "benchmarks/pages.toml", TABLE)
    put(tmp_path, "bench.py", "")
    commit = put(tmp_path, "src/one.py", "1")
    put(tmp_path, "docs/results/page.md", PAGE.format(banner="", commit=commit))
    return tmp_path


def rewritten(project: Path, old: str, new: str) -> None:
    page = project / "docs/results/page.md"
    text = page.read_text()
    assert old in text
    page.write_text(text.replace(old, new, 1))


def test_a_page_of_the_present_sources_is_in_order(project: Path) -> None:
    put(project, "README.md", "another thing")
    assert check(project) == ([], [])


@pytest.mark.parametrize("changed", ["src/two.py", "bench.py"])
def test_a_page_that_is_older_says_so_or_is_named(project: Path, changed: str) -> None:
    commit = put(project, changed, "2")
    wrong, unknown = check(project)
    assert len(wrong) == 1 and f"changed in 1 commits since, {commit} last" in wrong[0] and unknown == []
    rewritten(project, "# A page\n", f"# A page\n\n{BANNER} Measured before.\n")
    assert check(project) == ([], [])


def test_sources_that_are_again_what_was_measured_are_not_newer(project: Path) -> None:
    before = (project / "src/one.py").read_text("utf-8")
    put(project, "src/one.py", "2")
    put(project, "src/one.py", before)
    assert check(project) == ([], [])


def test_a_banner_over_a_page_that_is_not_older_goes(project: Path) -> None:
    rewritten(project, "# A page\n", f"# A page\n\n{BANNER} Measured before.\n")
    assert "nothing that it measures changed" in check(project)[0][0]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("python -m made", "make", "does not name its command"),
        ("sources of", "sources", "does not name the commit"),
        ("Yardstick", "Measure", "no yardstick"),
    ],
)
def test_what_a_page_must_name(project: Path, old: str, new: str, words: str) -> None:
    rewritten(project, old, new)
    assert len(check(project)[0]) == 1 and words in check(project)[0][0]


def test_a_commit_that_git_does_not_have_cannot_be_compared(project: Path) -> None:
    commit = git(project, "log", "-1", "--format=%h", "--", "src")
    rewritten(project, commit, "0123abc")
    wrong, unknown = check(project)
    assert wrong == [] and len(unknown) == 1 and "cannot tell" in unknown[0]


def test_every_page_stands_in_the_table_and_the_table_names_what_there_is(project: Path) -> None:
    put(project, "docs/results/other.md", "")
    (project / "bench.py").unlink()
    assert sorted(check(project)[0]) == [
        "bench.py, which benchmarks/pages.toml names for page.md, is not there",
        "benchmarks/pages.toml does not say what docs/results/other.md measures",
    ]
