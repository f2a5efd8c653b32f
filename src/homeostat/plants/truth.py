"""How the true plant of a simulated run may differ from its model: the mismatches that a plant's folder states."""

import importlib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.abc import ResourceLoader
from pathlib import Path
from typing import Annotated, Final

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from homeostat.domain.disturbance import Disturbance, DisturbanceError
from homeostat.plants.error import PlantError
from homeostat.process.blocks.composed import ComposedModel
from homeostat.process.blocks.given import FlowsheetError
from homeostat.process.blocks.true import TrueFlowsheet, plain_truth
from homeostat.process.model import ProcessModel, written_in
from homeostat.process.truth import TrueModel
from homeostat.process.types import Vec
from homeostat.stl.spelling import near_matches

MISMATCHES: Final = "mismatches.toml"
NONE: Final = "none"
"""The mismatch of a true plant that is its model."""
TWICE: Final = 2.0
"""How many times their stated spread parameters deviate in the mismatch `twice` of a flowsheet [1]."""
Number = Annotated[float, Field(allow_inf_nan=False)]


class _Table(BaseModel):
    """One mismatch as the file states it."""

    model_config = ConfigDict(extra="forbid")

    description: str
    spread: Annotated[float, Field(ge=0.0, le=10.0, allow_inf_nan=False)] = 1.0
    drifts: list[str] = []
    values: dict[str, Number] = {}


@dataclass(frozen=True, slots=True)
class Mismatch:
    """One way in which the true plant is not the model that its twin has."""

    name: str
    """As a study names it."""
    description: str
    """In the engineer's words."""
    spread: float
    """How many times their stated spread its parameters deviate [1]."""
    parameters: Vec
    """Its own parameters, shape (departures.parameters,)."""
    drifts: tuple[Disturbance, ...]
    """What happens to it in every run."""


def true_model(model: ProcessModel) -> TrueModel | None:
    """What the true plant behind ``model`` has beyond it; None where nothing tells.

    It stands in the folder ``true`` beside the model's module, and follows from a flowsheet where that is not there.
    """
    written = _written(model)
    return plain_truth(model) if written is None and isinstance(model, ComposedModel) else written


def _written(model: ProcessModel) -> TrueModel | None:
    """The true plant in the folder ``true``; None where there is none."""
    own = _true_package(model)
    try:
        module = importlib.import_module(f"{own}.plant")
    except ModuleNotFoundError as missing:
        if missing.name in (own, f"{own}.plant"):  # anything else that is missing is a mistake in the true plant
            return None
        raise PlantError(f"the true plant in {own} cannot be run: {missing}; mend it") from None
    except KeyboardInterrupt:
        raise
    except BaseException as broken:  # it is anybody's code
        text = f"{type(broken).__name__}: {' '.join(str(broken).split()):.300}"
        raise PlantError(f"the true plant in {own} cannot be run: {text}; mend it") from None
    found: TrueModel | TrueFlowsheet | None = getattr(module, "TRUE", None)
    if found is None:
        raise PlantError(f"the true plant in {own} defines no TRUE; see homeostat.process.truth")
    if not isinstance(found, TrueFlowsheet):
        return found
    if not isinstance(model, ComposedModel):
        raise PlantError(f"the true plant in {own} is a flowsheet and its model is not; make both of one kind")
    try:
        return found.behind(model)
    except FlowsheetError as error:
        raise PlantError(f"the true plant in {own} cannot be run: {error}; mend it") from None


def _true_package(model: ProcessModel) -> str:
    """Name of the package that has the true plant behind ``model``."""
    return f"{written_in(model).rpartition('.')[0]}.true"


def mismatches(model: ProcessModel) -> Mapping[str, Mismatch]:
    """Those of the plant behind ``model``, by name; PlantError where its file is none, or states one that is none."""
    truth = _written(model)
    if truth is None:
        return _plain(model)
    try:
        content = tomllib.loads(_beside(f"{_true_package(model)}.plant", MISMATCHES).decode("utf-8"))
    except OSError as error:
        raise PlantError(f"{str(error.filename)!r} cannot be read: {error.strerror}; put it there") from None
    except ValueError as error:  # no TOML, or no UTF-8
        raise PlantError(f"{MISMATCHES} is no TOML file: {error}; correct it") from None
    return {name: _mismatch(truth, name, table) for name, table in content.items()}


def _plain(model: ProcessModel) -> Mapping[str, Mismatch]:
    """Those of a plant whose true one nobody wrote down: of a flowsheet, the parameters alone."""
    if not isinstance(model, ComposedModel):
        return {}
    told = f"The model's own equations, parameters at {TWICE:g} times their stated spread"
    return {"twice": Mismatch("twice", told, TWICE, np.array(plain_truth(model).departures.neutral()), ())}


def _beside(module: str, name: str) -> bytes:
    """Content of the file called ``name`` beside ``module``, as whoever loaded that has it; OSError where it is not."""
    spec = importlib.import_module(module).__spec__
    assert spec is not None and spec.origin is not None and isinstance(spec.loader, ResourceLoader)
    return spec.loader.get_data(str(Path(spec.origin).with_name(name)))


def _mismatch(truth: TrueModel, name: str, content: object) -> Mismatch:
    if name == NONE:
        raise PlantError(f"{MISMATCHES}: {name!r} is the true plant that is its model; give the mismatch another name")
    try:
        table = _Table.model_validate(content)
        drifts = tuple(Disturbance.parse(text) for text in table.drifts)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        entry = ".".join(map(str, (name, *first["loc"])))
        raise PlantError(f"{MISMATCHES}: {entry}: {first['msg']} (given: {first['input']!r:.60})") from None
    except DisturbanceError as error:
        raise PlantError(f"{MISMATCHES}: {name}.drifts: {error}") from None
    own, names = truth.departures.neutral(), truth.departures.parameters
    for parameter, value in table.values.items():
        if parameter not in names:
            raise PlantError(
                f"{MISMATCHES}: {name}: the true plant has no {parameter!r}{near_matches(parameter, names)}"
            )
        own[names.index(parameter)] = value
    return Mismatch(name, table.description, table.spread, np.array(own), drifts)


def find_mismatch(model: ProcessModel, name: str) -> Mismatch | None:
    """The one called ``name``; None for 'none'. PlantError where there is no such one, naming those there are."""
    if name == NONE:
        return None
    known = mismatches(model)
    if name not in known:
        raise PlantError(f"the plant has no mismatch {name!r}; there are: {', '.join(map(repr, (NONE, *known)))}")
    return known[name]
