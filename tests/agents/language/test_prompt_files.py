"""Prompt files: places that are filled in once, and a hash that knows every file."""

from __future__ import annotations

import hashlib
import importlib
import shutil
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.grounding.context import GroundingKind
from homeostat.agents.language import prompt_files
from homeostat.agents.language.prompt_files import PROMPTS, STAND_INS, fill, template_sha256

AGENTS = ("planning", "action", "reprompting")


@given(st.text(st.characters(exclude_categories=["Cs"]), max_size=30))
def test_what_is_filled_in_is_not_read_again(value: str) -> None:
    for name, place in (("reprompting.prompt", "situation"), ("reprompting.prompt", "feedback")):
        values = {"situation": "s", "feedback": "f"} | {place: f"x {value} $rules ${{rules}} $$ y"}
        filled = fill(name, values)
        assert all(word in filled for word in ("$rules ${rules} $$ y", "x "))


def test_a_place_without_value_is_an_error() -> None:
    with pytest.raises(KeyError):
        fill("reprompting.prompt", {"situation": "s"})


def test_a_place_that_is_empty_leaves_no_line() -> None:
    assert "\n\n" not in fill(
        "action.prompt", dict.fromkeys(("situation", "where", "commands", "turtle", "omission", "feedback"), "")
    )


NAMES = sorted(path.name for path in Path(str(PROMPTS)).iterdir())


def copied(tmp_path: Path, name: str) -> Path:
    """The module that reads the prompt files, over a copy of them that a test may change."""
    package = tmp_path / name
    package.mkdir()
    shutil.copy(prompt_files.__file__, package / "prompt_files.py")
    shutil.copytree(str(PROMPTS), package / "prompts")
    return package


def hashes(package: Path, kind: GroundingKind = GroundingKind.GRAPH) -> dict[str, str]:
    sys.path.insert(0, str(package.parent))
    try:
        module = importlib.import_module(f"{package.name}.prompt_files")
        return {agent: module.template_sha256(agent, kind) for agent in AGENTS}
    finally:
        sys.path.remove(str(package.parent))


READ_BY = {
    "rules.md": AGENTS, "feedback.md": AGENTS, "guide.md": ("planning", "action"),
    **{f"{agent}.{part}.md": (agent,) for agent in AGENTS for part in ("system", "prompt")},
    **{f"{agent}.{part}.md": (agent,) for agent in ("planning", "action") for part in ("route", "step")},
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(READ_BY))
def test_another_prompt_has_another_hash(tmp_path: Path, name: str) -> None:
    package = tmp_path / f"copied_{hashlib.sha256(name.encode()).hexdigest()[:8]}"
    copied(tmp_path, package.name)
    with (package / "prompts" / name).open("a", encoding="utf-8") as file:
        file.write("And be quick.\n")
    changed = hashes(package)
    for agent in READ_BY[name]:
        assert changed[agent] != template_sha256(agent), f"{agent} reads {name}"


def test_the_hash_is_that_of_the_files(tmp_path: Path) -> None:
    copied(tmp_path, "copied_unchanged")
    assert hashes(tmp_path / "copied_unchanged") == {agent: template_sha256(agent) for agent in AGENTS}
    assert len({template_sha256(agent) for agent in AGENTS}) == len(AGENTS)


def test_the_hints_are_a_prompt_file_as_well(tmp_path: Path) -> None:
    copied(tmp_path, "copied_hints")
    with (tmp_path / "copied_hints" / "prompts" / "hints.toml").open("a", encoding="utf-8") as file:
        file.write('"ACC-" = "Try harder."\n')
    assert hashes(tmp_path / "copied_hints")["action"] != template_sha256("action")


STANDS_IN_FOR = {
    (kind, f"{stand_in}.md"): name for kind in GroundingKind for name, stand_in in STAND_INS[kind].items() if stand_in
}


@pytest.mark.parametrize(("kind", "name"), STANDS_IN_FOR)
def test_another_stand_in_has_another_hash_for_its_kind_alone(tmp_path: Path, kind: GroundingKind, name: str) -> None:
    package = tmp_path / f"copied_{hashlib.sha256(f'{kind} {name}'.encode()).hexdigest()[:8]}"
    copied(tmp_path, package.name)
    with (package / "prompts" / name).open("a", encoding="utf-8") as file:
        file.write("And be quick.\n")
    changed = hashes(package, kind)
    for agent in READ_BY[f"{STANDS_IN_FOR[kind, name]}.md"]:
        assert changed[agent] != template_sha256(agent, kind), f"{agent} reads {name}"
    assert hashes(package) == {agent: template_sha256(agent) for agent in AGENTS}


def test_every_file_is_read_by_somebody() -> None:
    assert set(NAMES) == {*READ_BY, "hints.toml", *(name for _, name in STANDS_IN_FOR)}
