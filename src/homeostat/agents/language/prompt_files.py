"""Prompts as files: read, filled in, and known by their hash."""

import functools
import hashlib
from collections.abc import Mapping
from importlib import resources
from string import Template
from typing import Final

from homeostat.agents.grounding.context import GroundingKind

PROMPTS = resources.files(__package__).joinpath("prompts")
"""Folder of the prompt files."""
STAND_INS: Final[Mapping[GroundingKind, Mapping[str, str]]] = {
    GroundingKind.GRAPH: {},
    GroundingKind.DOCUMENTS: {"rules": "rules.plain", "guide": "guide.documents", "action.step": "step.documents"},
    GroundingKind.NONE: {
        "rules": "rules.plain",
        "guide": "",
        "action.step": "step.none",
        "planning.prompt": "bare.planning",
        "action.prompt": "bare.action",
    },
}
"""Prompt file -> the one that stands in for it where a model is grounded otherwise than in Turtle; empty for none."""


@functools.cache
def prompt_file(name: str, kind: GroundingKind = GroundingKind.GRAPH) -> str:
    """Text of ``prompts/<name>.md``, or of what stands in for it where a model is grounded by ``kind``."""
    actual = STAND_INS[kind].get(name, name)
    return PROMPTS.joinpath(f"{actual}.md").read_text("utf-8") if actual else ""


def fill(name: str, values: Mapping[str, str], kind: GroundingKind = GroundingKind.GRAPH) -> str:
    """:func:`prompt_file` with every ``$place`` filled in, empty lines left out.

    What is filled in is not read again, so a value cannot open a place. Raises KeyError for a place without value.
    """
    text = Template(prompt_file(name, kind)).substitute(values)
    return "\n".join(line for line in text.splitlines() if line.strip())


@functools.cache
def template_sha256(agent: str, kind: GroundingKind = GroundingKind.GRAPH) -> str:
    """Hash over every file that the prompts of ``agent`` are made from where a model is grounded by ``kind``."""
    own = sorted(file.name for file in PROMPTS.iterdir() if file.name.startswith(f"{agent}."))
    hints = PROMPTS.joinpath("hints.toml").read_text("utf-8")
    shared = (*(prompt_file(name, kind) for name in ("rules", "guide", "feedback")), hints)
    texts = (*shared, *(prompt_file(name.removesuffix(".md"), kind) for name in own))
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()
