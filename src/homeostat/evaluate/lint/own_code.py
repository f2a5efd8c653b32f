"""Where in a plant's own code something is written: the line of a text, or the one that a message names."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from typing import Final

from homeostat.evaluate.lint.finding import Place
from homeostat.plants.files.folder import SETTINGS, PlantFiles

_RAISED: Final = re.compile(r"(?P<file>[\w/]+\.py), line (?P<line>\d+): ")
_LEADS: Final = re.compile(rf"^.*?{re.escape(SETTINGS)}: (?:model '[^']*': )?(?:it cannot be made: )?", re.DOTALL)


def module_of(files: PlantFiles, model: str) -> str:
    """File of the plant's folder in which its settings say that the ``model`` is; empty where it is in none."""
    name = f"{model.partition(':')[0]}.py"
    return name if name in files.own_code else ""


def written(files: PlantFiles, texts: Iterable[str]) -> Place | None:
    """The first line of the plant's own code in which one of ``texts`` stands in quotes, in their order."""
    found: dict[str, Place] = {}
    for name, content in files.own_code.items():
        try:
            tree = ast.parse(content)
        except (SyntaxError, ValueError):  # said where it is run
            continue
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                place = Place(name, node.lineno, node.value)
                known = found.get(node.value)
                if known is None or (known.file == name and (known.row or 0) > node.lineno):
                    found[node.value] = place
    return next((found[text] for text in texts if text in found), None)


def of_model(files: PlantFiles, model: str, message: str) -> tuple[Place, str]:
    """Place and rest of a ``message`` about a ``model`` that cannot be made: the line of the code that it is about.

    The settings are the place where they name a model that there is not.
    """
    rest, module = _LEADS.sub("", message, count=1), module_of(files, model)
    rest = re.sub(r"; mend it$", "", rest) if "; " in rest.removesuffix("; mend it") else rest
    if raised := _RAISED.match(rest):
        return Place(raised["file"], int(raised["line"])), rest[raised.end() :]
    if not module or "FlowsheetError: " not in rest:
        return Place(SETTINGS, None, "model"), rest
    rest = rest.partition("FlowsheetError: ")[2]
    quoted = re.findall(r"'([\w.]+)'", rest)
    return written(files, [*quoted, *re.findall(r"[A-Za-z]\w+", rest)]) or Place(module, None, "model"), rest
