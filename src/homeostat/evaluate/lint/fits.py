"""Does a plant's process model fit what its tables and settings say? Its code is run for the first time here."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from pyoxigraph import NamedNode

from homeostat.domain.plant.description import PlantDescription
from homeostat.evaluate.lint.causes import first_causes, misspelt, pairs
from homeostat.evaluate.lint.designed import held_beyond, kept_by_hand, opposed_gains
from homeostat.evaluate.lint.finding import Finding, Place, Severity, split
from homeostat.evaluate.lint.looped import Looped
from homeostat.evaluate.lint.onset import before_known
from homeostat.evaluate.lint.own_code import module_of, of_model, written
from homeostat.evaluate.lint.places import Places
from homeostat.evaluate.lint.sampled import otherwise_sampled, unjudged
from homeostat.evaluate.lint.stated import of_mistake, of_setting
from homeostat.knowledge.build.build import GRAPH
from homeostat.knowledge.build.tables.reading import FOLDER
from homeostat.knowledge.checks.consistency import inconsistencies
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store.error import Code, GraphError, Mistake
from homeostat.plants.equations import units_of
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import PlantFiles, read_files
from homeostat.plants.files.generated import with_fresh_graph
from homeostat.plants.files.graph import interface, open_graph
from homeostat.plants.model import find_model
from homeostat.plants.plant import load_plant
from homeostat.plants.settings.check import refuse_misfit
from homeostat.plants.settings.defaults import completed
from homeostat.plants.settings.file import read_settings
from homeostat.process.blocks.agreement import is_standard
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.wrong_unit import Cell, WrongUnit
from homeostat.process.model import ProcessModel

PARAMETERS: Final = f"{FOLDER}/parameters.csv"
"""Where units of equations are stated."""
FAULTS: Final = f"{FOLDER}/faults.csv"
"""Where faults of equations are stated."""


@dataclass(frozen=True, slots=True)
class _Fitted:
    """A plant whose tables and settings are sound, and its model."""

    files: PlantFiles
    places: Places
    described: PlantDescription
    model: ProcessModel
    module: str
    """File of the model; empty where it is none of the folder."""

    def tag(self, variable: str) -> str:
        """The tag that a variable of the model carries; the variable where there is none."""
        return next((s.tag.name for s in self.described.signals if s.variable == variable), variable)

    @property
    def looped(self) -> Looped | None:
        """Its loops, in tables and flowsheet; None where its model has no flowsheet."""
        if not isinstance(self.model, ComposedModel):
            return None
        return Looped(self.described, self.model, self.files, self.places, self.module)


def fits(folder: Path) -> Iterator[Finding]:
    """Where model, tables and settings of the plant in ``folder`` disagree; its settings and tables are sound."""
    files, places = read_files(folder), Places(folder)
    settings = read_settings(files)
    fresh = with_fresh_graph(files, kept=False)
    described = read_plant(open_graph(fresh.contents[GRAPH]), NamedNode(settings.system))
    try:
        settings = completed(folder.name, settings, described)
        model = find_model(fresh, settings.model, described)
    except PlantError as error:
        place, said = of_model(files, settings.model, str(error))
        what, remedy = split(said, "mend it")
        yield Finding(Severity.ERROR, "model", place, what, remedy)
        return
    fitted = _Fitted(files, places, described, model, module_of(files, settings.model))
    wrong = first_causes(inconsistencies(described, interface(model, settings.twin.settings.horizon_s)))
    looped = fitted.looped
    yield from looped.findings() if looped else ()
    yield from _disagreeing(fitted, wrong)
    yield from _never_there(fitted)
    gains = [*opposed_gains(described, places)]
    yield from gains
    try:
        refuse_misfit(folder.name, settings, described, model)
        if not wrong:
            load_plant(str(folder), learned=False, kept=False)  # what is left: balances, choices of whole routes
    except PlantError as error:
        if _quoted(str(error)) not in _lacking(wrong) | (looped.following if looped else frozenset()):
            yield of_setting(str(error))
    except GraphError as error:
        yield of_mistake("consistency", error, places)
    if not wrong:
        yield from held_beyond(described, places)
        yield from kept_by_hand(described, places)
        yield from otherwise_sampled(described, model, places)
        yield from unjudged(described, places)
        yield from before_known(settings)


def _disagreeing(fitted: _Fitted, wrong: Sequence[Mistake]) -> Iterator[Finding]:
    """What of the tables does not fit each other or the model: wrong units first, as what else is read in them."""
    missing = any(each.code is Code.MISSING_PARAMETER for each in wrong)
    units = [each for each in units_of(fitted.described, fitted.model) if not (each.lacking and missing)]
    yield from (_of_unit(fitted, each) for each in units)
    blamed = {fitted.tag(each.cells[0].name) for each in units if each.cells and each.cells[0].reading}
    names = {name for tag in blamed for name in (f"{tag!r}", f"'{tag}.sp'", f"'{tag}.err'")}
    following = fitted.looped.following if fitted.looped else frozenset[str]()
    names |= {f"{name!r}" for name in following}
    symbols = (Code.MISSING_PARAMETER, Code.UNKNOWN_PARAMETER)
    errors = {f"parameter '{error}_{name}'" for name in _lacking(wrong) for error in ("bias", "sd")} | {
        f"parameter {name!r}" for name in following
    }  # of those instruments and loops
    yield from _of_symbols(fitted, [each for each in wrong if each.code in symbols and each.thing not in errors])
    for each in wrong:
        if each.code not in symbols and not any(name in each.thing for name in names):
            yield _remedied(fitted, of_mistake("consistency", GraphError(*each), fitted.places), each)


def _never_there(fitted: _Fitted) -> Iterator[Finding]:
    """Faults of equations, other than those that come with equipment, that no table has a row of."""
    if not isinstance(fitted.model, ComposedModel):
        return
    known = {fault.name for fault in fitted.described.faults}
    for name in fitted.model.flowsheet.faults:
        if name in known or is_standard(fitted.model.flowsheet, name):
            continue
        what = f"{name!r} is a fault of an equation, and {FAULTS} has no row of it: it is never there"
        place = written(fitted.files, [name]) or Place(FAULTS, None, name)
        remedy = "add its row (id, component, severity_unit, nominal, low, high), or take it out of the equation"
        yield Finding(Severity.WARNING, "consistency", place, what, remedy)


def _of_unit(fitted: _Fitted, wrong: WrongUnit) -> Finding:
    """The cell whose unit is wrong, or the rule that no cell explains."""
    code = f"the equation in {fitted.module or 'the model'}"
    if not wrong.cells:
        return Finding(
            Severity.ERROR, "units", Place(PARAMETERS), wrong.said, f"correct {code} or the unit in its table"
        )
    first, *others = wrong.cells
    what = f"unit {first.unit!r} does not fit, {first.needed!r} would: {wrong.said}"
    also = "".join(f", or {_place(fitted, cell)} in {cell.needed!r}" for cell in others)
    cells = "the row with its range and errors" if first.reading else "value and unit"
    remedy = f"state {cells} in {first.needed!r}{also}, or correct {code}"
    return Finding(Severity.ERROR, "units", _place(fitted, first), what, remedy)


def _place(fitted: _Fitted, cell: Cell) -> Place:
    """The row that states a unit."""
    if cell.reading:
        return fitted.places.row("signals", tag=fitted.tag(cell.name))
    return fitted.places.row("parameters", symbol=cell.name)


def _of_symbols(fitted: _Fitted, wrong: Sequence[Mistake]) -> Iterator[Finding]:
    """Symbols that the model needs and no table states, each with the row of the one that it may be meant to be."""
    names = {each: each.thing.removeprefix("parameter ").strip("'") for each in wrong}
    missing = [name for each, name in names.items() if each.code is Code.MISSING_PARAMETER]
    idle = [name for each, name in names.items() if each.code is Code.UNKNOWN_PARAMETER]
    taken = set[str]()
    for name, near in pairs(missing, idle):
        taken.add(near)
        row, line = fitted.places.row("parameters", symbol=near or name), written(fitted.files, [name])
        what = f"{name!r} is needed by the process model and stated in no table"
        if near and line:
            remedy = f"write {near!r} ({row}) here, or give that row the name {name!r}"
            yield Finding(Severity.ERROR, "consistency", line, f"{what}; {near!r} is, and nothing uses it", remedy)
        elif near:
            what = f"{near!r} is used by nothing in the process model, which needs {name!r}, stated in no table"
            yield Finding(Severity.ERROR, "consistency", row, what, f"give the row the name {name!r}")
        else:
            remedy = f"add its row to {PARAMETERS}{', or correct the symbol' if line else ''}"
            yield Finding(Severity.ERROR, "consistency", line or row, what, remedy)
    for each, name in names.items():
        if each.code is Code.UNKNOWN_PARAMETER and name not in taken:
            remedy = f"use it in {fitted.module or 'the model'}, or remove the row"
            place = fitted.places.row("parameters", symbol=name)
            yield Finding(Severity.ERROR, "consistency", place, each.message, remedy)


def _remedied(fitted: _Fitted, finding: Finding, mistake: Mistake) -> Finding:
    """``finding`` about the ``mistake``, with what to write in the plant's code where something is missing there."""
    code = fitted.module or "the model"
    name = _quoted(mistake.message if mistake.code is Code.UNKNOWN_VARIABLE else mistake.thing)
    if mistake.code is Code.UNKNOWN_VARIABLE:
        near, _, hint = mistake.message.partition("; did you mean ")
        meant = f" (did you mean {hint})" if hint else ""
        remedy = f'add FLOWSHEET.sensor("{name}", ...) to {code}{meant}, or remove the row'
        return replace(finding, what=near, remedy=remedy)
    if mistake.code is Code.UNKNOWN_FAULT:
        meant = misspelt(name, fitted.model.faults)
        what = f"no equation of {code} has {name!r}, so nothing happens where it is simulated"
        how = f'use its severity in an equation there, as in "k" * (1.0 - FLOWSHEET.fault("{name}"))'
        also = f", or call it {meant!r}, which the model has" if meant else ", or remove the row"
        return replace(finding, what=what, remedy=f"{how}{also}")
    return finding


def _quoted(text: str) -> str:
    """The first name that a text quotes."""
    found = re.search(r"'([^']+)'", text)
    return found[1] if found else ""


def _lacking(wrong: Sequence[Mistake]) -> frozenset[str]:
    """Variables that the tables name and the model does not have."""
    return frozenset(_quoted(each.message) for each in wrong if each.code is Code.UNKNOWN_VARIABLE)
