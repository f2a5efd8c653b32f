"""A plant's tables with every row that follows from what they state."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from homeostat.domain.plant.timing import Timing
from homeostat.knowledge.build.derived.actuators import add_actuators
from homeostat.knowledge.build.derived.diagnosis import add_diagnosis
from homeostat.knowledge.build.derived.draft import Draft
from homeostat.knowledge.build.derived.expansion import expanded
from homeostat.knowledge.build.derived.guarding import add_guarding
from homeostat.knowledge.build.derived.handed_back import add_handed_back
from homeostat.knowledge.build.derived.instruments import add_instruments
from homeostat.knowledge.build.derived.loops import add_loops
from homeostat.knowledge.build.derived.parameters import fill_parameters
from homeostat.knowledge.build.derived.sequence import fill_sequence
from homeostat.knowledge.build.derived.streams import add_streams
from homeostat.knowledge.build.tables.reading import FOLDER, NEEDED, Rows, is_short, read_rows
from homeostat.knowledge.build.tables.schemas import EVERY, SCHEMAS
from homeostat.knowledge.build.timing import timing_of
from homeostat.knowledge.store.error import GraphError, refuse


def tables(folder: Path) -> dict[str, Rows]:
    """Table -> its rows, of the plant in ``folder``; what follows from them where it has a table of instruments.

    Raises GraphError where a table cannot be read.
    """
    stated, unread = stated_tables(folder)
    refuse(unread)
    return derived(stated, timing_of(folder)) if is_short(folder) else stated


def stated_tables(folder: Path) -> tuple[dict[str, Rows], list[GraphError]]:
    """Table -> the rows that stand in it, of the plant in ``folder``, and why some cannot be read."""
    short = is_short(folder)
    found: dict[str, Rows] = {}
    unread = []
    for name in EVERY if short else SCHEMAS:
        try:
            found[name] = read_rows(folder / FOLDER / f"{name}.csv", optional=short and name not in NEEDED)
        except GraphError as error:
            unread.append(error)
    return found, unread


def derived(stated: Mapping[str, Rows], timing: Timing) -> dict[str, Rows]:
    """Table -> its rows with all columns: those of ``stated``, and those that follow; see `Draft` for which counts.

    ``timing``: that of the plant. Bad cells stay as they are and nothing follows from them; what is wrong is for the
    check of the tables to say.
    """
    return _drafted(stated, timing).finished()


def idle_omissions(stated: Mapping[str, Rows], timing: Timing) -> tuple[int, ...]:
    """Numbers of the rows, from 0, of the table of omitted rows that name nothing that follows."""
    return _drafted(stated, timing).idle


def _drafted(stated: Mapping[str, Rows], timing: Timing) -> Draft:
    lacking = Rows((), ())
    every = {name: stated.get(name, lacking) for name in EVERY}
    draft = Draft(every, expanded(every), timing)
    fill_sequence(draft)
    add_instruments(draft)
    add_streams(draft)
    add_loops(draft)
    add_actuators(draft)
    add_handed_back(draft)
    fill_parameters(draft)
    add_guarding(draft)
    add_diagnosis(draft)
    return draft


def digest(folder: Path) -> str:
    """SHA-256 over every row of the plant in ``folder``, those that follow included; GraphError as `tables`."""
    rows = {name: [list(row.values()) for row in table.rows] for name, table in tables(folder).items()}
    return hashlib.sha256(json.dumps(rows, sort_keys=True).encode("ascii")).hexdigest()
