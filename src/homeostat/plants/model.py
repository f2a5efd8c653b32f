"""The process model that a plant's settings name: of its own folder, or one that this package ships.

It is a class, or a flowsheet that a model is put together from.
"""

import importlib
import inspect
from collections.abc import Callable
from functools import partial
from types import ModuleType
from typing import Final, cast

from homeostat.domain.plant.description import PlantDescription
from homeostat.plants.error import PlantError
from homeostat.plants.files.code import import_own, modules, told
from homeostat.plants.files.folder import INSTALLED, SETTINGS, PlantFiles
from homeostat.plants.files.places import shipped_names
from homeostat.process.batch import tick_of
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.flowsheet import Flowsheet
from homeostat.process.model import ProcessModel
from homeostat.stl.spelling import near_matches

_PACKAGE: Final = "homeostat.plants"


def find_model(files: PlantFiles, model: str, plant: PlantDescription) -> ProcessModel:
    """The process model ``model`` that the settings of a plant name, as ``module:class`` or ``module:flowsheet``.

    The module is one in the plant's folder, or that of a shipped plant by its whole name. A flowsheet has the faults
    that ``plant``'s tables have.

    Raises PlantError before anything is imported where there is no such module, and after it where neither is defined
    there, or the plant's own code cannot be run.
    """
    where = f"{files.folder.name}/{SETTINGS}: model {model!r}"
    module_name, _, name = model.partition(":")
    makers = _makers(_module(files, module_name, where), plant)
    if name not in makers:
        raise PlantError(f"{where}: the module defines no process model {name!r}{near_matches(name, makers)}")
    try:
        found = makers[name]()
    except KeyboardInterrupt:
        raise
    except BaseException as broken:  # it is anybody's code
        raise PlantError(f"{where}: it cannot be made: {told(files, broken)}; mend it") from None
    _refuse_partial(found, where)
    if tick_of(found.kernel) != (tick_s := plant.timing.tick_s):
        goes = f"its kernel goes on by {tick_of(found.kernel):g} s at a time"
        raise PlantError(f"{where}: {goes}, and [time] tick_s is {tick_s:g} s; state the same in both")
    return found


def _makers(module: ModuleType, plant: PlantDescription) -> dict[str, Callable[[], ProcessModel]]:
    """What makes each model that ``module`` defines: its classes, and what follows from its flowsheets."""
    made: dict[str, Callable[[], ProcessModel]] = {}
    for name, each in vars(module).items():
        if inspect.isclass(each) and each.__module__ == module.__name__ and hasattr(each, "initial_state"):
            made[name] = cast(type[ProcessModel], each)
        elif isinstance(each, Flowsheet):
            stated, faults = {p.symbol: p.value for p in plant.parameters}, {f.name for f in plant.faults}
            made[name] = partial(ComposedModel, each, stated, faults, plant.timing.tick_s, module.__name__)
    return made


def _refuse_partial(model: ProcessModel, where: str) -> None:
    """PlantError where ``model`` lacks something of a process model, or names something that is no tuple of names."""
    members = (*ProcessModel.__annotations__, *vars(ProcessModel))
    lacking = [name for name in members if not name.startswith("_") and not hasattr(model, name)]
    if lacking:
        raise PlantError(f"{where}: a process model has {', '.join(lacking)}, too; see homeostat.process.model")
    for name in ("states", "parameters", "inputs", "faults", "variables"):
        names = getattr(model, name)
        if not (isinstance(names, tuple) and all(isinstance(each, str) for each in names)):
            raise PlantError(f"{where}: its {name} are {names!r:.100}; give a tuple of names")


def _module(files: PlantFiles, name: str, where: str) -> ModuleType:
    if name in modules(files) and files.folder.parent != INSTALLED:
        return import_own(files, name)
    shipped = [each for plant in shipped_names() for each in _modules(plant)]
    if name not in shipped:
        hint = near_matches(name, [*modules(files), *shipped])
        raise PlantError(f"{where}: neither the folder nor a shipped plant provides the module {name!r}{hint}")
    return importlib.import_module(name)


def _modules(plant: str) -> list[str]:
    """Names of the modules in the folder of a shipped plant."""
    paths = sorted((INSTALLED / plant).glob("*.py"))
    return [f"{_PACKAGE}.{plant}.{path.stem}" for path in paths if path.stem != "__init__"]
