"""The process model that a plant's settings name: only what an installed plant provides is ever imported."""

import importlib
import inspect
from typing import Any, Final

from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import INSTALLED, SETTINGS, plant_names
from homeostat.process.model import ProcessModel
from homeostat.stl.spelling import near_matches

_PACKAGE: Final = "homeostat.plants"


def find_model(plant: str, model: str) -> ProcessModel:
    """The process model ``model``, as ``module:class``, that the settings of ``plant`` name.

    Raises PlantError before anything is imported where the module is not in the folder of an installed plant, and after
    it where the class is not defined there.
    """
    where = f"{plant}/{SETTINGS}: model {model!r}"
    module_name, _, class_name = model.partition(":")
    provided = [module for plant in plant_names() for module in _modules(plant)]
    if module_name not in provided:
        hint = near_matches(module_name, provided)
        raise PlantError(f"{where}: no installed plant provides the module {module_name!r}{hint}")
    module = importlib.import_module(module_name)
    classes: list[tuple[str, Any]] = inspect.getmembers(module, inspect.isclass)
    models = {name: c for name, c in classes if c.__module__ == module_name and hasattr(c, "initial_state")}
    if class_name not in models:
        hint = near_matches(class_name, models)
        raise PlantError(f"{where}: the module defines no process model {class_name!r}{hint}")
    found: ProcessModel = models[class_name]()
    return found


def _modules(plant: str) -> list[str]:
    """Names of the modules in the folder of an installed plant."""
    paths = sorted((INSTALLED / plant).glob("*.py"))
    return [f"{_PACKAGE}.{plant}.{path.stem}" for path in paths if path.stem != "__init__"]
