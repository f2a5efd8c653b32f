"""The page of the Tennessee Eastman plant."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.host import commit, measured_on
from benchmarks.tennessee import campaign as campaigned
from benchmarks.tennessee.alone import Trip, Upset
from benchmarks.tennessee.bars import missed
from benchmarks.tennessee.engine import MEMBERS, Speed
from benchmarks.tennessee.operated import HOURS, LEVELS, MISMATCH, THOUGHT_S, Looked
from benchmarks.tennessee.published import OUTPUTS, SETTLED_H
from benchmarks.tennessee.qualify import qualified
from benchmarks.tennessee.spread import mean
from benchmarks.unknown.sections import table
from homeostat.record.row import Row

WITHIN = 0.05
"""How far a time to a trip may be from that of the published code [1]."""
HEAD = """# Tennessee Eastman

Made by `python -m benchmarks.tennessee` for the sources of `{commit}`. The plant of Downs and Vogel (1993) with the
decentralised control of Ricker (1996), put together from blocks ([decision
0055](../decisions/0055-the-tennessee-eastman-plant.md)). What is not there and not known stands in
[limitations](../limitations.md).

## Beside the published code

*Published*: the published code in `tep-studio`, control every 1.8 s, two seeds
(`python -m benchmarks.tennessee.published`, which needs that package, wrote `benchmarks/tennessee/published.csv`).
*Ours*: control every 60 s, the stated parameters as that has them (mismatch `published`), random courses and noise of
each seed; what is a fault of the plant's tables has its name, the rest is what happens to the true plant
(`benchmarks/tennessee/disturbances.csv`, which has 21 to 28 of the revised code, too). Nobody acts; 24 h. *Agrees*:
both trip or both do not, and the mean times to a trip differ by at most 5 %. Rates, readings and the base case are
compared by
`tests/plants/tennessee_eastman`.
"""
VARIES = f"""How much outputs vary, as the ratio of our standard deviation (true values) to the published one (readings,
in the unit), from {SETTLED_H:g} h after the onset on, of all seeds together. 0 is the plant to which nothing
happens: the published readings of temperature and level are mostly noise there, and ours move by what control makes of
noise once a minute. Random courses are others in each run, and those of 8 and 13 are few slow swings: their ratios are
rough.
"""
CAMPAIGN = """## Thirteen scenarios in three seeds

`campaigns/tennessee.toml`: ours, of the shape of a published study (arXiv 2608.19819) whose definitions are not public.
Each begins under regulatory control. *Kept*: seeds in which no trip limit is left; *acted*: in which a proposal was
released or the fallback acted; *at the grade*: of those of quality, in which the product is within the soft limit of
its grade at the end, which no trip limit and no `success` asks for; *lost*: mean share of the production of the same
plant without a fault. `do-nothing` is regulatory control.
"""
OPERATED = """## Looked after

Everything on, for {hours} h after the onset; every thought declared as {thought:g} s; the true plant is not the
model (mismatch `{mismatch}`: kinetics and valve ranges within 5 %, heat transfer within 10 % in 95 of 100 plants; bent
valves, films, heat losses, daily waters). Every published disturbance by itself, and every valve stuck closed, stuck
open, and stuck as it stands. *With nobody*: the same plant. {there} of {asked} runs are in. *Called*: what was
likeliest when something was released, or was said last. *To act by*: the latest time at which something must be done,
as the twin said first; that is five minutes before the first of its members trips, and compares with the trip *with
nobody*. *Margin*: the least true one to a trip limit, in scales of its unit. *By hindsight*, from the moment at which
it was noticed: how many constant answers of all states that may be recovered to keep every trip limit ({levels} values
of each open setpoint and that of the design, on the true plant with its faults known), and what the cheapest loses.
*Decided*: by the clock, from the notice to the first action, on a host that had other work.
"""
ENGINE = """## Engine

