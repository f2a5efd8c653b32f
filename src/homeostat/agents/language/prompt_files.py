"""Prompts as files: read, filled in, and known by their hash."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Mapping
from importlib import resources
from string import Template

PROMPTS = resources.files(__package__).joinpath("prompts")
"""Folder of the prompt files."""


@functools.cache
def prompt_file(name: str) -> str:
    """Text of ``prompts/<name>.md``."""
    return PROMPTS.joinpath(f"{name}.md").read_text("utf-8")


def fill(name: str, values: Mapping[str, str]) -> str:
    """``prompts/<name>.md`` with every ``$place`` filled in, empty lines left out.

    What is filled in is not read again, so a value cannot open a place. Raises KeyError for a place without value.
    """
    text = Template(prompt_file(name)).substitute(values)
    return "\n".join(line for line in text.splitlines() if line.strip())


@functools.cache
def template_sha256(agent: str) -> str:
    """Hash over every file that the prompts of ``agent`` are made from."""
    shared = ("rules.md", "guide.md", "feedback.md", "hints.toml")
    own = sorted(file.name for file in PROMPTS.iterdir() if file.name.startswith(f"{agent}."))
    texts = (PROMPTS.joinpath(name).read_text("utf-8") for name in (*shared, *own))
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()
