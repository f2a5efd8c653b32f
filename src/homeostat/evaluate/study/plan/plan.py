"""The plan of a study: what its file may say, and how that is read."""

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self, TypeAlias

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    StrictInt,
    ValidationError,
    field_validator,
    model_validator,
)
from pydantic_core import ErrorDetails

from homeostat.agents.language.named_model import REPLAY, SCRIPT, SITUATED
from homeostat.evaluate.scenario import LARGEST_SEED
from homeostat.evaluate.study.error import StudyError
from homeostat.evaluate.study.plan.job import ABLATIONS, CONSTANT
from homeostat.plants.truth import NONE
from homeostat.record.row import REFERENCE_POLICIES, SEARCH, WHOLE
from homeostat.stl.spelling import near_matches

MOST_SEEDS = 10_000
"""Most seeds of one scenario."""


def _rising(span: tuple[float, float]) -> tuple[float, float]:
    if span[0] > span[1]:
        raise ValueError(f"[{span[0]:g}, {span[1]:g}] has no values; give the lower end first")
    return span


def _some(seeds: int | tuple[int, ...]) -> int | tuple[int, ...]:
    if not 1 <= (seeds if isinstance(seeds, int) else len(seeds)) <= MOST_SEEDS:
        raise ValueError(f"there must be 1 to {MOST_SEEDS} seeds")
    for seed in () if isinstance(seeds, int) else seeds:
        if not 0 <= seed <= LARGEST_SEED:
            raise ValueError(f"seed {seed} must lie in 0 to {LARGEST_SEED}")
    if not isinstance(seeds, int) and len(set(seeds)) < len(seeds):
        raise ValueError("a seed is there twice; name each once")
    return seeds


Name: TypeAlias = Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[A-Za-z0-9_.+:,@ -]+$")]
"""A name that may be part of a file's name once its spaces and signs are replaced."""
Span: TypeAlias = Annotated[tuple[float, float], AfterValidator(_rising)]
"""Two ends, between which a value is drawn."""
Seeds: TypeAlias = Annotated[StrictInt | tuple[StrictInt, ...], AfterValidator(_some)]
"""How many seeds, from 1 on, or which."""


class _Table(BaseModel):
    """A table of the file: what is not known is refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class ScenarioPlan(_Table):
    """Which faults, in which plant."""

    case: str
    """Name of the plant, or path of its folder from that of the file on; it has a ``/`` then."""
    fault: str | tuple[str, ...] = "none"
    """A fault, several joined by '+', or a list of which every seed draws one (``draw`` of them at once)."""
    draw: StrictInt = Field(1, ge=1, le=4)
    """How many of a list are drawn at once."""
    name: Name | None = None
    """Name in tables; the fault's where None."""
    severity: float | Span | Literal["any"] | None = None
    """In the fault's unit: a value, two ends to draw from, ``any`` for its whole range; the nominal one where None."""
    onset_s: float | Span | None = None
    """When it begins, or two ends to draw from [s]; the plant's default where None."""
    location: str | None = None
    """Where a single fault is, for faults that are named ``fault_location``."""
    end_s: float | None = None
    """Length of the runs [s]; the plant's default where None."""
    begins_in: str = ""
    """State of the machine that they begin in; that by design where empty."""
    setpoints: dict[str, float] = {}
    """Tag -> what an operator has set by then, in its unit; the rest is by design."""
    disturbances: tuple[str, ...] = ()
    """What happens to the true plant that no table knows, as ``homeostat run --disturb`` has it."""
    mismatch: Name | None = None
    """How the true plant is not its twin's model; as in the whole plan where None."""
    unknown: bool = False
    """Whether the agents' tables and graph lack these faults."""
    seeds: Seeds | None = None
    """As in the whole plan; the plan's where None."""
    published: str = ""
    """Row of the published tables that this stands for."""

    @field_validator("disturbances", mode="before")
    @classmethod
    def _from_text(cls, value: object) -> object:
        return [value] if isinstance(value, str) else value

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        listed = isinstance(self.fault, tuple)
        if listed and not self.fault:
            raise ValueError("the list of faults is empty; name one at least")
        if listed and ("none" in self.fault or len(set(self.fault)) < len(self.fault)):
            raise ValueError("a list of faults names each once, and not 'none'; give 'none' a scenario of its own")
        if listed and self.name is None:
            raise ValueError("a list of faults needs a name for the tables")
        if (self.disturbances or self.begins_in or self.setpoints) and self.name is None:
            raise ValueError("a scenario with disturbances or a beginning of its own needs a name for the tables")
        if self.draw > (len(self.fault) if listed else 1):
            raise ValueError(f"{self.draw} faults cannot be drawn from {len(self.fault) if listed else 1}")
        if self.unknown and self.fault == "none":
            raise ValueError("a fault-free scenario has nothing that could be unknown")
        return self

    @property
    def label(self) -> str:
        """Name in tables."""
        return self.name or (self.fault if isinstance(self.fault, str) else "")

    def departing(self, whole: str) -> str:
        """The mismatch of its true plants, where that of the ``whole`` plan is this."""
        return whole if self.mismatch is None else self.mismatch