Times by the clock of a host that had other work: compare them with its yardstick below.
"""
MISSED = "## Asked for, and not there"


@dataclass(frozen=True)
class Beside:
    """Runs with nobody, ours beside those of the published code; by the number of the disturbance, 0 for none."""

    upsets: Mapping[int, Upset]
    """What each is here."""
    ours: Mapping[int, Sequence[Trip]]
    theirs: Mapping[int, Sequence[Trip]]
    varies: Mapping[int, list[Mapping[str, float]]]
    """Standard deviation of each output in each of our runs, in its unit."""
    varied: Mapping[int, list[Mapping[str, float]]]
    """The same of the published ones."""


def write(
    path: Path,
    beside: Beside,
    runs: Sequence[Looked],
    asked: int,
    speed: Speed,
    campaign: Sequence[Row],
) -> None:
    """Write the page; ``asked``: how many ``runs`` there are when all are in."""
    kinds = qualified()
    sections = (
        HEAD.format(commit=commit("src", "benchmarks/tennessee")) + "\n" + _beside(beside),
        VARIES + "\n" + _varies(beside),
        CAMPAIGN + "\n" + (campaigned.told(campaign, kinds) if campaign else "None of it is in."),
        OPERATED.format(hours=HOURS, mismatch=MISMATCH, thought=THOUGHT_S, there=len(runs), asked=asked, levels=LEVELS)
        + "\n"
        + _summary(runs)
        + "\n\n"
        + _operated(runs),
        ENGINE + "\n" + _engine(speed),
        _missed([*_apart(beside), *campaigned.missing(campaign, kinds), *missed(runs, asked)]),
        measured_on(),
    )
    path.write_text("\n\n".join(sections) + "\n", encoding="utf-8")


def _engine(speed: Speed) -> str:
    rows = [
        (f"{MEMBERS} members for an hour, with noise", "2.5 s", speed.crowd_s, 2.5),
        ("from nothing to a kernel", "40 s", speed.cold_s, 40.0),
        ("the same where machine code is there", "3 s", speed.again_s, 3.0),
    ]
    told = ((what, asked, f"{took:.1f} s", "yes" if took <= bar else "**no**") for what, asked, took, bar in rows)
    return table(("what", "asked for", "measured", "met"), list(told))


def agrees(ours: Sequence[Trip], theirs: Sequence[Trip]) -> bool:
    """Whether both trip, at about the same time, or neither does."""
    here, there = ([trip.hours for trip in each] for each in (ours, theirs))
    if math.isinf(min(*here, *there)):
        return True
    if math.isinf(max(*here, *there)):
        return max(here) == min(here) == max(there) == min(there)
    return abs(sum(here) / len(here) / (sum(there) / len(there)) - 1.0) <= WITHIN


def _beside(beside: Beside) -> str:
    rows = []
    for idv, published in beside.theirs.items():
        mine = beside.ours[idv]
        met = "yes" if agrees(mine, published) else "**no**"
        told = ("; ".join(trip.told for trip in each) for each in (published, mine))
        rows.append((idv, beside.upsets[idv].told, *told, met))
    return table(("IDV", "in our words", "published", "ours", "agrees"), rows)


def _varies(beside: Beside) -> str:
    rows = []
    for idv, theirs in sorted(beside.varied.items()):
        here, there = mean(beside.varies[idv]), mean(theirs)
        rows.append((idv, *(f"{here[name] / there[name]:.2f} of {there[name]:.3g}" for name in OUTPUTS)))
    return table(("IDV", *OUTPUTS), rows)


def _summary(runs: Sequence[Looked]) -> str:
    """How many trip, with nobody and looked after, and how many of what stands in no table is called unknown."""
    if not runs:
        return "None of it is in."
    alone, ours = (sum(t) for t in ([math.isfinite(r.trip.hours) for r in runs], [r.outside_s > 0.0 for r in runs]))
    hidden = [run for run in runs if run.hidden]
    noticed = [run for run in hidden if run.called]
    return (
        f"With nobody {alone} of {len(runs)} leave a trip limit, looked after {ours}. Of {len(hidden)} runs with what "
        f"stands in no table {len(noticed)} were given a name or called unknown: {sum(r.unknown for r in noticed)} "
        "unknown."
    )


def _missed(found: Sequence[str]) -> str:
    """What was asked for and does not follow from what is in."""
    return "\n".join([MISSED, "", *(f"- {text}" for text in found or ["nothing"])])


def _apart(beside: Beside) -> Iterator[str]:
    """What trips otherwise than in the published code."""
    if numbers := [n for n, theirs in beside.theirs.items() if not agrees(beside.ours[n], theirs)]:
        where = ", ".join(map(str, numbers))
        yield f"trips as in the published code, within {WITHIN:.0%} of the time: not with IDV {where}"


def _operated(runs: Sequence[Looked]) -> str:
    heads = (
        "disturbance", "seed", "with nobody", "outcome", "noticed", "called", "to act by", "released", "action",
        "margin", "lost", "outside a trip limit", "by hindsight", "decided", "CPU",
    )  # fmt: skip
    rows = [
        (
            f"{one.name}: `{one.told}`", one.seed, one.trip.told, one.outcome, _minutes(one.detected_s), _called(one),
            _minutes(one.foreseen_s), _minutes(one.released_s), one.action or "none",
            f"{one.least_margin:.2f} ({one.least_margin_limit})", "none" if one.lost is None else f"{one.lost:.1%}",
            _outside(one), _hindsight(one),
            "" if one.decision_s is None else f"{one.decision_s:.0f} s", f"{one.cpu_s:.0f} s",
        )
        for one in runs
    ]  # fmt: skip
    return table(heads, rows)


def _outside(one: Looked) -> str:
    return f"{one.outside_s:.0f} s" if math.isfinite(one.outside_s) else "to the end"


def _called(one: Looked) -> str:
    return f"`{one.called}` {one.probability:.2f}" if one.probability is not None else "nothing"


def _hindsight(one: Looked) -> str:
    if not one.tried:
        return "nothing to do"
    kept = f"{one.kept_by} of {one.tried} keep them"
    return kept if one.best_lost is None else f"{kept}, {one.best_lost:.1%} lost"


def _minutes(seconds: float | None) -> str:
    return "never" if seconds is None else f"{seconds / 60.0:.0f} min"
