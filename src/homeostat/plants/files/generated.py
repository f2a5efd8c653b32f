"""The generated files of a plant: what was altered by hand is refused, what is older than its sources is made again."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from homeostat.domain.plant.limits import LimitKind
from homeostat.knowledge.build.build import GRAPH, build, refuse_incomplete
from homeostat.knowledge.build.provenance import is_sealed, sha256, source_words, stale_tables
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.plants.error import PlantError
from homeostat.plants.files.baselines import digest_of, learned_from, read_baselines, refuse_altered
from homeostat.plants.files.folder import BASELINES, INSTALLED, PlantFiles

if TYPE_CHECKING:
    from homeostat.plants.plant import Plant

_NAMED: Final = 3
"""Most files that a message names."""


def refuse_altered_graph(files: PlantFiles) -> None:
    """GraphError where there is a graph that is not as the build wrote it."""
    if GRAPH in files.contents and not is_sealed(files.contents[GRAPH]):
        remedy = f"change the tables instead and run 'python -m homeostat.knowledge.build {files.folder}'"
        message = f"does not match its own hash: it was changed after it was built; {remedy}"
        raise GraphError(Code.ALTERED, f"{files.folder.name}/{GRAPH}", message)


def with_fresh_graph(files: PlantFiles, kept: bool) -> PlantFiles:
    """``files`` with a graph of the tables as they are now: the same object where it is that already.

    ``kept``: whether another one is written to the folder. Raises GraphError where the graph was altered, or cannot be
    made from the tables.
    """
    refuse_altered_graph(files)
    graph = files.contents.get(GRAPH)
    stale = () if graph is None else stale_tables(files.folder, graph)
    if graph is not None and not stale:
        return files
    fresh = build(files.folder)
    refuse_incomplete(fresh)
    return _with(files, GRAPH, fresh, _since(stale) if stale else "there was none", kept)


def with_baselines(plant: Plant, kept: bool) -> Plant:
    """``plant`` with its reference values; they are learned again where they follow from something older.

    ``kept``: whether others are then written to the folder. Raises PlantError where they were never learned, GraphError
    where they were altered or cannot be.
    """
    if BASELINES not in plant.files.contents:
        folder = plant.files.folder
        case = plant.name if folder.parent == INSTALLED else folder
        raise PlantError(f"plant {plant.name!r} has no reference values yet; learn them: homeostat plant learn {case}")
    content = plant.files.contents[BASELINES]
    refuse_altered(content)
    if learned_from(content) != baseline_sources(plant):
        from homeostat.plants.teaching.learning import learned  # learning loads plants, and rarely happens

        content = learned(plant)
        files = _with(plant.files, BASELINES, content, "what it follows from has changed", kept)
        plant = replace(plant, files=files, remade=(*plant.remade, BASELINES))
    return replace(plant, baselines=read_baselines(content, plant.description))


def baseline_sources(plant: Plant) -> str:
    """Digest of what the reference values of ``plant`` follow from; nothing else makes them stale.

    It is what the graph says about features, parameters, signals and the sequence with its permissives, how a run
    starts and ends, and the code of the process model.
    """
    d = plant.description
    sources = {
        "features": [[f.name, str(f.expression), str(f.accumulation), f.window_s, f.filter_s] for f in d.features],
        "parameters": [[p.symbol, p.value, p.sd] for p in d.parameters],
        "signals": [[s.tag.name, s.variable, s.tag.rate_limit] for s in d.signals],
        "states": [[s.name, [[r.tag, r.low, r.high, r.design] for r in s.setpoints]] for s in d.machine.states],
        "transitions": [
            [t.name, t.source, t.target, t.event, str(t.guard), t.on_decision] for t in d.machine.transitions
        ],
        "permissives": [[p.name, str(p.formula)] for p in d.limits.of_kind(LimitKind.PERMISSIVE)],
        "run": [str(plant.started), plant.start.tolist(), plant.end_s, plant.monitoring.settle_s],
        "code": [[name, sha256(text)] for name, text in plant.files.own_code.items() if "/" not in name],
    }
    return digest_of(sources)


def _since(stale: Sequence[str]) -> str:
    """What has changed, some of it by name."""
    names = [source_words(name) for name in stale]
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"{', '.join(names[:_NAMED])}{more} changed since it was made"


def _with(files: PlantFiles, name: str, content: bytes, why: str, kept: bool) -> PlantFiles:
    """``files`` with another ``content`` of ``name``, on disk as well if it is ``kept`` and can be; that is said."""
    if not kept:
        why += f"; it is not kept: {str(files.folder)!r} is only looked at, and the next run of the plant writes it"
    elif not _written(files.folder / name, content):
        why += f"; it is not kept, because {str(files.folder)!r} cannot be written"
    logging.getLogger(__name__).warning("made again %s: %s", f"{files.folder.name}/{name}", why)
    return PlantFiles(files.folder, dict(sorted({**files.contents, name: content}.items())))


def _written(path: Path, content: bytes) -> bool:
    from homeostat.journal.beside.files import write_whole  # a journal that is seldom needed here loads much

    try:
        write_whole(path, content)
    except OSError:
        return False
    return True
