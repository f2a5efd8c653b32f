"""What ``case.toml`` may say: every key with its type and bounds. What a key means stands at the type that it fills."""

from __future__ import annotations

from dataclasses import fields
from typing import Annotated, Any, Final, Literal, TypeAlias, TypeVar

from annotated_types import Len
from pydantic import BaseModel, ConfigDict, StringConstraints, ValidationInfo, model_validator

from homeostat.agents.monitoring.settings import MonitoringSettings
from homeostat.domain.plant.production import Production
from homeostat.domain.plant.timing import TICK_S, Timing
from homeostat.guard.settings import LEASE_WITHIN_S, LONGEST_LEASE_S
from homeostat.plants.settings.bounds import (
    HISTORY,
    WEEK_S,
    Deviation,
    Draws,
    Finite,
    Fraction,
    Horizon,
    Pause,
    Rows,
    SomeTime,
    Stretch,
    Stride,
    ticks,
    timing_of,
    within,
)
from homeostat.record.row import RESERVED
from homeostat.recovery.bounds import InterventionBounds, RiskBounds
from homeostat.twin.settings import TwinSettings

WEEK_TICKS: Final = 604_800
"""Ticks of the longest run: a week of a plant that is sampled once per second."""
MOST_STEPS: Final = 1_000_000
"""Simulated ticks of one hypothesis in one rollout, over all parameter draws."""
Name: TypeAlias = Annotated[str, StringConstraints(min_length=1, max_length=120, pattern=r"^\S+$")]
"""Name of a tag, variable, state, limit or transition; whether the plant has it is checked against the plant."""
Text: TypeAlias = Annotated[str, StringConstraints(min_length=1, max_length=200, strip_whitespace=True)]
"""A title for people."""


class Table(BaseModel):
    """A table of the file: no unknown key, no conversion, nothing that changes later."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    def given(self) -> dict[str, Any]:
        """What the file states; the rest keeps the defaults of the type that is filled."""
        return {name: getattr(self, name) for name in self.model_fields_set}


class TimeTable(Table):
    """``[time]``: how often the plant is sampled, and how fast it is; see `Timing`."""

    tick_s: Annotated[float, within(0.001, 3600.0, "s", "nothing is computed faster, and somebody looks each hour")] = (
        TICK_S
    )
    """Time between two samples [s]."""
    response_s: Annotated[float, within(0.01, WEEK_S, "s", "what responds later is not recovered")] | None = None
    """How long the slowest loop takes to respond [s]; by the reset times of the loops where it is not stated."""


class RunTable(Table):
    """``[run]``: how long a run is."""

    end_s: Annotated[float, ticks(10, WEEK_TICKS, f"a run lasts some samples and at most {WEEK_TICKS} ticks")]
    """Length of a run [s]."""
    onset_s: Annotated[float, ticks(0, WEEK_TICKS, "a fault begins in the run")]
    """Default onset of a fault [s]."""
    started_by: Name | None = None
    """Transition whose guard holds once the plant has left start-up; see `homeostat.plants.settings.defaults`."""

    @model_validator(mode="after")
    def _onset_before_end(self) -> RunTable:
        if self.onset_s >= self.end_s:
            raise ValueError(f"onset_s = {self.onset_s:g} s must be before end_s = {self.end_s:g} s")
        return self


class ObjectiveTable(Table):
    """``[objective]``: what production is."""

    throughput: Name
    """Tag whose mean is the production rate."""
    design_rate: (
        Annotated[float, within(1e-9, 1e9, "(tag's unit)", "a plant is designed to produce something")] | None
    ) = None
    """Its value by design, in the tag's unit; see `homeostat.plants.settings.defaults`."""
    per_s: Annotated[float, within(1.0, WEEK_S, "s", "1 for a rate, the time of a batch for an amount")] = 1.0
    """Time in which so much is made: 1 for a tag that is a rate per second, a batch's time for an amount [s]."""
    currency: Annotated[str, StringConstraints(pattern=r"^\S{1,12}$")] = "units"
    """What the table of prices is in."""
    delivered: Annotated[list[Name], Len(1, 40)]
    """True quantities whose sum is what was produced so far."""
    priced: Literal["total", "throughput"] | None = None
    """What decisions are priced by: the total of ``delivered``, or ``throughput`` itself; None for what follows."""
    totals: dict[Name, Name] = {}
    """What is added up over a run -> the true quantity."""
    reported: list[Name] = []
    """Those of the totals that a study keeps of every run and reports; a name is a quantity, ``_`` and its unit."""

    @model_validator(mode="after")
    def _reported_is_added_up(self) -> ObjectiveTable:
        for name in self.reported:
            if name not in self.totals:
                raise ValueError(f"reported names {name!r}, which totals do not add up")
            if name in RESERVED:
                message = f"reported names {name!r}, which every row of a study has for something else"
                raise ValueError(f"{message}; call the total otherwise, as {name}_L or {name}_s with its unit")
        return self

    @property
    def production(self) -> Production:
        """As the search knows it, of completed settings."""
        assert self.design_rate is not None
        delivered = tuple(self.delivered) if self.priced == "total" else ()
        return Production(self.throughput, self.design_rate, self.per_s, delivered)