class ProposerPlan(_Table):
    """Who proposes, and how it is asked."""

    who: str
    """``search``, ``constant``, ``do-nothing``, ``fallback-only``, ``hindsight``, or a model as in ``--proposer``."""
    name: Name | None = None
    """Name in tables; ``who`` where None."""
    protocol: Literal["route", "per-step"] = "route"
    """``per-step``: where the plant makes batches, every state is asked about."""
    label_given: bool = False
    """Whether the true faults are told."""
    then_search: bool = False
    """Whether the search follows a language model, as in operation; alone it hands over to the fallback."""
    cases: tuple[str, ...] = ()
    """Cases that it takes part in, as scenarios name them; all where empty."""
    values: dict[str, float] = {}
    """Of ``constant``: tag -> value that is always commanded; the design value where it is not named."""

    @model_validator(mode="after")
    def _has_values_for_somebody(self) -> Self:
        if self.values and self.who != CONSTANT:
            raise ValueError(f"values are what {CONSTANT!r} commands; {self.who!r} has no use for them")
        return self

    @model_validator(mode="after")
    def _is_called_what_it_is(self) -> Self:
        """A report knows by its name what was measured, and what it is measured by."""
        if self.name in (None, self.who):
            return self
        if self.who in REFERENCE_POLICIES:
            raise ValueError(f"reports know the reference policy {self.who!r} by that name; leave 'name' out")
        if self.name in (SEARCH, *REFERENCE_POLICIES):
            raise ValueError(f"reports would take {self.who!r} for {self.name!r}; choose another name")
        kinds = SCRIPT, REPLAY, SITUATED
        if self.name.startswith(kinds) and not self.who.startswith(kinds):
            raise ValueError(f"reports would take {self.name!r} for recorded or scripted; choose another name")
        return self

    @property
    def label(self) -> str:
        """Name in tables; what is recorded or scripted says so whatever it is called."""
        if self.name is None:
            return self.who
        kinds = {SCRIPT: SCRIPT, REPLAY: REPLAY, SITUATED: REPLAY}
        kind = next((shown for begin, shown in kinds.items() if self.who.startswith(begin)), "")
        return kind + self.name.removeprefix(kind)


