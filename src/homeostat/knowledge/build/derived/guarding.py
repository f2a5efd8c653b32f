"""How limits are watched, tags written and readings believed, where no row says it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from homeostat.knowledge.build.derived.draft import Draft, Line, number, one_digit, written
from homeostat.knowledge.build.derived.instruments import STALE, absolute_noise
from homeostat.knowledge.build.derived.loops import driven_by_loops, is_commanded
from homeostat.knowledge.checks.consistency_bounds import SCALE_TICKS, WORST_TICKS
from homeostat.knowledge.checks.reach import deepest
from homeostat.stl.constants import filled
from homeostat.stl.formula import Formula, FormulaError, parse
from homeostat.stl.text import render

TRIP_GRACE: Final = 10.0
"""For so long nobody may see a hard limit before the fallback acts, in ticks."""
CONFIRM: Final = 3.0
"""A command is read back within so many ticks."""
ACTS_WITHIN_S: Final = 60.0
"""A fallback brings a limit back within this time, by the reference [s]."""
NOISES: Final = 20.0
"""A threshold is so many standard deviations of a reading [1]."""


def add_guarding(draft: Draft) -> None:
    """Add how limits are served and watched, how tags are written and when readings are believed."""
    _add_effects(draft)
    _add_trips(draft)
    _add_writables(draft)
    inner = {line["sp"] for line in draft.lines("loops") if not is_commanded(draft, line["sp"])}
    for line in draft.lines("signals"):
        if line["relation"] == "overrides" or line["tag"] in inner:
            continue  # on automatic it has no value, and nobody can say how old that is
        own = {"tag": line["tag"], "stale_s": written(STALE * draft.timing.tick_s), "grace_s": "0"}
        draft.add("quality", line.follows, own | {"description": "Worked out or read back, without noise"})


def _add_effects(draft: Draft) -> None:
    """The only fallback serves every hard limit; of several, the table must say which one does."""
    strategies = draft.column("fallbacks", "strategy")
    if len(strategies) == 1:
        for line in _hard(draft):
            within_s = written(draft.timing.time_s(ACTS_WITHIN_S))
            own = {"strategy": min(strategies), "limit": line["id"], "acts_within_s": within_s, "rest": "0"}
            draft.add("fallback_limits", line.follows, own | {"description": "The only fallback there is"})


def _hard(draft: Draft) -> Iterator[Line]:
    return (line for line in draft.lines("limits") if line["hard"] == "yes")


@dataclass(frozen=True, slots=True)
class _Unit:
    """What the rule language asks of a name."""

    unit: str
    scale: float


def _add_trips(draft: Draft) -> None:
    noises = {line["tag"]: absolute_noise(line) for line in draft.lines("instruments")}
    for line in _hard(draft):
        cusum = _threshold(draft, line["formula"], noises)
        words = f"{NOISES:g} standard deviations of a reading, and at least what counts as one"
        grace_s = written(TRIP_GRACE * draft.timing.tick_s)
        own = {"limit": line["id"], "cusum": written(cusum), "grace_s": grace_s, "lift": "0", "lift_s": "0"}
        draft.add("trips", line.follows, own | {"description": words})


def _threshold(draft: Draft, text: str, noises: dict[str, float]) -> float:
    """What a violation adds up to before it trips, in the unit of the limit's margin times s; a reading counts a tick.

    It grows with the tick, therefore.
    """
    ranges, units = {}, {}
    for line in draft.lines("signals"):
        low, high, scale = (number(line[column]) for column in ("low", "high", "scale"))
        if low is not None and high is not None and scale is not None and scale > 0.0:
            ranges[line["tag"]], units[line["tag"]] = (low, high), _Unit(line["unit"], scale)
    formula = _read(draft, text, units)
    if formula is None or not formula.tags:
        return 0.0
    if len({units[tag].unit for tag in formula.tags}) == 1:
        scale, noise = max(units[tag].scale for tag in formula.tags), max(noises.get(tag, 0.0) for tag in formula.tags)
    else:
        scale, noise = 1.0, max(noises.get(tag, 0.0) / units[tag].scale for tag in formula.tags)
    most = min(SCALE_TICKS * scale, WORST_TICKS * deepest(formula, ranges))
    return draft.timing.tick_s * min(max(NOISES * noise, scale), most)


def _read(draft: Draft, text: str, units: dict[str, _Unit]) -> Formula | None:
    """A limit with numbers in place of parameters; None where it cannot be read, which is said where it is used."""
    values = {line["symbol"]: number(line["value"]) for line in draft.lines("parameters")}
    known = {symbol: value for symbol, value in values.items() if value is not None and symbol not in units}
    try:
        return parse(render(filled(parse(text).root, known)), units)
    except (FormulaError, RecursionError):
        return None


def _add_writables(draft: Draft) -> None:
    """Add a row for every tag that a state or a fallback commands."""
    driven = driven_by_loops(draft)
    for table in ("setpoints", "fallbacks"):
        for line in draft.lines(table):
            tag = draft.find("signals", line["tag"])
            if tag is None:
                continue
            automatic = tag["relation"] == "overrides" and tag["component"] in driven
            own = {
                "tag": tag["tag"],
                "tolerance": written(_tolerance(tag)),
                "confirm_s": written(CONFIRM * draft.timing.tick_s),
                "ramped_by": "plant",
                "automatic": "yes" if automatic else "no",
                "description": "Half of the step in which it is set",
            }
            draft.add("writables", line.follows, own)


def _tolerance(tag: Line) -> float:
    """Half of the increment of a tag; of 1 % of its range where it has none, or two positions."""
    low, high, increment = (number(tag[column]) for column in ("low", "high", "increment"))
    span = high - low if low is not None and high is not None and high > low else 0.0
    if increment is not None and (increment < span or not span):
        return increment / 2.0
    return one_digit(span / 200.0)