class BalanceTable(Table):
    """``[twin.balances.STATE]``: a disturbance that nobody knows of is estimated there; see `Balance`."""

    quantity: Annotated[str, StringConstraints(pattern=r"^[a-z][a-z_]{0,30}$")]
    component: Name
    unit: Name
    capacity: Text
    large: Annotated[float, within(1e-12, 1e12, "(the balance's unit)", "a large disturbance is more than none")]
    only_lost: bool = False
    most: (
        Annotated[float, within(1e-12, 1e12, "(the balance's unit)", "nothing can bring less than nothing")] | None
    ) = None

    @model_validator(mode="after")
    def _most_is_large(self) -> BalanceTable:
        if self.most is not None and self.most < self.large:
            raise ValueError(f"most = {self.most:g} {self.unit} is less than large = {self.large:g} {self.unit}")
        return self


class TwinTable(Table):
    """``[twin]``: how the twin is judged and used; what the keys mean stands at `TwinSettings`.

    Errors that are not stated, and what is corrected, follow: see `homeostat.plants.settings.defaults`.
    """

    errors: Annotated[dict[Name, Annotated[list[Deviation], Len(2, 2)]], Len(1)] = {}
    ignored: list[Name] = []
    """Variables whose readings speak neither for nor against a fault, such as what the model takes as it is read."""
    corrected: Annotated[list[Name], Len(1)] = []
    initial: Annotated[dict[Name, Deviation], Len(1)]
    gain_error: Fraction
    size_error: Annotated[float, within(0.0, 2.0, "(fraction)", "a size that is wrong by more says nothing")] | None = (
        None
    )
    least_size_error: (
        Annotated[float, within(0.0, 2.0, "(fraction)", "a size that is wrong by more says nothing")] | None
    ) = None
    misled: (
        Annotated[float, within(0.0, 0.4, "(probability)", "a twin that misleads more often is of no use")] | None
    ) = None
    lag_error_s: Annotated[float, ticks(0, 30, "a twin that lags by more is of no use")] | None = None
    damping: dict[Name, Annotated[float, ticks(0, 30, "a transmitter that is slower shows no fault in time")]] = {}
    balances: dict[Name, BalanceTable] = {}
    unknown_growth: Annotated[float, within(0.0, 10.0, "(fraction)", "it is a share of a size")] | None = None
    lead_s: Stretch | None = None
    replay_s: Stretch | None = None
    recent_s: Stretch | None = None
    synchronise_s: Stretch | None = None
    settle_rows: Rows | None = None
    horizon_s: Horizon | None = None
    judged_draws: Draws | None = None
    draws: Draws | None = None
    search_draws: Draws | None = None
    stride: Stride | None = None

    @model_validator(mode="after")
    def _fits(self, info: ValidationInfo) -> TwinTable:
        timing = timing_of(info)
        twin = with_times(self, timing).settings
        if twin.stride > twin.horizon_s:
            raise ValueError(f"stride = {twin.stride} s must be at most horizon_s = {twin.horizon_s} s")
        for name in ("judged_draws", "draws", "search_draws"):
            if (steps := getattr(twin, name) * timing.ticks(twin.horizon_s)) > MOST_STEPS:
                raise ValueError(
                    f"{name} x horizon_s = {steps} ticks, more than {MOST_STEPS}: no rollout would end while it matters"
                )
        if twin.lead_s > twin.replay_s:
            raise ValueError(f"lead_s = {twin.lead_s} s must be at most replay_s = {twin.replay_s} s")
        if twin.settle_rows > timing.ticks(twin.replay_s):
            raise ValueError(
                f"settle_rows = {twin.settle_rows} must be at most replay_s = {twin.replay_s}, in readings"
            )
        return self

    @property
    def settings(self) -> TwinSettings:
        """As the twin takes them."""
        errors = {name: (noise, model) for name, (noise, model) in self.errors.items()}
        others = ("balances", "ignored")  # those name tags, and what has no error
        own = {name: value for name, value in self.given().items() if name not in others}
        return TwinSettings(**{**own, "errors": errors, "corrected": tuple(self.corrected)})


