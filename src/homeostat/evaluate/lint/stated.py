"""What can be checked of a plant's folder without running any of its code: settings, tables, graph."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from pyoxigraph import NamedNode

from homeostat.domain.plant.description import PlantDescription
from homeostat.evaluate.lint.finding import Finding, Place, Severity, split
from homeostat.evaluate.lint.misunit import misunit
from homeostat.evaluate.lint.places import Places, setting
from homeostat.evaluate.lint.replaced import replaced
from homeostat.knowledge.build.build import GRAPH, build
from homeostat.knowledge.build.provenance import stale_tables
from homeostat.knowledge.build.tables.check import mistakes
from homeostat.knowledge.checks.conformance import check_shapes
from homeostat.knowledge.checks.injection_scan import injection_findings
from homeostat.knowledge.checks.lint import lint
from homeostat.knowledge.description.function import flowsheet
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store.error import GraphError
from homeostat.knowledge.store.store import GraphStore
from homeostat.plants.error import PlantError
from homeostat.plants.files.baselines import read_baselines, refuse_altered
from homeostat.plants.files.folder import BASELINES, PlantFiles
from homeostat.plants.files.generated import refuse_altered_graph, with_fresh_graph
from homeostat.plants.files.graph import open_graph
from homeostat.plants.page.flowsheet import corrections
from homeostat.plants.settings.check import refuse_misnamed
from homeostat.plants.settings.defaults import completed
from homeostat.plants.settings.figure_panel import read_panel
from homeostat.plants.settings.file import read_settings, settings_mistakes
from homeostat.plants.settings.settings import Settings

CORRECT = "correct the row, or what it names"
"""What to do where a message has no remedy of its own."""


@dataclass(frozen=True, slots=True)
class Stated:
    """What the files of a plant say, as far as they can be read."""

    findings: tuple[Finding, ...]
    """What is wrong with them."""

    @property
    def sound(self) -> bool:
        """Whether the plant's code may be run: nothing that counts was found."""
        return not any(finding.counts for finding in self.findings)


def stated(files: PlantFiles) -> Stated:
    """Look at settings, tables and graph of a plant; nothing is written and none of its code is run."""
    return Stated(tuple(_findings(files, Places(files.folder))))


def _findings(files: PlantFiles, places: Places) -> Iterator[Finding]:
    wrong = [*_settings(files), *_tables(files, places), *_generated(files)]
    yield from wrong
    if any(finding.counts for finding in wrong):
        return  # what follows would blame what was made of them
    yield from replaced(files.folder, places)
    settings = read_settings(files)
    try:
        store = open_graph(with_fresh_graph(files, kept=False).contents[GRAPH])
    except GraphError as error:
        yield of_mistake("graph", error, places)
        return
    yield from _other_than_built(files)
    yield from _graph(store, places)
    try:
        described = read_plant(store, NamedNode(settings.system))
    except GraphError as error:
        yield of_mistake("graph", error, places)
        return
    yield from _named(files, settings, described)
    try:
        corrections(files.folder.name, flowsheet(store, NamedNode(settings.system)), settings.drawing)
    except PlantError as error:
        yield of_setting(str(error))


def of_mistake(check: str, error: GraphError, places: Places, severity: Severity = Severity.ERROR) -> Finding:
    """The finding that a mistake of tables or graph is."""
    if half := _half(error.thing, error.message, places):
        return Finding(severity, check, *half)
    what, remedy = split(error.message, CORRECT)
    if rows := misunit(places, error.message):
        what, remedy = f"{what}; they would agree if {rows}", f"correct value and unit there, or {remedy}"
    return Finding(severity, check, places.about(error.thing, error.message), what, remedy)


def of_setting(message: str) -> Finding:
    """The finding that a mistake of the settings is."""
    place, said = setting(message)
    what, remedy = split(said, "correct it")
    return Finding(Severity.ERROR, "settings", place, what, remedy)


def _settings(files: PlantFiles) -> Iterator[Finding]:
    yield from map(of_setting, settings_mistakes(files))