class Plan(_Table):
    """A whole study."""

    title: str
    """One line."""
    seeds: Seeds = 1
    """How many seeds, from 1 on, or which."""
    keep: Literal["failures", "all", "none"] = "failures"
    """Which runs are kept with trace and figure."""
    thinking_declared_s: float | None = Field(1.0, ge=0.0, le=3600.0)
    """Process time of every stretch of thinking [s]; without it, it is measured, and no two runs are alike."""
    thinking_measured: bool = False
    """Whether thinking takes as long as it takes."""
    mismatch: Name = NONE
    """How the true plant is not its twin's model: a mismatch of the plant, or 'none'."""
    proposers: tuple[ProposerPlan, ...] = Field((ProposerPlan(who="search"),), min_length=1)
    """Who proposes, the one that others are compared with first."""
    ablations: tuple[str, ...] = Field((WHOLE,), min_length=1)
    """What is left out, one thing at a time."""
    scenarios: tuple[ScenarioPlan, ...] = Field(min_length=1)
    """Which plants with which faults."""

    @field_validator("proposers", mode="before")
    @classmethod
    def _from_names(cls, value: object) -> object:
        return [{"who": v} if isinstance(v, str) else v for v in value] if isinstance(value, list) else value

    @field_validator("ablations")
    @classmethod
    def _known_ablations(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        for name in value:
            if name not in ABLATIONS:
                raise ValueError(f"there is no ablation {name!r}; there are {', '.join(ABLATIONS)}")
        return value

    @property
    def _plants(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(s.case for s in self.scenarios))

    @model_validator(mode="after")
    def _is_unambiguous(self) -> Self:
        if self.thinking_measured and "thinking_declared_s" in self.model_fields_set:
            raise ValueError("thinking is declared or measured, not both")
        for what, names in (
            ("scenario", [f"{s.case} {s.label}" for s in self.scenarios]),
            ("proposer", [f"{p.label} in {plant}" for p in self.proposers for plant in p.cases or self._plants]),
            ("ablation", list(self.ablations)),
        ):
            if twice := next((n for n in names if names.count(n) > 1), None):
                raise ValueError(f"{what} {twice!r} is there twice; give one another name")
        return self


def seeds_of(seeds: int | tuple[int, ...]) -> tuple[int, ...]:
    """The seeds that are meant."""
    return tuple(range(1, seeds + 1)) if isinstance(seeds, int) else seeds


LONGEST = 80
"""Most characters of a value that a message shows."""
_TABLES: Final[Mapping[str, type[BaseModel]]] = {"scenarios": ScenarioPlan, "proposers": ProposerPlan}


def read_plan(path: Path) -> Plan:
    """The plan in ``path``; StudyError with place, value and remedy in one line."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise StudyError(f"{str(path)!r} cannot be used: {error.strerror}; give the file of a study") from None
    except (ValueError, RecursionError) as error:  # TOMLDecodeError, UnicodeDecodeError, a number of 5000 digits
        raise StudyError(f"{str(path)!r} is no TOML: {error}") from None
    try:
        return Plan.model_validate(content)
    except ValidationError as error:
        found: dict[tuple[int | str, ...], list[ErrorDetails]] = {}
        for one in error.errors(include_url=False):
            found.setdefault(_place(one["loc"], content), []).append(one)
        # Where a value may be of several types, what is wrong inside one of them says more than that it is no other.
        places = [p for p in found if not any(p == other[: len(p)] for other in found if other != p)]
        more = f"; and {len(places) - 1} more" if len(places) > 1 else ""
        raise StudyError(f"{str(path)!r}: {_words(places[0])}: {_told(found[places[0]])}{more}") from None


def _place(location: Sequence[int | str], content: Any) -> tuple[int | str, ...]:
    """Where it is in ``content``; without the types that were tried there."""
    place: list[int | str] = []
    for part in location:
        if isinstance(part, int) and isinstance(content, list) and part < len(content):
            content = content[part]
        elif isinstance(part, str) and isinstance(content, dict):
            content = content.get(part)
        else:
            continue
        place.append(part)
    return tuple(place)


def _words(place: Sequence[int | str]) -> str:
    """A place as somebody who reads the file would say it."""
    words: list[str] = []
    for part in place:
        if isinstance(part, int):
            words[-1] = f"{words[-1].removesuffix('s')} {part + 1}"
        else:
            words.append(part)
    return ", ".join(words) or "the file"


def _told(errors: Sequence[ErrorDetails]) -> str:
    """What is wrong at one place, where a value may be of several types."""
    first = errors[0]
    if first["type"] == "extra_forbidden":
        return _unknown_key(first["loc"])
    if first["type"] == "missing":
        return "missing; state it"
    given = repr(first["input"]) if isinstance(first["input"], str | int | float) else ""
    shown = f" (given: {given if len(given) <= LONGEST else given[:LONGEST] + '...'})" if given else ""
    return ", or ".join(dict.fromkeys(e["msg"].removeprefix("Value error, ") for e in errors)) + shown


def _unknown_key(location: Sequence[int | str]) -> str:
    table = _TABLES.get(str(location[0]), Plan) if len(location) > 1 else Plan
    known = table.model_fields
    return f"there is no such key{near_matches(str(location[-1]), known)}; there are {', '.join(known)}"