class MonitoringTable(Table):
    """``[monitoring]``: what the keys mean stands at `MonitoringSettings`."""

    settle_s: SomeTime | None = None
    centre_s: Annotated[float, ticks(1, 1e6, "a mean needs a sample, and 1e6 ticks are never")] | None = None
    adapt_s: Annotated[float, ticks(600, 1e6, "a plant that is followed at once has no symptoms")] | None = None
    sure: Annotated[float, within(0.5, 1.0, "(probability)", "what is less probable than not is not sure")] | None = (
        None
    )
    evidence_s: SomeTime | None = None
    again_s: Pause | None = None
    transient_s: SomeTime | None = None
    review_s: Pause | None = None
    repeat_s: Pause | None = None

    @property
    def settings(self) -> MonitoringSettings:
        """As monitoring takes them."""
        return MonitoringSettings(**self.given())


class InterventionTable(Table):
    """``[intervention]``, which may be called ``[patience]``: what the keys mean stands at `InterventionBounds`."""

    calm_s: SomeTime | None = None
    improvements: Annotated[int, within(0, 100, "proposals", "each one is searched and judged")] | None = None
    slack_s: Pause | None = None
    stray: Annotated[float, within(0.1, 100.0, "scales of the unit", "less is noise, and more is never")] | None = None
    stray_s: Pause | None = None
    repeat_s: Pause | None = None
    probes: Annotated[int, within(0, 10, "probes", "whoever only tries things recovers nothing")] | None = None
    probe_s: Pause | None = None
    back_s: Pause | None = None
    waits: Annotated[int, within(0, 10, "waits", "whoever only waits recovers nothing")] | None = None
    answer_s: Pause | None = None

    @property
    def settings(self) -> InterventionBounds:
        """As recovery takes them."""
        return InterventionBounds(**self.given())


Timed = TypeVar("Timed", TwinTable, MonitoringTable, InterventionTable)
_FILLED: Final[dict[type[Table], Any]] = {
    TwinTable: TwinSettings,
    MonitoringTable: MonitoringSettings,
    InterventionTable: InterventionBounds,
}
"""Table with times of the plant -> the type that it fills, whose defaults are those of the reference."""
_REPLAYED: Final = frozenset({"lead_s", "replay_s", "recent_s", "synchronise_s"})
"""Times of which the twin keeps the readings."""
_NOT_OF_THE_PLANT: Final = frozenset({"lag_error_s"})
"""Times that are none where nothing is stated."""


def with_times(table: Timed, timing: Timing) -> Timed:
    """``table`` with the times that it leaves open as they are for a plant of this ``timing``."""
    found: dict[str, float] = {}
    for field in fields(_FILLED[type(table)]):
        timed = field.name in type(table).model_fields and (field.name.endswith("_s") or field.name == "stride")
        if not timed or field.name in table.given() or field.name in _NOT_OF_THE_PLANT:
            continue
        default: Any = field.default
        value = timing.time_s(default)
        if field.name in _REPLAYED:
            value = min(value, HISTORY * timing.tick_s)
        if value != default:
            found[field.name] = value
    return table.model_copy(update=found)


