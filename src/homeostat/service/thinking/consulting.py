"""From what was chosen to who proposes: the model is made, the playbook read; what cannot be had is said."""

from __future__ import annotations

import contextlib
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from homeostat.agents.grounding.context import GroundingKind
from homeostat.agents.language.named_model import NamedModel, NoSuchModel
from homeostat.agents.playbook.book import Book
from homeostat.agents.roles import AskingProtocol
from homeostat.domain.alarm import Priority
from homeostat.domain.observation import Trouble
from homeostat.domain.quotation import printable
from homeostat.journal.beside.files import write_whole
from homeostat.plants.described import read_described
from homeostat.plants.error import PlantError
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import Language, check_protocol
from homeostat.plants.wired.playbook import open_playbook
from homeostat.record.playbook import Content, PlaybookError
from homeostat.service.thinking.consulted import Consulted

MODEL: Final = "recovery:model"
"""Alarm of thinking that should ask a model, and cannot even begin to."""
PLAYBOOK: Final = "recovery:playbook"
"""Alarm of a playbook that cannot be read, or takes no entry."""
KEPT: Final = "playbooks"
"""Folder of the journal in which every playbook is kept that thinking began with, each under its digest."""
REFUSED: Final = 2
"""Exit status of a check that says in one line why nobody could think so."""


def language_of(consulted: Consulted) -> Language | None:
    """The model that is named, ready to be asked; None for the search alone.

    Raises NoSuchModel where there is none, OSError where its answers, or what is recorded of it, cannot be kept.
    """
    if not consulted.asks_a_model:
        return None
    c = consulted
    model = NamedModel(c.proposer, c.local_only, c.allow_hosts, c.temperature, c.model_seed).make()
    record = None if c.record is None else Path(c.record)
    if record is not None:
        record.open("a").close()  # after the model: where there is none, no file is left behind
    return Language(model, c.notes, record, GroundingKind(c.grounding), c.answer_s, c.attempts)


@dataclass(frozen=True, slots=True)
class Prepared:
    """What thinking begins with."""

    language: Language | None
    """The model; None for none."""
    book: Book | None
    """What helped before; None where nobody is to know."""
    content: Content | None
    """What the playbook's file held; None where there is none, or it cannot be read."""
    troubles: tuple[Trouble, ...]
    """What cannot be had although it was chosen: the search thinks without."""


def prepared(consulted: Consulted, plant: Plant, directory: Path) -> Prepared:
    """Everything that can be had of what was ``consulted``; the playbook's bytes are kept in ``directory``.

    Nothing here keeps thinking from beginning: a search alone is better than nobody.
    """
    troubles, language, book, content = list[Trouble](), None, None, None
    try:
        language = language_of(consulted)
    except (NoSuchModel, OSError) as error:
        cause = f"{printable(_line(error))}; the search proposes alone: mend that, and attach again"
        troubles.append(Trouble(MODEL, cause, Priority.LOW))
    if consulted.playbook is not None:
        try:
            book, content = open_playbook(Path(consulted.playbook), plant)
        except (PlaybookError, OSError) as error:
            cause = f"{printable(_line(error))}; nothing is known from before: mend that, and attach again"
            troubles.append(Trouble(PLAYBOOK, cause, Priority.LOW))
    if content is not None and content.raw:
        with contextlib.suppress(OSError):  # a full disk is the guard's alarm
            (directory / KEPT).mkdir(exist_ok=True)
            write_whole(directory / KEPT / f"{content.sha256}.jsonl", content.raw)
    return Prepared(language, book, content, tuple(troubles))


def check(plant: str, consulted: Consulted) -> int:
    """Whether thinking can begin as was chosen; the exit status, :data:`REFUSED` where it cannot.

    The digest of the playbook goes to standard output, one line on what is wrong to standard error.
    """
    try:
        language_of(consulted)
        described = read_described(plant)
        check_protocol(described, AskingProtocol(consulted.protocol))
        if consulted.playbook is not None:
            print(open_playbook(Path(consulted.playbook), described)[1].sha256)
    except (NoSuchModel, OSError, PlantError, PlaybookError) as error:
        print(printable(_line(error)), file=sys.stderr)
        return REFUSED
    return 0


def _line(error: Exception) -> str:
    """What is wrong, in one line."""
    if isinstance(error, OSError) and error.filename is not None:
        return f"{str(error.filename)!r} cannot be used: {error.strerror}"
    return " ".join(str(error).split())