def _tables(files: PlantFiles, places: Places) -> Iterator[Finding]:
    yield from (of_mistake("tables", error, places) for error in mistakes(files.folder))


def _generated(files: PlantFiles) -> Iterator[Finding]:
    """Generated files that were altered by hand, or are older than the tables."""
    try:
        name = GRAPH
        refuse_altered_graph(files)
        name = BASELINES
        if BASELINES in files.contents:
            refuse_altered(files.contents[BASELINES])
    except GraphError as error:
        what, remedy = split(error.message, "make it again")
        yield Finding(Severity.ERROR, "generated", Place(name), what, remedy)
        return
    if GRAPH in files.contents and stale_tables(files.folder, files.contents[GRAPH]):
        what, remedy = (
            "is older than the tables; it is made again when the plant is loaded",
            "nothing: the next run of the plant writes it",
        )
        yield Finding(Severity.NOTE, "generated", Place(GRAPH), what, remedy)


def _other_than_built(files: PlantFiles) -> Iterator[Finding]:
    """A graph that is not what its tables make, although it says that they have not changed."""
    graph = files.contents.get(GRAPH)
    if graph is None or stale_tables(files.folder, graph) or build(files.folder) == graph:
        return
    what = "is not what its tables make: another version built it, or it was altered and given a new hash"
    remedy = f"run 'python -m homeostat.knowledge.build {files.folder}'"
    yield Finding(Severity.ERROR, "generated", Place(GRAPH), what, remedy)


def _graph(store: GraphStore, places: Places) -> Iterator[Finding]:
    for mistake in lint(store):
        what, remedy = split(mistake.message, CORRECT)
        yield Finding(Severity.ERROR, "graph", places.thing(mistake.thing), what, remedy)
    for broken in check_shapes(store):
        half = _half(broken.focus, broken.message, places)
        place, what, remedy = half or (places.thing(broken.focus), str(broken), CORRECT)
        yield Finding(Severity.ERROR, "graph", place, what, remedy)
    for finding in injection_findings(store):
        what = f"reads as if it were written for a language model: {finding}"
        yield Finding(Severity.NOTE, "texts", Place(GRAPH), what, "say it plainly")


def _half(thing: str, message: str, places: Places) -> tuple[Place, str, str] | None:
    """Place, mistake and remedy of a part that streams only leave, or only enter; None of anything else."""
    part = places.cell("operators", "resource", id=thing.removeprefix("operator_"))
    for needs, there, lacks in (("input", "source", "target"), ("output", "target", "source")):
        place = places.row("streams", **{there: part})
        if part and place.row is not None and f"needs an {needs}" in message:
            stream = places.cell("streams", "stream", **{there: part})
            goes, comes = ("leaves", "enters") if needs == "input" else ("enters", "leaves")
            other = "source" if lacks == "target" else "target"
            what = f"stream {stream!r} {goes} {part!r}, and none {comes} it: what it does has no {needs}"
            remedy = f"add a row with {part!r} as {lacks}, and an empty {other} where that is outside the plant"
            return place, what, remedy
    return None


def _named(files: PlantFiles, settings: Settings, described: PlantDescription) -> Iterator[Finding]:
    """Where settings and reference values name what the plant does not have."""
    try:
        settings = completed(files.folder.name, settings, described)
        refuse_misnamed(files.folder.name, settings, described)
    except PlantError as error:
        yield of_setting(str(error))
    for number, table in enumerate(settings.figure or [], start=1):
        try:
            read_panel(table.model_dump(exclude_none=True), described)
        except PlantError as error:
            what, remedy = split(str(error), "correct it")
            yield Finding(
                Severity.ERROR, "settings", Place("case.toml", None, f"figure, number {number}"), what, remedy
            )
    if BASELINES in files.contents:
        try:
            read_baselines(files.contents[BASELINES], described)
        except GraphError as error:
            what, remedy = split(error.message, "learn them again: homeostat plant learn")
            note = "they are learned again when the plant is loaded"
            yield Finding(Severity.NOTE, "generated", Place(BASELINES), f"{what}; {note}", remedy)