class RiskTable(Table):
    """``[risk]``: what the keys mean stands at `RiskBounds`."""

    required: Annotated[float, within(1e-4, 0.5, "(probability)", "10,000 draws show 0.0003 at best")] | None = None
    level: Annotated[float, within(0.5, 0.9999, "(confidence)", "less is a guess")] | None = None
    most: Annotated[int, within(16, 100_000, "rollouts", "fewer bound nothing")] | None = None
    batch: Annotated[int, within(1, 4_096, "rollouts", "they are simulated at once")] | None = None
    listed: (
        Annotated[int, within(0, 512, "rollouts", "they are simulated at once, for all that could be done")] | None
    ) = None

    @property
    def settings(self) -> RiskBounds:
        """As the release check takes them."""
        return RiskBounds(**self.given())


class LinkTable(Table):
    """``[link]``: what the plant's control system needs; the guard waits beside its ticks."""

    lease_within_s: Annotated[
        float, within(1.0, LONGEST_LEASE_S, "s", "a tick passes meanwhile, and an attempt is made every 600 s at least")
    ] = LEASE_WITHIN_S
    """Longest that it needs to give a lease, wall-clock [s]."""


class FigureTable(Table):
    """``[[figure]]``: one panel; see `homeostat.plants.settings.figure_panel`."""

    title: Text
    """What it shows."""
    kind: str = "lines"
    """``lines`` or ``strips``."""
    tags: Annotated[list[Name], Len(1, 40)]
    """Tags that are drawn."""
    limits: list[Name] = []
    """Limits that are drawn as lines."""
    guards: list[Name] = []
    """Transitions whose guards are drawn as lines."""
    window: Annotated[list[Finite], Len(2, 2)] | None = None
    """Ends of the axis, in the tags' unit; strips have none."""

    @model_validator(mode="after")
    def _window_of_lines(self) -> FigureTable:
        if self.window is None and self.kind == "lines":
            raise ValueError("lines need a window = [low, high]")
        if self.window is not None and not self.window[0] < self.window[1]:
            raise ValueError(f"window = {self.window} must have its lower end first")
        return self


class DrawingTable(Table):
    """``[drawing]``: what somebody who looked at the flowsheet's drawing would have otherwise."""

    later: dict[Name, Annotated[int, within(1, 20, "layers", "a drawing has some ten")]] = {}
    """Process operator or flow -> by how many layers it stands further on, and whatever follows it."""
    order: Annotated[list[Name], Len(0, 200)] = []
    """Process operators and flows in the order in which they stand, from the top, wherever they share a layer."""


class Settings(Table):
    """The whole file."""

    title: Text
    """The plant, in the engineer's words."""
    model: Annotated[str, StringConstraints(pattern=r"^[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*$", max_length=200)]
    """The process model, as ``module:class``."""
    system: Annotated[str, StringConstraints(pattern=r'^[a-z][a-z0-9+.-]*:[^\s<>"{}|^`\\#]+#[\w.-]+$', max_length=200)]
    """IRI of the plant in its graph."""
    recipe: Literal["guard", "plant"] = "guard"
    """Who runs the nominal sequence in modes that write; in the others the plant does."""
    time: TimeTable = TimeTable()
    """How often the plant is sampled."""
    run: RunTable
    """How long a run is."""
    start: dict[Name, Finite] | None = None
    """Commanded tag -> its value at the start of a run, in its unit; what is not given is on automatic.

    Where there is no such table, see `homeostat.plants.settings.defaults`."""
    objective: ObjectiveTable
    """What production is."""
    twin: TwinTable
    """How the twin is judged and used."""
    monitoring: MonitoringTable = MonitoringTable()
    """How long monitoring waits before it speaks."""
    intervention: InterventionTable = InterventionTable()
    """How eagerly a plant is improved."""
    risk: RiskTable = RiskTable()
    """How sure a release must be that no hard limit is violated."""
    link: LinkTable = LinkTable()
    """What the plant's control system needs."""
    drawing: DrawingTable = DrawingTable()
    """How the flowsheet is drawn."""
    figure: list[FigureTable] | None = None
    """Panels of a run's figure; where there is none, see `homeostat.plants.settings.defaults`."""

    @property
    def namespace(self) -> str:
        """What the names of the plant's things begin with."""
        return self.system.rpartition("#")[0] + "#"
